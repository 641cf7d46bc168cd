"""The paper's map in a live frame: its constants for the compiled calls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ikns._kernels.body.frame_constants import ControlMap
from ikns._kernels.body.paths import Paths
from ikns.body.chains import SIDES, ChainLike, as_chain, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.interpolator import NearestPoint


def end_paths(skeleton: Skeleton, chain: ChainLike) -> tuple[Paths, Sequence[int]]:
    """Paths to a chain's ends or to both hands, and which of them are its ends."""
    own = as_chain(chain)
    if own.hands is not None:
        return skeleton.hand_paths, own.hands
    return skeleton.paths(own.ends, (), own.base), range(len(own.ends))


def numbers_of_map(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: ChainLike,
    needs: Iterable[tuple[list[int], int]],
) -> ControlMap:
    """Return what the kernels take of a map; one between other points is refused.

    `needs` are the values of :func:`ikns.motion.marker_ik.visibility.sight_needs`.
    """
    labels = list(skeleton.marker_set.labels)
    link = np.full(len(labels), -1, dtype=np.int64)
    need: list[int] = []
    for columns, least in needs:
        link[columns] = len(need)
        need.append(least)
    interpolator = learned.interpolator_
    numbers, indices = np.empty(0), np.empty(0, dtype=np.int64)
    if isinstance(interpolator, NaturalNeighborInterpolator):
        numbers, indices = interpolator.packed
    elif not isinstance(interpolator, NearestPoint):
        raise InvalidInput(
            "expected a map between natural neighbors or nearest points, found "
            f"{type(interpolator).__name__}, which the live kernel does not support."
        )
    sides = [SIDES.index(side) for side in chain_sides(chain)]
    return ControlMap(
        points=np.array(learned.centers_, order="C"),
        numbers=numbers,
        indices=indices,
        directions=np.array(learned.directions_, order="C"),
        lower=np.array(learned.lower_, order="C"),
        upper=np.array(learned.upper_, order="C"),
        columns=skeleton.columns(chain_joints(chain)) - 6,
        sides=np.array(sides, dtype=np.int64),
        ends=np.array(end_paths(skeleton, chain)[1], dtype=np.int64),
        link=link,
        need=np.array(need, dtype=np.int64),
    )
