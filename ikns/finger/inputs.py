"""Other sources of the control signal: keyboard, ring button, gamepad.

Calling one returns the time and the latest control signal c, from 0 to 1, without
waiting. They are the control conditions of experiments.
"""

from __future__ import annotations

import os
import select
import struct
import sys
import termios
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Self

from ikns.errors import InvalidInput
from ikns.finger.errors import FingerError

#: struct js_event of linux/joystick.h: ms, value, type, number.
_EVENT = struct.Struct("<IhBB")
_AXIS, _INITIAL = 0x02, 0x80
_FULL = 32767


class _Ramp:
    """A signal that moves towards 1 or 0 at a constant rate."""

    def __init__(self, rate: float, clock: Callable[[], float]) -> None:
        if not 0 < rate < float("inf"):
            raise InvalidInput(f"rate must be positive and finite, not {rate:g}.")
        self._rate, self._clock = rate, clock
        self._value, self._at = 0.0, clock()

    def move(self, direction: float) -> tuple[float, float]:
        now = self._clock()
        change = direction * self._rate * (now - self._at)
        self._value = min(max(self._value + change, 0.0), 1.0)
        self._at = now
        return now, self._value


class RingButton:
    """A push button: every press switches between closing and opening.

    Parameters
    ----------
    rate : float
        Rate of the signal, 1/s.
    clock : callable
        Seconds, monotonic.

    Examples
    --------
    >>> now = 0.0
    >>> ring = RingButton(rate=2.0, clock=lambda: now)
    >>> ring.press()
    >>> now = 0.25
    >>> ring()
    (0.25, 0.5)
    >>> ring.press()  # opens again
    >>> now = 1.0
    >>> ring()
    (1.0, 0.0)
    """

    def __init__(
        self, *, rate: float = 2.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._ramp = _Ramp(rate, clock)
        self._direction = -1.0

    def press(self) -> None:
        """Reverse the direction; to be called when the button is pressed."""
        self._ramp.move(self._direction)
        self._direction = -self._direction

    def __call__(self) -> tuple[float, float]:
        """Return the time and the control signal."""
        return self._ramp.move(self._direction)


class Keyboard:
    """Keys of the terminal: up or + closes by a step, down or - opens, space toggles.

    Parameters
    ----------
    step : float
        Change of the signal per key.
    clock : callable
        Seconds, monotonic.
    number : int, optional
        File descriptor of the terminal; standard input by default.

    Raises
    ------
    InvalidInput
        When it is not a terminal.
    """

    def __init__(
        self,
        *,
        step: float = 0.05,
        clock: Callable[[], float] = time.monotonic,
        number: int | None = None,
    ) -> None:
        self._number = sys.stdin.fileno() if number is None else number
        if not os.isatty(self._number):
            raise InvalidInput("the keyboard needs a terminal to read keys from.")
        self._step, self._clock, self._value = step, clock, 0.0
        self._before = termios.tcgetattr(self._number)
        tty.setcbreak(self._number)

    def __call__(self) -> tuple[float, float]:
        """Return the time and the control signal."""
        while select.select([self._number], [], [], 0)[0]:
            if not (keys := os.read(self._number, 64)):
                break
            up = keys.count(b"+") + keys.count(b"\x1b[A")
            down = keys.count(b"-") + keys.count(b"\x1b[B")
            self._value += self._step * (up - down)
            if keys.count(b" ") % 2:
                self._value = 1.0 - round(self._value)
            self._value = min(max(self._value, 0.0), 1.0)
        return self._clock(), self._value

    def close(self) -> None:
        """Restore the terminal; harmless when repeated."""
        termios.tcsetattr(self._number, termios.TCSADRAIN, self._before)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the terminal."""
        self.close()


class Gamepad:
    """One axis of a joystick of Linux (``/dev/input/js0``).

    Parameters
    ----------
    path : path
    axis : int
        Number of the axis; its center is 0 and its positive end 1.
    whole : bool
        Whether its negative end is 0 instead, as for a trigger, which rests there.
    reverse : bool
        Whether to reverse the axis (up is negative on most sticks).
    clock : callable
        Seconds, monotonic.

    Raises
    ------
    FingerError
        When it is missing or cannot be read.
    """

    def __init__(
        self,
        path: str | Path = "/dev/input/js0",
        *,
        axis: int = 1,
        whole: bool = False,
        reverse: bool = True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._axis, self._whole, self._reverse = axis, whole, reverse
        self._clock, self._value = clock, 0.0
        self._lost = False
        try:
            self._number = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise FingerError(
                f"{path}: no gamepad there ({(error.strerror or '').lower()})."
            ) from None
        self._ends = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True, name="gamepad")
        self._thread.start()

    def __call__(self) -> tuple[float, float]:
        """Return the time and the control signal; NaN once the gamepad is gone."""
        return self._clock(), float("nan") if self._lost else self._value

    def close(self) -> None:
        """Disconnect; harmless when repeated."""
        if self._thread.is_alive() or self._number >= 0:
            os.close(self._ends[1])
            self._thread.join()
            os.close(self._ends[0])
            os.close(self._number)
            self._number, self._ends = -1, (-1, -1)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect."""
        self.close()

    def _run(self) -> None:
        seen = b""
        while True:
            ready = select.select([self._number, self._ends[0]], [], [])[0]
            if self._ends[0] in ready:
                return
            try:
                data = os.read(self._number, 64 * _EVENT.size)
            except OSError:  # unplugged
                data = b""
            if not data:
                self._lost = True
                return
            seen += data
            whole = len(seen) - len(seen) % _EVENT.size
            for _, value, kind, number in _EVENT.iter_unpack(seen[:whole]):
                if kind & ~_INITIAL == _AXIS and number == self._axis:
                    self._take(value)
            seen = seen[whole:]

    def _take(self, value: int) -> None:
        share = (-value if self._reverse else value) / _FULL
        if self._whole:
            share = (share + 1) / 2
        self._value = min(max(share, 0.0), 1.0)
