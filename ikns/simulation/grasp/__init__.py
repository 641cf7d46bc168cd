"""Picking and placing with contact physics: simulated."""

from ikns.simulation.grasp.carried_arm import CarriedArm, hand_drift
from ikns.simulation.grasp.parts import Solid, constant, finger_parts
from ikns.simulation.grasp.person import Habits, Person, draw_habits
from ikns.simulation.grasp.physics import Grasp, Seen
from ikns.simulation.grasp.pick import Elbow, Picked, Ring, arch_length, pick
from ikns.simulation.grasp.route import Route, hand_route
from ikns.simulation.grasp.world import grip_height, world_model

__all__ = [
    "CarriedArm",
    "Elbow",
    "Grasp",
    "Habits",
    "Person",
    "Picked",
    "Ring",
    "Route",
    "Seen",
    "Solid",
    "arch_length",
    "constant",
    "draw_habits",
    "finger_parts",
    "grip_height",
    "hand_drift",
    "hand_route",
    "pick",
    "world_model",
]
