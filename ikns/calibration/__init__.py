"""Calibration: a static trial and explorations in, a subject and an honest report out.

Read `procedure` first; `elbow` says which way c rises, `sight` which frames show the
chain, `report` what is written down.
"""

from ikns.calibration.elbow import elbow_reference
from ikns.calibration.procedure import calibrate
from ikns.calibration.sight import marker_fault, track_chain
from ikns.motion.marker_ik.visibility import (
    in_sight,
    say_apart,
    segment_pairs,
    sight_needs,
)

__all__ = [
    "calibrate",
    "elbow_reference",
    "in_sight",
    "marker_fault",
    "say_apart",
    "segment_pairs",
    "sight_needs",
    "track_chain",
]
