"""Simulated pick and place with contact physics."""

from ikns.simulation.grasp.carried_arm import CarriedArm
from ikns.simulation.grasp.parts import Solid, constant, finger_parts
from ikns.simulation.grasp.person import Habits, Person, draw_habits
from ikns.simulation.grasp.physics import Grasp
from ikns.simulation.grasp.pick import (
    ElbowInput,
    PickResult,
    RingInput,
    arch_length,
    pick,
)
from ikns.simulation.grasp.route import Route, hand_route
from ikns.simulation.grasp.world import grip_height, world_model

__all__ = [
    "CarriedArm",
    "ElbowInput",
    "Grasp",
    "Habits",
    "Person",
    "PickResult",
    "RingInput",
    "Route",
    "Solid",
    "arch_length",
    "constant",
    "draw_habits",
    "finger_parts",
    "grip_height",
    "hand_route",
    "pick",
    "world_model",
]
