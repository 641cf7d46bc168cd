"""One Dynamixel servo on a serial port, register by register, through ROBOTIS's SDK."""

from __future__ import annotations

import errno
import time
from typing import Any

from ikns.finger.errors import FingerError
from ikns.finger.models import Model, Register, alert_text

__all__ = ["Bus", "NoAnswer", "Refused", "Unplugged"]

#: Ping what else may be there when nobody answers, most common first.
_BAUDS = (57600, 1000000, 115200, 2000000, 3000000, 4000000, 9600)
_IDS = (*range(1, 11), 0)
#: Reads wait for bytes so long at a time, seconds; the SDK itself would spin.
_WAIT = 0.001
_READ, _WRITE = 0x02, 0x03
#: How long the SDK waits for an answer, seconds.
_LATE = 0.034
_REFUSALS = {
    1: "it failed to do so",
    2: "it does not know that instruction",
    3: "the checksum was wrong",
    4: "the value is out of range",
    5: "the length is wrong",
    6: "the value is beyond a limit",
    7: "that cannot be written now",
}
_ALERT_1 = 0b100101  # of Protocol 1.0: voltage, overheating, overload


class NoAnswer(FingerError):
    """The servo did not answer, or not intelligibly."""


class Refused(FingerError):
    """The servo answered that it will not.

    Parameters
    ----------
    message : str
    number : int
        Error number of Protocol 2.0, error bits of Protocol 1.0.
    """

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


class Unplugged(FingerError):
    """The port is gone."""


class Bus:
    """A connection to one servo. Blocks; not for use from several threads at once.

    Parameters
    ----------
    port : str
    id, baud : int
    model : Model

    Attributes
    ----------
    alert : bool
        Whether the last answer carried a hardware alert.
    tries : int
        How often to say the same before it counts as unanswered.
    """

    def __init__(self, port: str, *, id: int, baud: int, model: Model) -> None:
        self.port, self.id, self.baud, self.model = port, id, baud, model
        self.alert = False
        self.tries = 1
        self._bits = 0
        self._port: Any = None

    def open(self) -> None:
        """Open the port for this program alone.

        Raises
        ------
        FingerError
            When it is absent, in use or not to be opened.
        """
        sdk, port_type = _sdk()
        self._packets = sdk.PacketHandler(float(self.model.protocol))
        self._success = sdk.COMM_SUCCESS
        port = port_type(self.port)
        if port.getCFlagBaud(self.baud) <= 0:
            raise FingerError(f"{self.port}: no serial port runs at {self.baud} baud.")
        port.baudrate = self.baud
        try:
            port.openPort()
            port.ser.write_timeout = 0.1
            port.ser.exclusive = True
        except _lost() as error:
            if port.is_open:
                port.closePort()
            raise FingerError(f"{self.port}: {_why(error)}.") from None
        self._port = port

    def close(self) -> None:
        """Close the port; harmless when repeated."""
        port, self._port = self._port, None
        if port is not None:
            try:
                port.closePort()
            except _lost():
                pass

    def check(self, *, diagnose: bool = True) -> None:
        """Make sure that the servo is there and is the one that was named.

        Parameters
        ----------
        diagnose : bool
            Whether to take the time (a second) to look who answers instead.

        Raises
        ------
        FingerError
            When it is not; the sentence says what was found instead.
        """
        try:
            number = self.read("model_number")
        except NoAnswer:
            if not diagnose:
                raise
            raise NoAnswer(self._nobody()) from None
        if number not in self.model.numbers:
            raise FingerError(
                f"{self.port}: servo {self.id} has model number {number}, but the "
                f"{self.model.name} has {' or '.join(map(str, self.model.numbers))}."
            )

    def read(self, name: str) -> int:
        """Return the value of a register.

        Raises
        ------
        NoAnswer, Refused, Unplugged
        """
        return self.read_many(name, name)[name]

    def read_many(self, first: str, last: str) -> dict[str, int]:
        """Read all registers from one to another at once.

        Raises
        ------
        NoAnswer, Refused, Unplugged
        """
        start, end = self.model[first].address, self.model[last].end
        count = end - start
        data = self._talk(f"reading {first}", _READ, self._place(start, count), count)
        return {
            r.name: r.from_bytes(data[r.address - start : r.end - start])
            for r in self.model.registers.values()
            if start <= r.address and r.end <= end
        }

    def write(self, name: str, value: int) -> None:
        """Set a register.

        Raises
        ------
        NoAnswer, Refused, Unplugged
        """
        register: Register = self.model[name]
        data = self._place(register.address) + register.to_bytes(value)
        self._talk(f"setting {name} to {value}", _WRITE, data, 0)

    def alerts(self) -> str:
        """Return what the servo complains of; empty if nothing.

        Raises
        ------
        NoAnswer, Refused, Unplugged
        """
        if self.model.protocol == 2:
            bits = self.read("hardware_error_status")
        else:
            self.read("present_temperature")
            bits = self._bits
        return alert_text(bits, self.model.protocol) if bits else ""

    def _answers(self, number: int) -> bool:
        try:
            _, result, _ = self._packets.ping(self._port, number)
        except _lost() as error:
            raise Unplugged(f"{self.port}: {_why(error)}.") from None
        except IndexError:  # from within the SDK: the answer is shorter than it says
            self._port.is_using = False
            return False
        return bool(result == self._success)

    def _nobody(self) -> str:
        """Say who answers instead."""
        start = f"{self.port}: servo {self.id} does not answer at {self.baud} baud"
        for number in _IDS:
            if number != self.id and self._answers(number):
                return f"{start}, but servo {number} does."
        for baud in _BAUDS:
            if baud != self.baud:
                self._port.setBaudRate(baud)
                if self._answers(self.id):
                    return f"{start}, but at {baud}."
        return f"{start}; check its power, cable, id and rate."

    def _place(self, *numbers: int) -> bytes:
        size = self.model.protocol  # bytes of an address or a length
        return b"".join(number.to_bytes(size, "little") for number in numbers)

    def _talk(self, doing: str, instruction: int, data: bytes, count: int) -> bytes:
        """Say something until it is answered; return the bytes that came."""
        for attempt in range(self.tries - 1):
            try:
                return self._once(doing, instruction, data, count)
            except NoAnswer:
                # A late answer must not be taken for one to the next question.
                time.sleep(_LATE * 2**attempt)
        return self._once(doing, instruction, data, count)

    def _once(self, doing: str, instruction: int, data: bytes, count: int) -> bytes:
        """Say something; an answer of another length is a late one to something else.

        The SDK's own readTxRx would take its checksum for data.
        """
        if self._port is None:
            raise Unplugged(f"{self.port}: the port is closed.")
        wide, content = self.model.protocol == 2, len(data)
        if wide:
            packet = [0, 0, 0, 0, self.id, *(content + 3).to_bytes(2, "little")]
        else:
            packet = [0, 0, self.id, content + 2]
        packet += [instruction, *data, 0, 0] if wide else [instruction, *data, 0]
        silent = NoAnswer(f"{self.port}: servo {self.id} did not answer when {doing}.")
        try:
            answer, result, error = self._packets.txRxPacket(self._port, packet)
        except _lost() as lost:
            self._port.is_using = False
            if "timeout" in type(lost).__name__.lower():  # of pyserial, for a write
                raise silent from None
            raise Unplugged(f"{self.port}: {_why(lost)}.") from None
        except IndexError:  # from within the SDK: the answer is shorter than it says
            self._port.is_using = False
            raise silent from None
        if result != self._success:
            self._port.is_using = False
            raise silent
        self._judge(doing, error)
        start = 9 if wide else 5
        length = int.from_bytes(answer[5:7], "little") - 4 if wide else answer[3] - 2
        if length != count:
            time.sleep(_LATE)  # the right one, too, if it comes, will be late
            raise silent
        return bytes(answer[start : start + count])

    def _judge(self, doing: str, error: int) -> None:
        if self.model.protocol == 2:
            self.alert, number = bool(error & 0x80), error & 0x7F
            why = _REFUSALS.get(number, f"error {number}")
        else:
            self._bits = error & _ALERT_1
            self.alert, number = bool(self._bits), error & ~_ALERT_1
            why = f"error bits {number:#x}"
        if number:
            raise Refused(
                f"{self.port}: servo {self.id} refused {doing}: {why}.", number
            )


def _lost() -> tuple[type[Exception], ...]:
    """Return what a serial port raises when it is not there, or no longer."""
    import termios

    return (OSError, termios.error)  # pyserial's own errors are OSErrors


def _why(error: Exception) -> str:
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


def _sdk() -> tuple[Any, Any]:
    """Import the SDK, and make a port of it that waits instead of spinning."""
    try:
        import dynamixel_sdk as sdk  # type: ignore[import-untyped]
        import serial  # type: ignore[import-untyped]
    except ImportError:
        raise FingerError(
            "Dynamixel servos need ROBOTIS's SDK, which pip install 'ikns[serial]' "
            "brings."
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
