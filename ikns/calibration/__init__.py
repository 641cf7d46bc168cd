"""Calibration: a static trial and explorations in, a subject and an honest report out.

Read `procedure` first; `elbow` says which way c rises, `sight` which marker has moved,
`report` what is written down.
"""

from ikns.calibration.elbow import elbow_reference
from ikns.calibration.procedure import calibrate
from ikns.calibration.sight import marker_fault
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
