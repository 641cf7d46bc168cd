"""Calibration: from a static trial and explorations to a subject and a report.

`procedure` runs all steps. `scaling` fits the skeleton (`static_trial`, `size_fit`),
`elbow` defines the sign of c, `report` the report and whether markers moved.
"""

from ikns.calibration.elbow import elbow_reference
from ikns.calibration.procedure import calibrate
from ikns.calibration.report import marker_fault
from ikns.motion.marker_ik.visibility import (
    say_apart,
    segment_pairs,
    sight_needs,
)

__all__ = [
    "calibrate",
    "elbow_reference",
    "marker_fault",
    "say_apart",
    "segment_pairs",
    "sight_needs",
]
