"""Pictures and pages of what the layers below know.

Import from :mod:`ikns.view.figures`, :mod:`ikns.view.report` and
:mod:`ikns.view.scene` (three dimensions), and only where something is drawn: they load
matplotlib.
"""
