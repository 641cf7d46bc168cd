"""The live 3-D view of a person; the control loop never waits for it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ikns.body.chains import chain_joints, chain_sides
from ikns.calibration.subject import Subject
from ikns.nullspace.signal_names import signal_names
from ikns.view.scene.finger import with_fingers
from ikns.view.scene.live import LiveView
from ikns.view.scene.map_scene import map_scene

if TYPE_CHECKING:
    from ikns.live.runtime import LoopStatus


@contextmanager
def body_view(
    subject: Subject, *, simulated: bool, name: str, dofs: Sequence[int] = (1,)
) -> Iterator[tuple[LiveView, Callable[[LoopStatus], None]]]:
    """Serve the 3-D view of a subject with its fingers, on this machine only.

    A thread of its own draws the newest status and skips the others.

    Parameters
    ----------
    subject : Subject
    simulated : bool
        Whether markers or map come from a virtual subject; the page says so.
    name : str
        Of the subject, for the title.
    dofs : sequence of int
        Which freedoms of the map drive a finger, in the order of the statuses' axes.

    Yields
    ------
    view : LiveView
    take : callable
        Shows a status; returns at once.
    """
    scene = map_scene(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        simulated=simulated,
        title=f"{name}, live",
    )
    names = signal_names(subject.null_space_map.n_dof)
    scene = replace(scene, signals=tuple(names[dof - 1] for dof in dofs))
    scene = with_fingers(scene, subject.skeleton, _sides(subject, dofs))
    newest: list[LoopStatus] = []
    came, closing = threading.Event(), threading.Event()

    def draw(view: LiveView) -> None:
        while not closing.is_set():
            if came.wait(0.1) and newest:
                came.clear()
                status = newest[-1]
                del newest[:-1]
                view.show(
                    status.q,
                    time=status.time,
                    c=[axis.c for axis in status.axes],
                    flexion=[
                        axis.flexion if math.isnan(axis.measured) else axis.measured
                        for axis in status.axes
                    ],
                )

    def take(status: LoopStatus) -> None:
        newest.append(status)
        came.set()

    with LiveView(scene, subject.skeleton) as view:
        thread = threading.Thread(target=draw, args=(view,), name="view", daemon=True)
        thread.start()
        try:
            yield view, take
        finally:
            closing.set()
            thread.join()


def _sides(subject: Subject, dofs: Sequence[int]) -> dict[int, str]:
    """Return the arm that wears each finger: the one that its freedom moves more."""
    sides = chain_sides(subject.chain)
    if len(dofs) == 1:
        return {dofs[0]: sides[-1]}
    learned, joints = subject.null_space_map, chain_joints(subject.chain)
    moved = np.nansum(learned.directions_**2, axis=0)  # (d, n)
    return {
        dof: max(
            sides,
            key=lambda side: sum(
                share
                for share, joint in zip(moved[dof - 1], joints, strict=True)
                if joint.startswith(side)
            ),
        )
        for dof in dofs
    }
