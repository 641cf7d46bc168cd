"""Pictures and pages of what the layers below know.

Import from :mod:`ikns.view.figures` and :mod:`ikns.view.report`, and only where
something is drawn: they load matplotlib.
"""
