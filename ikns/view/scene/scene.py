"""A scene as data, and its camera."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, as_chain, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.view.scene.commands import Command

#: Vertical angle of view, deg: small, so that near objects are not enlarged much.
FIELD_OF_VIEW = 28.0
#: Direction of the camera: front, above, and the side of the arm; thorax frame.
_FROM = np.array([0.80, 0.30, 0.52])
#: Top of the head and foot of the trunk, for the size of the picture, m.
_TRUNK = ((-0.03, 0.32, 0.0), (-0.06, -0.23, 0.0))


@dataclass(frozen=True)
class Layer:
    """A group of nodes that a viewer can switch on and off."""

    name: str  # for people
    paths: tuple[str, ...]
    color: str  # for the legend, as CSS has it
    shown: bool = True  # at first


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn, with title, legend, camera and animation.

    Commands are MeshCat's, in order (see :mod:`ikns.view.scene.commands`).
    """

    title: str
    caption: str
    simulated: bool  # whether any of it comes from a virtual subject
    commands: list[Command]
    layers: list[Layer]
    camera: Array  # (3,) m in the thorax frame
    target: Array  # (3,) m, what it looks at
    times: Array = field(default_factory=lambda: np.zeros(0))  # (F,) s; may be empty
    #: (F,) or, of several signals, (F, d); not clipped, or NaN.
    c: Array = field(default_factory=lambda: np.zeros(0))
    speed: Array = field(default_factory=lambda: np.zeros(0))  # (F,) hand, m/s; or none
    start: float = 0.0  # time that is shown at first, s
    signals: tuple[str, ...] = ("c",)  # names of the control signals
    fingers: tuple[str, ...] = ()  # nodes of the fingers, in their order

    @property
    def columns(self) -> Array:
        """Control signals one by one, (d, F)."""
        return np.reshape(self.c, (len(self.times), len(self.signals))).T


def camera_and_target(
    skeleton: Skeleton, learned: NullSpaceMap, chain: ChainLike, q: Array
) -> tuple[Array, Array]:
    """Return a camera with trunk, acting arms and PCA points in view, and its target.

    Both are (3,) m in the thorax frame. Unknown postures (NaN) of `q` (..., 18 or 25)
    are ignored.
    """
    if (base := as_chain(chain).base) != "thorax":
        raise InvalidInput(
            f"the map of the chain '{chain}' is seen from {base}; expected one seen "
            "from the thorax, to be drawn on the body."
        )
    sides = chain_sides(chain)
    shown = [learned.centers_, np.array(_TRUNK)]
    for side in SIDES:
        links = ("upper_arm", "forearm", "hand", "knuckle") if side in sides else ()
        for link in ("upper_arm", *links):
            place = skeleton.link_in_thorax(q, f"{side}_{link}")[0].reshape(-1, 3)
            shown.append(place[np.all(np.isfinite(place), axis=1)])
    places = np.concatenate(shown)
    target = (places.min(axis=0) + places.max(axis=0)) / 2
    radius = float(np.linalg.norm(places - target, axis=1).max())
    way = _FROM * [1.0, 1.0, 1.0 if "right" in sides else -1.0]
    if len(sides) > 1:
        way = way * [1.0, 1.0, 0.3]
    way = way / np.linalg.norm(way)
    return target + 1.05 * radius / np.sin(np.radians(FIELD_OF_VIEW / 2)) * way, target
