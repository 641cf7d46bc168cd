"""The serial port of ROBOTIS's SDK, and what its errors mean."""

from __future__ import annotations

import errno
import time
from typing import Any

from ikns.finger.errors import FingerError

__all__ = ["load_sdk", "port_error_text", "port_errors"]

#: A read waits this long for bytes at a time, s; the SDK itself would spin.
_WAIT = 0.001


def port_errors() -> tuple[type[Exception], ...]:
    """Return the exceptions of a serial port that is missing or lost."""
    import termios

    return (OSError, termios.error)  # pyserial's own errors are OSErrors


def port_error_text(error: Exception) -> str:
    """Say what is wrong with a port, and what to do about it."""
    number = error.args[0] if error.args else None
    if number == errno.ENOENT:
        return "no such port, see ls /dev/serial/by-id"
    if number in (errno.EACCES, errno.EPERM):
        return "not permitted, add yourself to its group (dialout) and log in again"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program uses this port, close it first"
    text = str(error).splitlines()[0] if str(error) else type(error).__name__
    if "Inappropriate ioctl" in text:
        return "this is not a serial port"
    if "exclusively" in text:
        return "another program uses this port, close it first"
    return f"the port is lost ({text.rstrip('.')})"


def load_sdk() -> tuple[Any, Any]:
    """Import the SDK; return it and a port class that waits instead of spinning.

    Raises
    ------
    FingerError
        When the SDK or pyserial is not installed.
    """
    try:
        import dynamixel_sdk as sdk  # type: ignore[import-untyped]
        import serial  # type: ignore[import-untyped]
    except ImportError:
        raise FingerError(
            "Dynamixel servos need ROBOTIS's SDK: pip install 'ikns[serial]'."
        ) from None

    class Port(sdk.PortHandler):
        is_open: bool

        def getCurrentTime(self) -> float:  # milliseconds
            return time.monotonic() * 1e3

        def setupPort(self, cflag_baud: int) -> bool:
            if self.is_open:
                self.closePort()
            self.ser = serial.Serial(self.port_name, self.baudrate, timeout=_WAIT)
            self.is_open = True
            self.ser.reset_input_buffer()
            self.tx_time_per_byte = 1e4 / self.baudrate
            return True

    return sdk, Port
