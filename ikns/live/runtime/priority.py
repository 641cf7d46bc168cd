"""Priority of the control loop over other threads and programs."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ikns.errors import InvalidInput

#: Switch interval of the interpreter, s: another thread may keep the loop waiting for
#: as long as a frame takes. Python's default of 5 ms is ten times as long (measured
#: with a busy thread in benchmarks/live_loop.py).
_SWITCH_INTERVAL = 5e-4
#: Lowest of the real-time priorities: above ordinary programs, below other real-time
#: ones.
_PRIORITY = 1


@contextmanager
def realtime_priority(
    *, realtime: bool = False, exclusive: bool = True
) -> Iterator[None]:
    """Keep this thread from waiting long for others.

    Turns Python's garbage collector of cycles off, as it may take milliseconds and the
    loop makes no cycles, and makes other threads release the interpreter sooner. With
    real-time scheduling (SCHED_RR, see sched(7)) other programs wait too, and threads
    started here, such as a finger's, inherit it. Linux reserves a twentieth of the time
    for others.

    Parameters
    ----------
    realtime : bool
        Whether to use real-time scheduling.
    exclusive : bool
        Whether the program does nothing else. Another's cycles still have to be
        collected, or its memory grows.

    Raises
    ------
    InvalidInput
        When the system does not allow real-time scheduling.
    """
    was_on, interval = gc.isenabled(), sys.getswitchinterval()
    with _realtime_scheduling(wanted=realtime):
        if exclusive:
            gc.collect()
            gc.disable()
        sys.setswitchinterval(min(interval, _SWITCH_INTERVAL))
        try:
            yield
        finally:
            sys.setswitchinterval(interval)
            if exclusive and was_on:
                gc.enable()


def check_realtime() -> None:
    """Check that the system allows real-time scheduling.

    Raises
    ------
    InvalidInput
        When it does not.
    """
    with _realtime_scheduling(wanted=True):
        pass


@contextmanager
def _realtime_scheduling(*, wanted: bool) -> Iterator[None]:
    if not wanted:
        yield
        return
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except (
        PermissionError,
        AttributeError,
    ) as error:  # the latter outside Linux
        raise InvalidInput(
            "expected permission to run at real-time priority, found "
            "none: leave out real time, or allow it (Linux: rtprio 1 for the user in "
            "/etc/security/limits.conf, then log in again)."
        ) from error
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)
