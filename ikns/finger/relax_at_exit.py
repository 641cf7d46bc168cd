"""No finger is left under torque when the program ends, however it ends.

An exception and Ctrl-C pass through ``with``, or end in ``atexit``. SIGTERM and SIGHUP
(the terminal was closed) would end Python at once, so they are turned into an ordinary
exit, unless the program has its own plans for them. Nothing runs after SIGKILL or a
power cut: then the servo's own watchdog has to stop it.
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
    """Relax a finger when the program ends, whatever ends it."""
    with _lock:
        if not any(other is finger for other in _connected):
            _connected.append(finger)
    atexit.unregister(_relax_all)  # so that it runs before what was registered earlier
    atexit.register(_relax_all)
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _leave)


def forget(finger: _Relaxes) -> None:
    """Leave a finger alone that is relaxed already."""
    with _lock:
        _connected[:] = [other for other in _connected if other is not finger]


def _leave(number: int, frame: FrameType | None) -> None:
    # Relaxing happens on the way out, not here: the signal may have come while a lock
    # was held that relaxing needs.
    sys.exit(128 + number)


def _relax_all() -> None:
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # impatience must not stop this
    for finger in tuple(_connected):
        try:
            finger.relax()
        except Exception as error:  # one that fails must not keep others under torque
            sys.stderr.write(f"ikns: {error}\n")
