"""Figures, reports and 3-D scenes of what the rooms below compute.

Import from :mod:`ikns.view.figures`, :mod:`ikns.view.report` and
:mod:`ikns.view.scene` (three dimensions), and only where something is drawn: they load
matplotlib.
"""
