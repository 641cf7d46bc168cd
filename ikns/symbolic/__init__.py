"""A body's kinematics as CasADi expressions, and optimizations with them."""

from ikns.symbolic.control_range import available_control
from ikns.symbolic.held_hand import HeldHand, available_range
from ikns.symbolic.kinematics import (
    chain_jacobian,
    link_in_thorax,
    markers_in_world,
)
from ikns.symbolic.length_fit import fit_lengths
from ikns.symbolic.volumes import capsules

__all__ = [
    "HeldHand",
    "available_control",
    "available_range",
    "capsules",
    "chain_jacobian",
    "fit_lengths",
    "link_in_thorax",
    "markers_in_world",
]
