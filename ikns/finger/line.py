"""A serial port that the servos of one program share: one transfer at a time."""

from __future__ import annotations

import contextlib
import os
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ikns.finger.errors import FingerError, NoResponse, PortLost
from ikns.finger.serial_port import load_sdk, port_error_text, port_errors

#: A finger's thread that has asked for nothing for so long hangs, s; while it connects
#: it may wait a third of this between two attempts.
_HUNG = 1.0
#: Who is refused waits before it tries again, s.
_PAUSE = 0.01


class Line:
    """An open port, and the servos of this program behind it; see :func:`join_line`.

    Parameters
    ----------
    name : str
        The port, as it was first called.
    baud, protocol : int

    Attributes
    ----------
    port : Any
        The SDK's port; None once it is lost.
    """

    def __init__(self, name: str, *, baud: int, protocol: int) -> None:
        self.name, self.baud, self.protocol = name, baud, protocol
        self.port: Any = None
        self._asked: dict[int, float] = {}
        self._settings: list[Any] = []
        self._transfer, self._next = threading.Lock(), threading.Lock()

    @property
    def servos(self) -> tuple[int, ...]:
        """Ids of the servos that have a finger."""
        return tuple(self._asked)

    @contextmanager
    def turn(self, servo: int) -> Iterator[Any]:
        """Have the port for one transfer of a servo, in turn with the others.

        A thread that gives the port back and wants it again stands behind who waits, so
        a servo without answers does not keep the others waiting for more than one read.

        Raises
        ------
        PortLost
            When the port is closed.
        NoResponse
            When the thread of another servo hangs: its watchdog would count what is
            sent here, so the line stays silent until it has stopped the servo.
        """
        self._check_others(servo)
        with self._next:
            self._transfer.acquire()
        try:
            if self.port is None:
                raise PortLost(f"{self.name}: the port is closed.")
            yield self.port
        finally:
            self._transfer.release()

    def open(self) -> None:
        """Open the port for this program alone; harmless while it is open."""
        with self._next, self._transfer:
            if self.port is None:
                self.port = self._opened()

    def lost(self, error: Exception) -> PortLost:
        """Close a port that failed, for all its servos; return what to raise."""
        self._close()
        return PortLost(f"{self.name}: {port_error_text(error, self.name)}.")

    def restore_settings(self, servo: int) -> bool:
        """Undo what another program changed of rate and format; return whether it had.

        Raises
        ------
        PortLost
        """
        with self.turn(servo) as port:
            try:
                if termios.tcgetattr(port.ser.fileno()) == self._settings:
                    return False
                port.ser.baudrate = self.baud  # sets everything else as well
                self._settings = termios.tcgetattr(port.ser.fileno())
            except port_errors() as error:
                raise self.lost(error) from None
        return True

    def add(self, servo: int) -> None:
        """Take a servo in."""
        self._asked[servo] = time.monotonic()

    def leave(self, servo: int) -> None:
        """Give up a servo; the last one closes the port."""
        with _lock:
            self._asked.pop(servo, None)
            if self._asked:
                return
            for path in [path for path, line in _lines.items() if line is self]:
                del _lines[path]
            with self._next, self._transfer:
                self._close()

    def _check_others(self, servo: int) -> None:
        now = self._asked[servo] = time.monotonic()
        for other, asked in tuple(self._asked.items()):
            if now - asked > _HUNG:
                time.sleep(_PAUSE)
                raise NoResponse(f"{self.name}: nothing services servo {other}.")

    def _opened(self) -> Any:
        _, port_type = load_sdk()
        port = port_type(self.name)
        if port.getCFlagBaud(self.baud) <= 0:
            raise FingerError(f"{self.name}: no serial port supports {self.baud} baud.")
        port.baudrate = self.baud
        try:
            port.openPort()
            self._settings = termios.tcgetattr(port.ser.fileno())
        except port_errors() as error:
            if port.is_open:
                port.closePort()
            text = port_error_text(error, self.name)
            raise FingerError(f"{self.name}: {text}.") from None
        return port

    def _close(self) -> None:
        port, self.port = self.port, None
        if port is not None:
            with contextlib.suppress(*port_errors()):
                port.closePort()


#: Lines that have servos, by the port's real path: two names of a port are one line.
_lines: dict[str, Line] = {}
_lock = threading.Lock()


def join_line(path: str, servo: int, *, baud: int, protocol: int) -> Line:
    """Open a port for a servo, or share it where this program has it open already.

    Raises
    ------
    FingerError
        When it is missing, in use or cannot be opened, the servo has a finger already,
        or the others on the port have another baud rate or protocol.
    """
    real = os.path.realpath(path)
    with _lock:
        line = _lines.get(real)
        if line is None:
            line = Line(path, baud=baud, protocol=protocol)
        if servo in line.servos:
            raise FingerError(f"{path}: another finger already uses servo {servo}.")
        if (line.baud, line.protocol) != (baud, protocol):
            raise FingerError(
                f"{path}: expected one baud rate and protocol for all servos of a "
                f"port, found {line.baud} baud and protocol {line.protocol}.0 for "
                f"servo {line.servos[0]}, {baud} and {protocol}.0 for servo {servo}."
            )
        line.open()
        line.add(servo)
        _lines[real] = line
    return line
