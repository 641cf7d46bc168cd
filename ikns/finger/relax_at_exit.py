"""Switch the torque of every finger off when the program ends, however it ends.

An exception and Ctrl-C leave through ``with`` or ``atexit``. SIGTERM and SIGHUP (the
terminal was closed) would end Python at once, so they become an ordinary exit, unless
the program handles them itself. Nothing runs after SIGKILL or a power cut: then only
the servo's own watchdog stops it.
"""

from __future__ import annotations

import atexit
import signal
import sys
import threading
from types import FrameType
from typing import Protocol

__all__ = ["forget", "relax_at_exit"]


class _Relaxes(Protocol):
    def relax(self) -> None: ...


_connected: list[_Relaxes] = []
_lock = threading.Lock()


def relax_at_exit(finger: _Relaxes) -> None:
    """Relax a finger when the program ends, however it ends."""
    with _lock:
        if not any(other is finger for other in _connected):
            _connected.append(finger)
    atexit.unregister(_relax_all)  # registered last, it runs first
    atexit.register(_relax_all)
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _exit)


def forget(finger: _Relaxes) -> None:
    """Undo :func:`relax_at_exit`, for a finger that is relaxed already."""
    with _lock:
        _connected[:] = [other for other in _connected if other is not finger]


def _exit(number: int, frame: FrameType | None) -> None:
    # Relax during the exit, not here: the signal may have come while a lock was held
    # that relaxing needs.
    sys.exit(128 + number)


def _relax_all() -> None:
    if threading.current_thread() is threading.main_thread():
        signal.signal(
            signal.SIGINT, signal.SIG_IGN
        )  # a second Ctrl-C must not stop this
    for finger in tuple(_connected):
        try:
            finger.relax()
        except (
            Exception
        ) as error:  # a failure must not leave other fingers under torque
            sys.stderr.write(f"ikns: {error}\n")
