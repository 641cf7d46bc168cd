"""A chain: the joints of a task, and the links that perform it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ikns.errors import InvalidInput

#: Order of the side axis of every per-hand array.
SIDES = ("right", "left")
#: Version of the files that hold chains.
FORMAT = 1


@dataclass(frozen=True)
class Chain:
    """Some joints, and the links that a task moves with them or leaves at rest.

    Parameters
    ----------
    name : str
        Not that of another chain that comes with the package.
    joints : tuple of str
        In the order of every joint vector; see :attr:`Skeleton.joint_names`.
    ends : tuple of str
        Links that perform the task, such as ``right_knuckle`` (the hand) or
        ``right_forearm`` (whose origin is the elbow). The gate is on the fastest of
        them, and a map has their middle for its places.
    base : str
        Link from which the ends are seen.
    extrinsic : bool
        Whether the task leaves the joints alone: they are no part of its chain.

    Raises
    ------
    InvalidInput
        When a name is empty or given twice, or there is no joint or no end. What the
        body lacks is noticed by :func:`ikns.body.skeleton.check_chain`.

    Examples
    --------
    >>> import ikns
    >>> arm = ikns.load_chain("right_arm")
    >>> elbow = ikns.Chain("right_elbow", arm.joints[:3], ("right_forearm",))
    >>> elbow.joints[-1], elbow.base, arm.ends
    ('right_shoulder_rotation', 'thorax', ('right_knuckle',))
    """

    name: str
    joints: tuple[str, ...]
    ends: tuple[str, ...]
    base: str = "thorax"
    extrinsic: bool = False

    def __post_init__(self) -> None:
        """Check the names, and keep them as tuples."""
        if not isinstance(self.name, str) or not self.name.strip():
            raise InvalidInput(f"expected a name for the chain, found {self.name!r}.")
        for field in ("joints", "ends"):
            names = getattr(self, field)
            named = () if isinstance(names, str) else tuple(names)
            if not named or not all(isinstance(n, str) and n for n in named):
                raise InvalidInput(
                    f"chain '{self.name}': expected {field} as a list of names, found "
                    f"{names!r}."
                )
            if twice := [n for n in dict.fromkeys(named) if named.count(n) > 1]:
                raise InvalidInput(
                    f"chain '{self.name}': expected each of its {field} once, found "
                    f"{', '.join(twice)} again."
                )
            object.__setattr__(self, field, named)
        if not isinstance(self.base, str) or not self.base:
            raise InvalidInput(
                f"chain '{self.name}': expected the name of a link as base, found "
                f"{self.base!r}."
            )
        if not isinstance(self.extrinsic, bool):
            raise InvalidInput(
                f"chain '{self.name}': expected extrinsic true or false, found "
                f"{self.extrinsic!r}."
            )

    def __str__(self) -> str:
        """Return the name."""
        return self.name

    @property
    def hands(self) -> tuple[int, ...] | None:
        """Ends as entries of the side axis; None where one is no hand, or a base is."""
        knuckles = [f"{side}_knuckle" for side in SIDES]
        if self.base != "thorax" or not set(self.ends) <= set(knuckles):
            return None
        return tuple(knuckles.index(end) for end in self.ends)

    def table(self) -> dict[str, Any]:
        """Return what a file holds besides the name."""
        return {
            "joints": list(self.joints),
            "ends": list(self.ends),
            "base": self.base,
            "extrinsic": self.extrinsic,
        }

    def toml(self) -> str:
        """Return the text of a file that :func:`ikns.load_chain` reads back."""
        import tomli_w

        return tomli_w.dumps({"format": FORMAT, "chains": {self.name: self.table()}})


#: A chain, or the name of one that comes with the package.
ChainLike = str | Chain
