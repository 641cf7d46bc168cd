"""What the chain of a task involves: its joints, its sides, whole arms.

Chains are data: those that come with the package are in ``urdf/chains.toml``, others
are made in Python or read from a file of the same form. Joint order within a chain is
the order of the names there, never that of a URDF or a model, so directions stay
comparable.
"""

from __future__ import annotations

from functools import cache

from ikns.body.chain import SIDES, Chain, ChainLike
from ikns.body.chain_files import as_chain, shipped_chains

__all__ = [
    "SIDES",
    "Chain",
    "ChainLike",
    "as_chain",
    "chain_joints",
    "chain_sides",
    "clavicle_counterpart",
    "end_sides",
    "joint_sides",
    "no_swivel",
    "shipped_chains",
    "whole_arms",
]

_CLAVICLE = ("clavicle_protraction", "clavicle_elevation")


def chain_joints(chain: ChainLike) -> tuple[str, ...]:
    """Return the joint names of a chain, in chain order."""
    return as_chain(chain).joints


@cache
def chain_sides(chain: ChainLike) -> tuple[str, ...]:
    """Return the sides of a chain's joints and ends: what must be seen of a person."""
    own = as_chain(chain)
    return _sides(own.joints + own.ends)


@cache
def joint_sides(chain: ChainLike) -> tuple[str, ...]:
    """Return the sides of a chain's joints."""
    return _sides(as_chain(chain).joints)


@cache
def end_sides(chain: ChainLike) -> tuple[str, ...]:
    """Return the sides whose links perform the chain's task."""
    return _sides(as_chain(chain).ends)


@cache
def whole_arms(chain: ChainLike) -> tuple[str, ...]:
    """Return the sides of a chain of whole arms, which end in their hands.

    Empty for any other chain, which has no elbow swivel.

    >>> whole_arms("both_arms"), whole_arms("left_arm_clavicle")
    (('right', 'left'), ('left',))
    """
    own = as_chain(chain)
    sides = end_sides(own)
    arms = {joint for side in sides for joint in chain_joints(f"{side}_arm")}
    spare = {f"{side}_{joint}" for side in sides for joint in _CLAVICLE}
    ends = tuple(f"{side}_knuckle" for side in sides)
    bare = own.hands is not None and own.ends == ends and not own.extrinsic
    return sides if bare and arms == set(own.joints) - spare else ()


def no_swivel(chain: ChainLike) -> str:
    """Say why a chain has no elbow swivel; empty for one whole arm."""
    if len(arms := whole_arms(chain)) == 1:
        return ""
    if arms:
        return (
            f"the swivel is that of one arm, found the chain '{chain}'; calibrate each "
            "arm by itself."
        )
    return (
        f"the chain '{chain}' has no elbow swivel: expected the seven joints of one "
        "arm, with or without the clavicle, that end in its hand."
    )


def clavicle_counterpart(chain: ChainLike) -> str | None:
    """Return the same arm with the clavicle, or without it where the chain has it.

    None for a chain that has no such counterpart.

    >>> clavicle_counterpart("right_arm"), clavicle_counterpart("both_arms")
    ('right_arm_clavicle', None)
    """
    suffix, name = "_clavicle", str(chain)
    bare = name.removesuffix(suffix)
    other = bare if bare != name else name + suffix
    return other if {name, other} <= set(shipped_chains()) else None


def _sides(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(side for side in SIDES if any(n.startswith(side) for n in names))
