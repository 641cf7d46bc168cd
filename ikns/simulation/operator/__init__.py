"""Virtual operators: simulated people who track, and the elements they control."""

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
from ikns.simulation.operator.loop import Delay, track
from ikns.simulation.operator.model import Operator

__all__ = [
    "CONDITIONS",
    "Ability",
    "ArmLoop",
    "Delay",
    "Operator",
    "Participant",
    "draw_participant",
    "phase_margin",
    "sample_abilities",
    "track",
    "tracking_place",
    "typical",
]
