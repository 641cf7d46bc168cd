"""Calibration: from a static trial and explorations to a subject and a report.

`procedure` runs all steps. `scaling` fits the skeleton (`static_trial`, `size_fit`),
`elbow` defines the sign of c, `report` the report, `judge` says what is wrong.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ikns.calibration.elbow import elbow_reference, two_arms_fault
    from ikns.calibration.procedure import calibrate
    from ikns.motion.marker_ik.visibility import (
        say_apart,
        segment_pairs,
        sight_needs,
    )

__all__ = [
    "calibrate",
    "elbow_reference",
    "say_apart",
    "segment_pairs",
    "sight_needs",
    "two_arms_fault",
]

_FILES = {
    "calibrate": "ikns.calibration.procedure",
    "elbow_reference": "ikns.calibration.elbow",
    "two_arms_fault": "ikns.calibration.elbow",
} | dict.fromkeys(
    ("say_apart", "segment_pairs", "sight_needs"), "ikns.motion.marker_ik.visibility"
)


def __getattr__(name: str) -> Any:
    """Load on first use: who reads a subject calibrates nothing."""
    if name not in _FILES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}.")
    return getattr(importlib.import_module(_FILES[name]), name)
