"""Keys that are pressed at the terminal, without waiting for Enter."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress


@contextmanager
def pressed_keys() -> Iterator[Callable[[float], str]]:
    """Yield a function that returns the keys pressed since its last call.

    It waits up to the seconds that it is given for the first one. Without a terminal,
    or while another program has it, none come.
    """
    if not keyboard():
        yield _no_keys
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)

    def keys(wait: float) -> str:
        # In the background, reading would stop this process.
        if not keyboard() or not select.select([number], [], [], wait)[0]:
            return ""
        with suppress(OSError):  # the terminal is gone
            return os.read(number, 256).decode(errors="replace")
        return ""

    try:
        tty.setcbreak(number)
        yield keys
    finally:
        with suppress(termios.error):
            termios.tcsetattr(number, termios.TCSADRAIN, before)


def _no_keys(wait: float) -> str:
    time.sleep(wait)
    return ""


def keyboard() -> bool:
    """Whether there is a terminal whose keys are for this program."""
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except (OSError, ValueError):  # no terminal, or a test's substitute for one
        return False
