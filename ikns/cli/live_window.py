"""The body in a browser while a command runs, which never waits for it."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import ikns
from ikns.cli.simulated import is_simulated

if TYPE_CHECKING:
    from ikns.runtime import Status

__all__ = ["live_window"]


@contextmanager
def live_window(
    subject: ikns.Subject, folder: Path
) -> Iterator[Callable[[Status], None]]:
    """Open the 3-D view of a subject; yields what takes the newest status.

    Postures are drawn by a thread of their own, the newest only.
    """
    from ikns.motion import chain_sides
    from ikns.view.scene import LiveView, map_scene, with_finger

    scene = map_scene(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        simulated=is_simulated(subject, folder),
        title="Live",
    )
    scene = with_finger(scene, subject.skeleton, chain_sides(subject.chain)[-1])
    newest: list[Status] = []
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

    def take(status: Status) -> None:
        newest.append(status)
        came.set()

    with LiveView(scene, subject.skeleton) as view:
        sys.stderr.write(f"ikns: the view is at {view.url} on this machine.\n")
        view.open()
        thread = threading.Thread(target=draw, args=(view,), name="view", daemon=True)
        thread.start()
        try:
            yield take
        finally:
            closing.set()
            thread.join()
