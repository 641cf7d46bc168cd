"""A body's kinematics as CasADi expressions, and optimizations with them."""

from ikns.symbolic.control_range import ControlRange, available_control
from ikns.symbolic.held_hand import HeldHand, available_range, longest_sweep
from ikns.symbolic.kinematics import (
    chain_jacobian,
    link_in_thorax,
    markers_in_world,
)
from ikns.symbolic.length_fit import LengthFit, fit_lengths
from ikns.symbolic.results import AvailableRange, Sweep
from ikns.symbolic.volumes import Capsule, arm_pairs, capsules

__all__ = [
    "AvailableRange",
    "Capsule",
    "ControlRange",
    "HeldHand",
    "LengthFit",
    "Sweep",
    "arm_pairs",
    "available_control",
    "available_range",
    "capsules",
    "chain_jacobian",
    "fit_lengths",
    "link_in_thorax",
    "longest_sweep",
    "markers_in_world",
]
