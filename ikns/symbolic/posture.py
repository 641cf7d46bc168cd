"""A checked start posture, and the constraints that it defines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ikns._kernels.body.tree import PRISMATIC
from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.symbolic.chain import ChainModel, Held

#: A limit or volume is active when less than this is left, rad and m: a thousand times
#: the optimizer's tolerance.
BINDS = 1e-6
#: A start may miss a limit or a volume by rounding, rad and m.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Start:
    """A posture x of the chain in a body, and the hand pose that it defines.

    `positions` (3, h) m and `rotations` (3, 3 h) are those of the hands, `null` (d, n)
    the joint motions that leave them there, orthonormal rows.
    """

    x: Array
    angles: Array
    positions: Array
    rotations: Array
    null: Array

    @property
    def freedom(self) -> int:
        """Degrees of freedom left."""
        return len(self.null)

    @property
    def hold(self) -> Array:
        """Parameters of the optimizers: matrices column by column."""
        matrices = (self.positions, self.rotations)
        return np.concatenate([self.angles, *(m.ravel(order="F") for m in matrices)])


def start_of(chain: ChainModel, held: Held, q: ArrayLike) -> Start:
    """Check a posture and compute the hand pose to hold.

    `q` has the angles of the body, or its configuration; the chain's own for a robot.
    """
    given = np.asarray(q, dtype=np.float64)
    if given.ndim != 1 or not np.isfinite(given).all():
        raise InvalidInput(
            f"expected one finite posture, found an array {given.shape} with "
            f"{np.count_nonzero(~np.isfinite(given))} values that are not finite."
        )
    angles = chain.whole(given)
    x = angles[chain.columns]
    beyond = np.maximum(chain.lower - x, x - chain.upper)
    worst = int(np.argmax(beyond))
    if beyond[worst] > _ROUNDING:
        slides = chain.tree.kind[chain.columns[worst] + 1] == PRISMATIC
        unit, scale = ("m", 1.0) if slides else ("deg", np.degrees(1.0))
        at, low, high = (scale * float(v[worst]) for v in (x, chain.lower, chain.upper))
        raise InvalidInput(
            f"expected a posture within the joint limits, found {chain.names[worst]} "
            f"at {at:.4g} {unit}, its range being {low:.4g} to {high:.4g} {unit}."
        )
    x = np.clip(x, chain.lower, chain.upper)
    room = held.clearance(x, angles).full().ravel()
    if len(room) and room.min() < -_ROUNDING:
        worst = int(np.argmin(room))
        raise InvalidInput(
            "expected a posture whose volumes are apart, found that "
            f"{held.names[worst]}, {-1000 * room[worst]:.1f} mm deep."
        )
    positions, rotations = (matrix.full() for matrix in held.place(x, angles))
    _, values, rows = np.linalg.svd(held.jacobian(x, angles).full())
    rank = int(np.sum(values > 1e-9 * values[0]))
    if rank == len(x):
        raise InvalidInput(
            f"the held hand leaves none of {len(x)} joints free to move."
        )
    return Start(x, angles, positions, rotations, rows[rank:])


def binding(chain: ChainModel, held: Held, x: Array, angles: Array) -> tuple[str, ...]:
    """Name the limits and volumes that are active at a posture x (n,)."""
    limits = [
        f"{name} at its {end} limit"
        for end, room in (("lower", x - chain.lower), ("upper", chain.upper - x))
        for name, left in zip(chain.names, room, strict=True)
        if left < BINDS
    ]
    room = held.clearance(x, angles).full().ravel()
    touching = [held.names[i] for i in np.flatnonzero(room < BINDS)]
    # The rods of one box share a name.
    return tuple(dict.fromkeys([*limits, *touching]))
