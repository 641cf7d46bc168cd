"""Experiment 1: a pointer driven by c follows a curve; without screen or clock."""

from typing import TYPE_CHECKING, Any

from ikns.experiments.tracking.metrics import (
    Metrics,
    error_over_time,
    lag,
    measure,
    overshoot,
    spectral_arc_length,
)
from ikns.experiments.tracking.profiles import CHARACTERS, Profile, draw_profile
from ikns.experiments.tracking.schedule import TrackingStep, schedule, williams
from ikns.experiments.tracking.trial import TrackingRecord, TrackingTrial, TrackingView
from ikns.experiments.tracking.visit import Attempt, Visit

if TYPE_CHECKING:
    from ikns.experiments.tracking.virtual import virtual_step, virtual_trial

__all__ = [
    "CHARACTERS",
    "Attempt",
    "Metrics",
    "Profile",
    "TrackingRecord",
    "TrackingStep",
    "TrackingTrial",
    "TrackingView",
    "Visit",
    "draw_profile",
    "error_over_time",
    "lag",
    "measure",
    "overshoot",
    "schedule",
    "spectral_arc_length",
    "virtual_step",
    "virtual_trial",
    "williams",
]


def __getattr__(name: str) -> Any:
    """Load the virtual participant, and with it bodies and operators, on first use."""
    if name not in ("virtual_step", "virtual_trial"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}.")
    from ikns.experiments.tracking import virtual

    return getattr(virtual, name)
