"""The serial port of ROBOTIS's SDK, and what its errors mean."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import sys
import termios
import time
from pathlib import Path
from typing import Any

from ikns.finger.errors import FingerError

#: A read waits this long for bytes at a time, s; the SDK itself would spin.
_WAIT = 0.001
#: Longest wait for bytes to be taken, s.
_WRITE_TIMEOUT = 0.1
#: Major device numbers of pseudo-terminals (Linux, Documentation/admin-guide/devices).
_PSEUDO_TERMINALS = range(136, 144)
#: Names of pseudo-terminals on macOS; its serial ports are tty.NAME and cu.NAME.
_MACOS_PSEUDO_TERMINAL = re.compile(r"/dev/ttys\d+")


def port_errors() -> tuple[type[Exception], ...]:
    """Return the exceptions of a serial port that is missing or lost."""
    return (OSError, termios.error)  # pyserial's own errors are OSErrors


def port_holder(port: str) -> int | None:
    """Return the id of another process that has a port open, where /proc allows."""
    with contextlib.suppress(OSError):
        about = Path(port).stat()
        device = f"{os.major(about.st_dev):02x}:{os.minor(about.st_dev):02x}"
        for line in Path("/proc/locks").read_text("ascii").splitlines():
            words = line.split()  # number, kind, mode, type, pid, device and inode
            if words[1] == "FLOCK" and words[5] == f"{device}:{about.st_ino}":
                return int(words[4])
        for link in Path("/proc").glob("[0-9]*/fd/*"):
            with contextlib.suppress(OSError):
                number = int(link.parts[2])
                if number != os.getpid() and link.stat().st_rdev == about.st_rdev:
                    return number
    return None


def port_error_text(error: Exception, port: str) -> str:
    """Say what is wrong with a port, and what to do about it."""
    number = error.args[0] if error.args else None
    if number == errno.ENOENT:
        places = "/dev/serial/by-id" if sys.platform == "linux" else "/dev/cu.*"
        return f"no such port, see ls {places}"
    if number in (errno.EACCES, errno.EPERM):
        group = " (dialout)" if sys.platform == "linux" else ""
        return f"not permitted, add yourself to its group{group} and log in again"
    if number in (errno.EAGAIN, errno.EBUSY):
        holder = port_holder(port)
        which = f" (process {holder})" if holder else ""
        return f"another program uses this port{which}, close it first"
    text = str(error).splitlines()[0] if str(error) else type(error).__name__
    if "Inappropriate ioctl" in text:
        return "this is not a serial port"
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
            # `exclusive` locks the port (flock) before its settings are touched.
            self.ser = serial.Serial(
                self.port_name,
                self.baudrate,
                timeout=_WAIT,
                write_timeout=_WRITE_TIMEOUT,
                exclusive=True,
            )
            self.is_open = True
            _exclude_others(self.ser.fileno())
            self.ser.reset_input_buffer()
            self.tx_time_per_byte = 1e4 / self.baudrate
            return True

    return sdk, Port


def _exclude_others(number: int) -> None:
    """Let no other program open a port, not even one that asks for no lock.

    Root may nevertheless. A pseudo-terminal would stay closed to everyone after this
    program was killed, as the emulator keeps it open.
    """
    if not _is_pseudo_terminal(number):
        with contextlib.suppress(OSError):
            fcntl.ioctl(number, termios.TIOCEXCL)


def _is_pseudo_terminal(number: int) -> bool:
    if sys.platform == "linux":
        return os.major(os.fstat(number).st_rdev) in _PSEUDO_TERMINALS
    return _MACOS_PSEUDO_TERMINAL.fullmatch(os.ttyname(number)) is not None
