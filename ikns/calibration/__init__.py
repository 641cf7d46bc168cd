"""Calibration: from a static trial and explorations to a subject and a report.

`procedure` runs all steps. `scaling` fits the skeleton (`static_trial`, `size_fit`),
`elbow` defines the sign of c, `report` the report, `judge` says what is wrong.
"""

from ikns.calibration.elbow import elbow_reference, two_arms_fault
from ikns.calibration.method_summary import method_summary
from ikns.calibration.procedure import calibrate
from ikns.calibration.rewear import rewear
from ikns.motion.marker_ik.visibility import (
    say_apart,
    segment_pairs,
    sight_needs,
)

__all__ = [
    "calibrate",
    "elbow_reference",
    "method_summary",
    "rewear",
    "say_apart",
    "segment_pairs",
    "sight_needs",
    "two_arms_fault",
]
