"""From visits on disk to the numbers of a report.

Everything is computed again from the attempts, one visit at a time; stored metrics are
not believed. People and simulated participants are never added up.
"""

from ikns.experiments.study.summary.cells import Cell, Mean, cells, mean_of
from ikns.experiments.study.summary.digest import Digest, LeftOut, digest_visit
from ikns.experiments.study.summary.picking import (
    ObjectCell,
    PickComparison,
    PickingSummary,
)
from ikns.experiments.study.summary.running_error import ErrorOverTime, RunningError
from ikns.experiments.study.summary.study import Group, StudySummary, summarize
from ikns.experiments.study.summary.tracking import Comparison, TrackingSummary
from ikns.experiments.study.summary.variations import Varied, variations

__all__ = [
    "Cell",
    "Comparison",
    "Digest",
    "ErrorOverTime",
    "Group",
    "LeftOut",
    "Mean",
    "ObjectCell",
    "PickComparison",
    "PickingSummary",
    "RunningError",
    "StudySummary",
    "TrackingSummary",
    "Varied",
    "cells",
    "digest_visit",
    "mean_of",
    "summarize",
    "variations",
]
