"""Virtual operators: simulated people who track, and what they act through."""

from ikns.simulation.operator.ability import (
    CONDITIONS,
    Ability,
    phase_margin,
    sample_abilities,
    typical,
)
from ikns.simulation.operator.arm_loop import ArmLoop
from ikns.simulation.operator.cohort import (
    Participant,
    draw_participant,
    tracking_place,
)
from ikns.simulation.operator.delayed_copy import Copyist
from ikns.simulation.operator.loop import Delay, Tracked, track
from ikns.simulation.operator.model import Operator, closed_loop, open_loop

__all__ = [
    "CONDITIONS",
    "Ability",
    "ArmLoop",
    "Copyist",
    "Delay",
    "Operator",
    "Participant",
    "Tracked",
    "closed_loop",
    "draw_participant",
    "open_loop",
    "phase_margin",
    "sample_abilities",
    "track",
    "tracking_place",
    "typical",
]
