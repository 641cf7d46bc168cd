"""How a program ends that may drive a finger: one place for every signal.

A signal is noted at once, by a thread of its own, even while the main thread is busy in
a library: from then on :func:`ending_requested` holds, and the thread of every finger
switches its torque off (:mod:`ikns.finger.dynamixel`). The main thread then ends in
order, or is interrupted where nothing needs an order. Nothing runs after SIGKILL, a
crash of the interpreter or a power cut: then only the servo's own watchdog stops it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: Ctrl-C, `kill`, a closed terminal or connection, and Ctrl-\.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
#: Further signals are ignored for this long, s: impatience must not keep files from
#: being written. After that a signal interrupts whatever takes so long.
_PATIENCE = 5.0
#: Exit code of a program whose output no one reads any more.
BROKEN_PIPE = 128 + signal.SIGPIPE


class _State:
    """What was asked of this process; changed by its main thread and the watcher."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.handling = False
        self.number = 0  # of the first signal
        self.answered_at: float | None = None
        self.stop: threading.Event | None = None


_state = _State()


def ending_requested() -> bool:
    """Whether a signal asked this program to end."""
    return _state.number != 0


def signal_exit_code() -> int:
    """Exit code of a program that a signal ended, 128 + its number; 0 without one."""
    return 128 + _state.number if _state.number else 0


@contextmanager
def handle_endings(*, last: bool = False) -> Iterator[None]:
    """Handle every signal that asks a program to end, until the context is left.

    Outside of the main thread, where Python allows no handlers, nothing is changed.

    Parameters
    ----------
    last : bool
        Whether the process has nothing else to do: once it was asked to end, further
        signals are then ignored even after the context.
    """
    if threading.current_thread() is not threading.main_thread() or _state.handling:
        yield
        return
    _state.reset()
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    watcher = threading.Thread(
        target=_watch, args=(reading,), name="signals", daemon=True
    )
    watcher.start()
    before_fd = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    _state.handling = True
    for number, handler in before.items():
        # Who starts a program with nohup wants it to outlive the terminal.
        if number != signal.SIGHUP or handler != signal.SIG_IGN:
            signal.signal(number, _handle)
    try:
        yield
    finally:
        ignore = last and ending_requested()
        for number, handler in before.items():
            usual = signal.SIG_DFL if handler is None else handler
            signal.signal(number, signal.SIG_IGN if ignore else usual)
        signal.set_wakeup_fd(before_fd)
        _state.handling = False
        os.close(writing)
        watcher.join()
        os.close(reading)
        if not ignore:
            _state.reset()


@contextmanager
def stop_on_signals() -> Iterator[threading.Event]:
    """Let a signal set an event instead of interrupting the main thread.

    Use it within :func:`handle_endings`, around a loop that looks at the event and ends
    in order.
    """
    stop = threading.Event()
    if ending_requested():
        stop.set()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before, _state.stop = _state.stop, stop
    try:
        yield stop
    finally:
        _state.stop = before


def exit_on_signals() -> None:
    """Make signals that would end Python at once an ordinary exit, for a library's use.

    Handlers that the program has set stay, and so does Ctrl-C, which raises
    KeyboardInterrupt. Python allows handlers in the main thread only: elsewhere this
    does nothing, and the program has to call it in its main thread before.
    """
    if threading.current_thread() is threading.main_thread():
        for number in _SIGNALS[1:]:
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _exit)


def open_standard_streams() -> None:
    """Open what is closed of standard input, output and error, to nothing.

    Otherwise a serial port that is opened next would become the standard output.
    """
    streams = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))
    for number, (name, mode) in enumerate(streams):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, os.O_RDONLY if mode == "r" else os.O_WRONLY)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, closefd=False))


def flush_output() -> bool:
    """Write out what was printed; return whether someone still reads it.

    What no one reads is dropped, so that the interpreter does not complain at its end.
    """
    read = True
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            read = False
            with contextlib.suppress(OSError, ValueError):
                nothing = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nothing, stream.fileno())
                os.close(nothing)
    return read


def _watch(reading: int) -> None:
    """Note signals as they come; the interpreter writes a byte for each."""
    while numbers := os.read(reading, 64):
        for number in numbers:
            if number in _SIGNALS:
                _state.number = _state.number or number


def _handle(number: int, frame: FrameType | None) -> None:
    """Stop or interrupt the main thread, where this runs."""
    _state.number = _state.number or number
    now = time.monotonic()
    if _state.answered_at is not None and now - _state.answered_at < _PATIENCE:
        return
    first, _state.answered_at = _state.answered_at is None, now
    # The flag above comes first: an event must not be set while it is being set.
    if first and _state.stop is not None:
        _state.stop.set()
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        sys.exit(128 + number)


def _exit(number: int, frame: FrameType | None) -> None:
    # Relax during the exit, not here: the signal may have come while a lock was held
    # that relaxing needs.
    sys.exit(128 + number)


def _forget_in_child() -> None:
    """Leave a forked child with the usual handlers: its signals are its own."""
    if _state.handling:
        _state.reset()
        signal.set_wakeup_fd(-1)
        usual: Any = signal.default_int_handler
        for number in _SIGNALS:
            signal.signal(number, usual)
            usual = signal.SIG_DFL


os.register_at_fork(after_in_child=_forget_in_child)
