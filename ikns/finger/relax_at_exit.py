"""Keep track of the connected fingers, so that no end of a program forgets one.

An exception and Ctrl-C leave through ``with`` or ``atexit``, and so do the signals that
:func:`ikns.endings.exit_on_signals` turns into an exit. An exception that ends a thread
makes every finger safe, as that thread may be the one that commanded it.

Python allows signal handlers in the main thread only. A program that connects a finger
in another one has to call :func:`ikns.endings.exit_on_signals` in its main thread
before; the command line handles signals from its first line on.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable
from typing import Protocol

from ikns.endings import exit_on_signals
from ikns.finger.errors import FingerError


class _Connected(Protocol):
    def make_safe(self, reason: str) -> None: ...

    def relax(self) -> None: ...


_connected: list[_Connected] = []
_told: dict[int, str] = {}  # of a finger since it was connected last, by its id
_lock = threading.Lock()
_hook_before: Callable[[threading.ExceptHookArgs], object] = threading.excepthook


def relax_at_exit(finger: _Connected) -> None:
    """Relax a finger when the program ends, however it ends."""
    global _hook_before
    with _lock:
        _told.pop(id(finger), None)
        if not any(other is finger for other in _connected):
            _connected.append(finger)
        if threading.excepthook is not _make_all_safe:
            _hook_before = threading.excepthook
            threading.excepthook = _make_all_safe
    atexit.unregister(_relax_all)  # registered last, it runs first
    atexit.register(_relax_all)
    exit_on_signals()


def forget(finger: _Connected) -> None:
    """Undo :func:`relax_at_exit`, for a finger that is relaxed already."""
    with _lock:
        _told.pop(id(finger), None)
        _connected[:] = [other for other in _connected if other is not finger]
        if not _connected and threading.excepthook is _make_all_safe:
            threading.excepthook = _hook_before


def not_relaxed(finger: _Connected, sentence: str) -> FingerError:
    """Return the error for a finger that is not relaxed, which is told now.

    It is tried again when the program ends, and told again only in other words, or
    when it was connected again in between.
    """
    _told[id(finger)] = sentence
    return FingerError(sentence)


def _make_all_safe(about: threading.ExceptHookArgs) -> None:
    """Make every finger safe after an exception has ended a thread."""
    name = "a thread" if about.thread is None else f"the thread '{about.thread.name}'"
    for finger in tuple(_connected):
        finger.make_safe(f"an exception ended {name}")
    _hook_before(about)


def _relax_all() -> None:
    if threading.current_thread() is threading.main_thread():
        # What ends the program must not stop this too; each finger has its deadline.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, signal.SIG_IGN)
    for finger in tuple(_connected):
        before = _told.get(id(finger))
        try:
            finger.relax()
        # A failure must not leave other fingers under torque.
        except Exception as error:
            if str(error) == before:
                continue
            with contextlib.suppress(OSError):  # the terminal may be gone
                sys.stderr.write(f"ikns: {error}\n")


# A forked child must not write to the port of its parent.
os.register_at_fork(after_in_child=_connected.clear)
