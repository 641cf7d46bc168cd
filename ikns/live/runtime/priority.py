"""Who waits for whom while a finger is driven: other threads, and other programs."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ikns.errors import InvalidInput

__all__ = ["check_realtime", "realtime_priority"]

#: For which other threads may keep the interpreter while the loop waits for it, s:
#: what a frame takes; Python's own 5 ms are ten times as long (a busy thread beside
#: the loop: benchmarks/live_loop.py).
_TURN = 5e-4
#: Lowest of the real-time priorities: before every ordinary program, after whatever
#: else somebody made real-time on purpose.
_PRIORITY = 1


@contextmanager
def realtime_priority(*, realtime: bool = False) -> Iterator[None]:
    """Let nobody keep this thread waiting for long.

    Python's collector of cycles may take milliseconds; the loop makes no cycles, so
    nothing piles up meanwhile. Other threads give the interpreter back soon. In real
    time (SCHED_RR, see sched(7)) other programs wait too; what the thread starts, such
    as a finger's, inherits that. Linux itself keeps a twentieth of the time for others.

    Parameters
    ----------
    realtime : bool

    Raises
    ------
    InvalidInput
        When the system does not allow it.
    """
    was_on, interval = gc.isenabled(), sys.getswitchinterval()
    with _scheduled_first(wanted=realtime):
        gc.collect()
        gc.freeze()
        gc.disable()
        sys.setswitchinterval(min(interval, _TURN))
        try:
            yield
        finally:
            sys.setswitchinterval(interval)
            gc.unfreeze()
            if was_on:
                gc.enable()


def check_realtime() -> None:
    """Ask whether the system allows real time.

    Raises
    ------
    InvalidInput
        When it does not.
    """
    with _scheduled_first(wanted=True):
        pass


@contextmanager
def _scheduled_first(*, wanted: bool) -> Iterator[None]:
    if not wanted:
        yield
        return
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except (PermissionError, AttributeError) as error:  # the latter beyond Linux
        raise InvalidInput(
            "expected a system that lets this program run in real time, found one that "
            "does not: leave that out, or allow it (Linux: rtprio 1 for the user in "
            "/etc/security/limits.conf, then log in again)."
        ) from error
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)
