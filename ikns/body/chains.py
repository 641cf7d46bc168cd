"""Joints of the chain of a task, and the hands that perform it.

Joint order within a chain is the order of the names in :data:`CHAINS`, never the order
of a file or a model, so directions stay comparable.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from ikns.errors import InvalidInput

#: Order of the side axis of every per-hand array.
SIDES = ("right", "left")

_ARM = (
    "shoulder_abduction",
    "shoulder_flexion",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_pronation",
    "wrist_flexion",
    "wrist_deviation",
)
_CLAVICLE = ("clavicle_protraction", "clavicle_elevation")


def _named(side: str, joints: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{side}_{joint}" for joint in joints)


#: Joints that a task uses (the intrinsic part); all others are extrinsic.
CHAINS: dict[str, tuple[str, ...]] = {
    "right_arm": _named("right", _ARM),
    "left_arm": _named("left", _ARM),
    "right_arm_clavicle": _named("right", _CLAVICLE + _ARM),
    "left_arm_clavicle": _named("left", _CLAVICLE + _ARM),
    "both_arms": _named("right", _ARM) + _named("left", _ARM),
}


def chain_joints(chain: str) -> tuple[str, ...]:
    """Return the joint names of a chain, in chain order."""
    if chain not in CHAINS:
        raise InvalidInput(
            f"unknown chain '{chain}', expected one of {sorted(CHAINS)}."
        )
    return CHAINS[chain]


@cache
def chain_sides(chain: str) -> tuple[str, ...]:
    """Return the sides whose hands perform the chain's task."""
    joints = chain_joints(chain)
    return tuple(side for side in SIDES if any(j.startswith(side) for j in joints))


def clavicle_counterpart(chain: str) -> str | None:
    """Return the same arm with the clavicle, or without it where the chain has it.

    None for a chain that has no such counterpart.

    >>> clavicle_counterpart("right_arm"), clavicle_counterpart("both_arms")
    ('right_arm_clavicle', None)
    """
    suffix = "_clavicle"
    bare = chain.removesuffix(suffix)
    other = bare if bare != chain else chain + suffix
    return other if other in CHAINS else None
