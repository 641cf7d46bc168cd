"""The body in 3-D beside the panel: postures go to a live view of their own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ikns.subject import Subject

if TYPE_CHECKING:
    from ikns.runtime import Status

__all__ = ["body_view"]


@contextmanager
def body_view(
    subject: Subject, *, simulated: bool
) -> Iterator[tuple[str, Callable[[Status], None]]]:
    """Serve the 3-D view of a subject.

    Postures are drawn by a thread of their own, the newest only.

    Parameters
    ----------
    subject : Subject
    simulated : bool
        Whether the subject is.

    Yields
    ------
    address : str
        On this machine only.
    take : callable
        Shows the posture of a status; it does not wait.
    """
    from ikns.view.scene import LiveView, map_scene

    scene = map_scene(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        simulated=simulated,
        title="Live",
    )
    newest: list[Status] = []
    came, closing = threading.Event(), threading.Event()

    def draw(view: LiveView) -> None:
        while not closing.is_set():
            if came.wait(0.1) and newest:
                came.clear()
                status = newest[-1]
                del newest[:-1]
                view.show(status.q, time=status.time, c=status.c)

    def take(status: Status) -> None:
        newest.append(status)
        came.set()

    with LiveView(scene, subject.skeleton) as view:
        thread = threading.Thread(target=draw, args=(view,), name="body", daemon=True)
        thread.start()
        try:
            yield view.url, take
        finally:
            closing.set()
            thread.join()
