"""Sentences of a study's report: on simulation, and on what is left out."""

from __future__ import annotations

__all__ = ["BANNER", "CANNOT", "NO_MAP", "NO_MARGIN", "NO_TRIAL"]

BANNER = "Simulated: no person took part"

#: What a simulation can and cannot show.
CANNOT = (
    "What such a simulation can show: that design, recording, map, control signal and "
    "statistics work together from end to end; how error, noise, delay and gaps pass "
    "through that chain; how many participants a real study would need; which settings "
    "matter to the method itself.",
    "What it cannot show: how well people do. The operators follow a model of human "
    "tracking whose free parameters were taken from the literature, and many settings "
    "of them fit the paper's figures as well; the difference between two devices is "
    "largely what was put into the model. Comfort, fatigue, attention, "
    "embodiment and learning by understanding are not in it. A difference between "
    "conditions here, or none, is no evidence about people.",
)

NO_MAP = (
    "Left out: no visit has a recorded session, or a folder `subject` (as `ikns "
    "calibrate` writes it) in it or next to it, to take a map from."
)

NO_MARGIN = "No margin was declared beforehand, so equivalence was not tested."
NO_TRIAL = "No trial was finished, so there is nothing to draw or to test."
