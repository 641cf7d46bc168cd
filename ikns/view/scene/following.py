"""The live 3-D view of a person; the control loop never waits for it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ikns.body.chains import chain_sides
from ikns.calibration.subject import Subject
from ikns.view.scene.finger import with_finger
from ikns.view.scene.live import LiveView
from ikns.view.scene.map_scene import map_scene

if TYPE_CHECKING:
    from ikns.live.runtime import LoopStatus


@contextmanager
def body_view(
    subject: Subject, *, simulated: bool, name: str
) -> Iterator[tuple[LiveView, Callable[[LoopStatus], None]]]:
    """Serve the 3-D view of a subject with a finger, on this machine only.

    A thread of its own draws the newest status and skips the others.

    Parameters
    ----------
    subject : Subject
    simulated : bool
        Whether markers or map come from a virtual subject; the page says so.
    name : str
        Of the subject, for the title.

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
    scene = with_finger(scene, subject.skeleton, chain_sides(subject.chain)[-1])
    newest: list[LoopStatus] = []
    came, closing = threading.Event(), threading.Event()

    def draw(view: LiveView) -> None:
        while not closing.is_set():
            if came.wait(0.1) and newest:
                came.clear()
                status = newest[-1]
                del newest[:-1]
                moved = status.measured
                view.show(
                    status.q,
                    time=status.time,
                    c=status.c,
                    flexion=status.flexion if math.isnan(moved) else moved,
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
