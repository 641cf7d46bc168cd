"""Compile everything, or load it from disk, before it is needed."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ikns._kernels.compiled import on_disk
from ikns.control import FrameSolver
from ikns.interpolation import NaturalNeighborInterpolator
from ikns.marker_ik import MarkerIK
from ikns.nullspace_map import NullSpaceMap
from ikns.skeleton import Skeleton
from ikns.subspace import principal_angles

__all__ = ["compiled_before", "warm_up"]


def compiled_before() -> bool:
    """Whether the kernels only have to be loaded."""
    return on_disk("control_frame")


def warm_up(progress: Callable[[str, int, int], None] | None = None) -> float:
    """Run every kernel once, so that none is compiled while a robot waits.

    The first time on a machine, and after an update, this compiles; later it loads.

    Parameters
    ----------
    progress : callable, optional
        Called with ("compiling", kernels done, kernels in all).

    Returns
    -------
    float
        How long it took, s.
    """
    start = time.perf_counter()
    body = Skeleton.load()
    q = body.neutral()
    markers = body.markers_in_world(q)
    corners = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64)
    some = np.ones(8)
    null_space_map = NullSpaceMap.from_arrays(
        corners, np.outer(some, np.eye(7)[0]), 0 * some, some
    )
    steps: tuple[Callable[[], object], ...] = (
        lambda: MarkerIK(body).solve(markers),
        lambda: body.hands_in_thorax(q),
        lambda: body.chain_jacobian(q, "right_arm"),
        lambda: body.null_spaces(q, "right_arm"),
        lambda: NaturalNeighborInterpolator(corners, some)(corners[0]),
        lambda: null_space_map.control_signal(np.zeros(7), corners),
        lambda: principal_angles(np.eye(3)[:1], np.eye(3)[1:]),
        lambda: FrameSolver(body, null_space_map, "right_arm").solve(markers),
    )
    for done, step in enumerate(steps):
        if progress is not None:
            progress("compiling", done, len(steps))
        step()
    if progress is not None:
        progress("compiling", len(steps), len(steps))
    return time.perf_counter() - start
