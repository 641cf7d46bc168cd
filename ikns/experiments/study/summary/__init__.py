"""From visits on disk to the numbers of a report.

Everything is computed from the attempts, one visit at a time; stored metrics are not
used. People and simulated participants are never pooled.
"""

from ikns.experiments.study.summary.digest import Digest, ExcludedVisit, digest_visit
from ikns.experiments.study.summary.means import (
    ConditionMean,
    Mean,
    condition_means,
    mean_of,
)
from ikns.experiments.study.summary.picking import (
    ObjectResult,
    PickComparison,
    PickingSummary,
)
from ikns.experiments.study.summary.running_error import ErrorOverTime, RunningError
from ikns.experiments.study.summary.study import Group, StudySummary, summarize
from ikns.experiments.study.summary.tracking import TrackingComparison, TrackingSummary
from ikns.experiments.study.summary.variations import VariationMean, compare_variations

__all__ = [
    "ConditionMean",
    "Digest",
    "ErrorOverTime",
    "ExcludedVisit",
    "Group",
    "Mean",
    "ObjectResult",
    "PickComparison",
    "PickingSummary",
    "RunningError",
    "StudySummary",
    "TrackingComparison",
    "TrackingSummary",
    "VariationMean",
    "compare_variations",
    "condition_means",
    "digest_visit",
    "mean_of",
    "summarize",
]
