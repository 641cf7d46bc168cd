"""Registers of one Dynamixel servo on a serial port, through ROBOTIS's SDK."""

from __future__ import annotations

import time
from typing import Any

from ikns.finger.control_table import Register
from ikns.finger.errors import FingerError, NoResponse, PortLost, Rejected
from ikns.finger.line import Line, join_line
from ikns.finger.models import Model, alert_text
from ikns.finger.serial_port import load_sdk, port_errors

#: Bit rates and ids to try when the servo does not respond, most common first.
_BAUDS = (57600, 1000000, 115200, 2000000, 3000000, 4000000, 9600)
_IDS = (*range(1, 11), 0)
_READ, _WRITE = 0x02, 0x03
#: How long the SDK waits for a response, s.
_RESPONSE_TIMEOUT = 0.034
_ERRORS = {
    1: "it failed to do so",
    2: "it does not know that instruction",
    3: "the checksum was wrong",
    4: "the value is out of range",
    5: "the length is wrong",
    6: "the value is beyond a limit",
    7: "that cannot be written now",
}
_ALERT_1 = 0b100101  # of Protocol 1.0: voltage, overheating, overload


class Bus:
    """A connection to one servo. Its calls block; use it from one thread at a time.

    Parameters
    ----------
    port : str
    id, baud : int
    model : Model

    Attributes
    ----------
    alert : bool
        Whether the last response carried a hardware alert.
    tries : int
        How often to send an instruction before it counts as unanswered.
    """

    def __init__(self, port: str, *, id: int, baud: int, model: Model) -> None:
        self.port, self.id, self.baud, self.model = port, id, baud, model
        self.alert = False
        self.tries = 1
        self._bits = 0
        self._line: Line | None = None

    def open(self) -> None:
        """Open the port for this program alone, or share it with servos of its own.

        Raises
        ------
        FingerError
            When it is missing, in use or cannot be opened.
        """
        sdk, _ = load_sdk()
        self._packets = sdk.PacketHandler(float(self.model.protocol))
        self._success = sdk.COMM_SUCCESS
        self._line = join_line(
            self.port, self.id, baud=self.baud, protocol=self.model.protocol
        )

    def restore_settings(self) -> bool:
        """Undo what another program changed of rate and format; return whether it had.

        Raises
        ------
        PortLost
        """
        return self._opened().restore_settings(self.id)

    def close(self) -> None:
        """Close the port, unless others share it; harmless when repeated."""
        line, self._line = self._line, None
        if line is not None:
            line.leave(self.id)

    def check(self, *, diagnose: bool = True) -> None:
        """Check that the servo responds and is of the model that was named.

        Parameters
        ----------
        diagnose : bool
            Whether to spend a second on finding out what responds instead.

        Raises
        ------
        FingerError
            When it is not; the message says what was found instead.
        """
        try:
            number = self.read("model_number")
        except NoResponse:
            if not diagnose:
                raise
            raise NoResponse(self._diagnosis()) from None
        if number not in self.model.numbers:
            raise FingerError(
                f"{self.port}: servo {self.id} has model number {number}, but the "
                f"{self.model.name} has {' or '.join(map(str, self.model.numbers))}."
            )

    def read(self, name: str) -> int:
        """Return the value of a register.

        Raises
        ------
        NoResponse, Rejected, PortLost
        """
        return self.read_many(name, name)[name]

    def read_many(self, first: str, last: str) -> dict[str, int]:
        """Read all registers from one to another in one instruction.

        Raises
        ------
        NoResponse, Rejected, PortLost
        """
        start, end = self.model[first].address, self.model[last].end
        count = end - start
        data = self._transfer(
            f"reading {first}", _READ, self._encode(start, count), count
        )
        return {
            r.name: r.from_bytes(data[r.address - start : r.end - start])
            for r in self.model.registers.values()
            if start <= r.address and r.end <= end
        }

    def write(self, name: str, value: int) -> None:
        """Set a register.

        Raises
        ------
        NoResponse, Rejected, PortLost
        """
        register: Register = self.model[name]
        data = self._encode(register.address) + register.to_bytes(value)
        self._transfer(f"setting {name} to {value}", _WRITE, data, 0)

    def alerts(self) -> str:
        """Return the hardware alerts of the servo as text; empty if there are none.

        Raises
        ------
        NoResponse, Rejected, PortLost
        """
        if self.model.protocol == 2:
            bits = self.read("hardware_error_status")
        else:
            self.read("present_temperature")
            bits = self._bits
        return alert_text(bits, self.model.protocol) if bits else ""

    def _opened(self) -> Line:
        if self._line is None:
            raise PortLost(f"{self.port}: the port is closed.")
        return self._line

    def _responds(self, port: Any, number: int) -> bool:
        try:
            _, result, _ = self._packets.ping(port, number)
        except port_errors() as error:
            raise self._opened().lost(error) from None
        except IndexError:  # raised by the SDK when a response is too short
            port.is_using = False
            return False
        return bool(result == self._success)

    def _diagnosis(self) -> str:
        """Say what responds instead."""
        start = f"{self.port}: servo {self.id} does not answer at {self.baud} baud"
        line = self._opened()
        with line.turn(self.id) as port:
            for number in _IDS:
                if number not in line.servos and self._responds(port, number):
                    return f"{start}, but servo {number} does."
            # Others on the port would not be heard at another rate.
            for baud in _BAUDS if len(line.servos) == 1 else ():
                if baud != self.baud:
                    port.setBaudRate(baud)
                    if self._responds(port, self.id):
                        return f"{start}, but at {baud}."
        return f"{start}; check its power, cable, id and baud rate."

    def _encode(self, *numbers: int) -> bytes:
        size = self.model.protocol  # bytes of an address or a length
        return b"".join(number.to_bytes(size, "little") for number in numbers)

    def _transfer(self, doing: str, instruction: int, data: bytes, count: int) -> bytes:
        """Send an instruction until the servo responds; return the response's data."""
        for attempt in range(self.tries - 1):
            try:
                return self._transfer_once(doing, instruction, data, count)
            except NoResponse:
                # A late response must not be taken for one to the next instruction.
                time.sleep(_RESPONSE_TIMEOUT * 2**attempt)
        return self._transfer_once(doing, instruction, data, count)

    def _transfer_once(
        self, doing: str, instruction: int, data: bytes, count: int
    ) -> bytes:
        """Send an instruction once; return the data of the response.

        A response of another length is a late one to an earlier instruction; the SDK's
        own readTxRx would take its checksum for data.
        """
        wide, content = self.model.protocol == 2, len(data)
        if wide:
            packet = [0, 0, 0, 0, self.id, *(content + 3).to_bytes(2, "little")]
        else:
            packet = [0, 0, self.id, content + 2]
        packet += [instruction, *data, 0, 0] if wide else [instruction, *data, 0]
        no_response = NoResponse(
            f"{self.port}: servo {self.id} did not respond when {doing}."
        )
        line = self._opened()
        with line.turn(self.id) as port:
            try:
                response, result, error = self._packets.txRxPacket(port, packet)
            except port_errors() as lost:
                port.is_using = False
                if "timeout" in type(lost).__name__.lower():  # of pyserial, for a write
                    raise no_response from None
                raise line.lost(lost) from None
            except IndexError:  # raised by the SDK when a response is too short
                port.is_using = False
                raise no_response from None
            if result != self._success:
                port.is_using = False
                raise no_response
            self._check_status(doing, error)
            start = 9 if wide else 5
            length = (
                int.from_bytes(response[5:7], "little") - 4 if wide else response[3] - 2
            )
            if length != count:
                # The right response, if it comes, will be late too.
                time.sleep(_RESPONSE_TIMEOUT)
                raise no_response
        return bytes(response[start : start + count])

    def _check_status(self, doing: str, error: int) -> None:
        if self.model.protocol == 2:
            self.alert, number = bool(error & 0x80), error & 0x7F
            why = _ERRORS.get(number, f"error {number}")
        else:
            self._bits = error & _ALERT_1
            self.alert, number = bool(self._bits), error & ~_ALERT_1
            why = f"error bits {number:#x}"
        if number:
            raise Rejected(
                f"{self.port}: servo {self.id} rejected {doing}: {why}.", number
            )
