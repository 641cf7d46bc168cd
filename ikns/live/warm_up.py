"""Compile all kernels, or load them from disk, before they are needed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from ikns._kernels.cache_folder import can_keep, on_disk
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.label_changes import label_changes
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import principal_angles

_CORNERS = np.array(list(np.ndindex(2, 2, 2)), dtype=np.float64)


def compiled_before() -> bool:
    """Whether the kernels are compiled already and only have to be loaded.

    Also where no folder keeps machine code: each process then compiles what it needs.
    """
    return on_disk("body.control_frame") or not can_keep("body.control_frame")


def warm_up(progress: Callable[[str, int, int], None] | None = None) -> float:
    """Run every kernel once, so that none is compiled while a robot is waiting.

    The first call on a machine, and after an update, compiles for half a minute, a part
    of it in a second process; later calls load the compiled kernels.

    Parameters
    ----------
    progress : callable, optional
        Called with ("compiling", steps done, steps in total).

    Returns
    -------
    float
        Time that it took, s.

    Examples
    --------
    >>> seconds = warm_up()
    >>> seconds > 0
    True
    """
    start = time.perf_counter()
    steps = (*_BODY_STEPS, *_MAP_STEPS)
    process = None
    if not compiled_before():
        script = "from ikns.live.warm_up import run_map_kernels; run_map_kernels()"
        process = subprocess.Popen([sys.executable, "-c", script])
    for done, step in enumerate(steps):
        if progress is not None:
            progress("compiling", done, len(steps))
        if process is not None and step is _MAP_STEPS[0]:
            process.wait()  # from here on its results are loaded from disk
        step()
    if progress is not None:
        progress("compiling", len(steps), len(steps))
    return time.perf_counter() - start


def run_map_kernels() -> None:
    """Run the kernels of interpolation and null spaces.

    And those of labels that change places, which recordings need and a live loop does
    not: the process has time left.
    """
    for step in (*_MAP_STEPS, _labels):
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


def _labels() -> None:
    label_changes(np.arange(3.0), np.zeros((3, 2, 3)))


def _map() -> NullSpaceMap:
    directions = np.outer(np.ones(8), np.eye(7)[0])
    return NullSpaceMap.from_arrays(_CORNERS, directions, np.zeros(8), np.ones(8))


def _frame() -> None:
    # Commands that only ask whether all is compiled do not load live control.
    from ikns.live.control import FrameSolver
    from ikns.nullspace.natural_posture import NaturalPosture
    from ikns.nullspace.readout import IntentMap, Readout

    body = Skeleton.load()
    markers = body.markers_in_world(body.neutral())
    people = NaturalPosture.of_people()
    intent = IntentMap.from_arrays(people, _CORNERS, np.zeros(8), np.ones(8))
    readout = Readout("intent", "right_arm", intent)
    FrameSolver(body, _map(), "right_arm", readout=readout).solve(markers)


#: When they come to the last, the second process has the weights that it needs.
_BODY_STEPS: Sequence[Callable[[], None]] = (_markers, _hands, _frame)
_MAP_STEPS: Sequence[Callable[[], None]] = (_neighbors, _null_spaces)
