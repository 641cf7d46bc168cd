"""Say in large words that the finger is stopped, and let someone arm it again."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ikns.cli.keyboard import keyboard, pressed_keys

if TYPE_CHECKING:
    from ikns.live.runtime import LoopStatus

#: Exit code of a run that ends while its finger is stopped.
STOPPED = 3
#: With Shift: not typed by accident. Keys that come before the stop do not count.
_KEY = "R"


def arm_hint() -> str:
    """Return which key arms a stopped finger again; empty without a keyboard."""
    return ", press Shift+R to arm again" if keyboard() else ""


@contextmanager
def watch_stops(
    arm: Callable[[], None], *, how: str = "", announce: bool = True
) -> Iterator[Callable[[LoopStatus], None]]:
    """Yield a function that takes every status of a loop; it prints each stop once.

    Parameters
    ----------
    arm : callable
        Called when the key is pressed while the finger is stopped.
    how : str
        Where else the finger can be armed again, for the sentence.
    announce : bool
        Print each stop; False where the loop's own notices do.
    """
    said = ""
    with pressed_keys() as keys:

        def watch(status: LoopStatus) -> None:
            nonlocal said
            pressed = keys(0.0)
            if status.stopped and not said and announce:
                words = f"FINGER STOPPED: {status.stopped}{arm_hint()}{how}"
                sys.stderr.write(f"\nikns: {words}.\n")
                sys.stderr.flush()
            elif status.stopped and said and _KEY in pressed:
                arm()
            said = status.stopped

        yield watch
