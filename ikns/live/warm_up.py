"""Compile everything, or load it from disk, before it is needed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from ikns._kernels.compiled import on_disk
from ikns.body.skeleton import Skeleton
from ikns.live.control import FrameSolver
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import principal_angles

__all__ = ["compiled_before", "warm_up"]

_CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64)


def compiled_before() -> bool:
    """Whether the kernels only have to be loaded."""
    return on_disk("body.control_frame")


def warm_up(progress: Callable[[str, int, int], None] | None = None) -> float:
    """Run every kernel once, so that none is compiled while a robot waits.

    The first time on a machine, and after an update, this compiles, half of it in a
    process of its own; later it loads.

    Parameters
    ----------
    progress : callable, optional
        Called with ("compiling", steps done, steps in all).

    Returns
    -------
    float
        How long it took, s.
    """
    start = time.perf_counter()
    steps = (*_OF_BODIES, *_OF_PLACES, _frame)
    beside = None
    if not compiled_before():
        script = "from ikns.live.warm_up import run_places; run_places()"
        beside = subprocess.Popen([sys.executable, "-c", script])
    for done, step in enumerate(steps):
        if progress is not None:
            progress("compiling", done, len(steps))
        if beside is not None and step is _OF_PLACES[0]:
            beside.wait()  # what it compiled is loaded now; what it could not, compiled
        step()
    if progress is not None:
        progress("compiling", len(steps), len(steps))
    return time.perf_counter() - start


def run_places() -> None:
    """Run the kernels that have to do with places between points."""
    for step in _OF_PLACES:
        step()


def _markers() -> None:
    body = Skeleton.load()
    MarkerIK(body).solve(body.markers_in_world(body.neutral()))


def _hands() -> None:
    body = Skeleton.load()
    body.hands_in_thorax(body.neutral())
    body.chain_jacobian(body.neutral(), "right_arm")


def _null_spaces() -> None:
    body = Skeleton.load()
    body.null_spaces(body.neutral(), "right_arm")
    principal_angles(np.eye(3)[:1], np.eye(3)[1:])


def _neighbors() -> None:
    one, many = _CORNERS[0], _CORNERS
    interpolator = NaturalNeighborInterpolator(_CORNERS, np.ones(8))
    interpolator(one)
    interpolator(many)
    interpolator.inside(many)
    _map().control_signal(np.zeros(7), one)


def _map() -> NullSpaceMap:
    directions = np.outer(np.ones(8), np.eye(7)[0])
    return NullSpaceMap.from_arrays(_CORNERS, directions, np.zeros(8), np.ones(8))


def _frame() -> None:
    body = Skeleton.load()
    markers = body.markers_in_world(body.neutral())
    FrameSolver(body, _map(), "right_arm").solve(markers)


_OF_BODIES: Sequence[Callable[[], None]] = (_markers, _hands)
_OF_PLACES: Sequence[Callable[[], None]] = (_neighbors, _null_spaces)
