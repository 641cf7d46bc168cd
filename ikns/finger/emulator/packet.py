"""Packets of the Dynamixel protocols: encoding and parsing.

Source: ROBOTIS e-Manual, pages "DYNAMIXEL Protocol 2.0" and "Protocol 1.0".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Protocol = Literal[1, 2]

BROADCAST = 0xFE
STATUS = 0x55
_HEADER_2 = b"\xff\xff\xfd\x00"
_HEADER_1 = b"\xff\xff"
#: Longer than any packet of one servo: a greater length is noise.
_LONGEST = 1024


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ (0x8005 if crc & 0x8000 else 0)
        table.append(crc & 0xFFFF)
    return tuple(table)


_CRC = _crc_table()


def crc16(data: bytes) -> int:
    """CRC of Protocol 2.0: polynomial 0x8005, start 0, no reflection.

    >>> hex(crc16(bytes.fromhex("ff ff fd 00 01 07 00 02 84 00 04 00")))
    '0x151d'
    """
    crc = 0
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ _CRC[(crc >> 8) ^ byte]
    return crc


def checksum(data: bytes) -> int:
    """Checksum of Protocol 1.0 over everything between the header and itself.

    >>> hex(checksum(bytes.fromhex("01 05 03 0c 64 aa")))
    '0xdc'
    """
    return ~sum(data) & 0xFF


def stuff(body: bytes) -> bytes:
    """Put FD after every FF FF FD, so that no body contains a header."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuff(body: bytes) -> bytes:
    """Undo :func:`stuff`."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


@dataclass(frozen=True)
class Packet:
    """An instruction, or a status when `error` is not None.

    Parameters
    ----------
    id : int
    instruction : int
        0x55 for a status of Protocol 2.0, 0 for one of Protocol 1.0.
    data : bytes
        Parameters.
    error : int or None
    intact : bool
        Whether the checksum matched.
    """

    id: int
    instruction: int
    data: bytes = b""
    error: int | None = None
    intact: bool = True


def encode(packet: Packet, protocol: Protocol) -> bytes:
    """Return the bytes of a packet.

    >>> encode(Packet(1, 1), 2).hex(" ")
    'ff ff fd 00 01 03 00 01 19 4e'
    >>> encode(Packet(1, 1), 1).hex(" ")
    'ff ff 01 02 01 fb'
    """
    error = b"" if packet.error is None else bytes([packet.error])
    if protocol == 1:
        kind = error or bytes([packet.instruction])
        body = bytes([packet.id, len(packet.data) + 2]) + kind + packet.data
        return _HEADER_1 + body + bytes([checksum(body)])
    kind = bytes([packet.instruction if packet.error is None else STATUS])
    body = stuff(kind + error + packet.data)
    length = (len(body) + 2).to_bytes(2, "little")
    head = _HEADER_2 + bytes([packet.id]) + length + body
    return head + crc16(head).to_bytes(2, "little")


class Parser:
    """Finds packets in a stream of bytes that arrives in pieces and may contain noise.

    Parameters
    ----------
    protocol : {1, 2}
    status : bool
        Whether to expect status packets rather than instructions, which look alike in
        Protocol 1.0.

    Examples
    --------
    >>> parser = Parser(2)
    >>> parser.feed(bytes.fromhex("00 ff ff fd 00 01 03"))
    []
    >>> parser.feed(bytes.fromhex("00 01 19 4e"))
    [Packet(id=1, instruction=1, data=b'', error=None, intact=True)]
    """

    def __init__(self, protocol: Protocol, *, status: bool = False) -> None:
        self._next = self._next_1 if protocol == 1 else self._next_2
        self._status = status
        self._buffer = b""

    def feed(self, data: bytes) -> list[Packet]:
        """Add bytes; return the packets that they complete."""
        self._buffer += data
        return list(self._packets())

    def reset(self) -> None:
        """Drop an incomplete packet."""
        self._buffer = b""

    def _packets(self) -> Iterator[Packet]:
        while (packet := self._next()) is not None:
            yield packet

    def _start(self, header: bytes) -> bool:
        at = self._buffer.find(header)
        if at < 0:  # the first bytes of a header may be there
            at = max(len(self._buffer) - len(header) + 1, 0)
            self._buffer = self._buffer[at:]
            return False
        self._buffer = self._buffer[at:]
        return True

    def _next_2(self) -> Packet | None:
        while self._start(_HEADER_2):
            if len(self._buffer) < 7:
                return None
            length = int.from_bytes(self._buffer[5:7], "little")
            if not 3 <= length <= _LONGEST:
                self._buffer = self._buffer[1:]
                continue
            whole = self._buffer[: 7 + length]
            if len(whole) < 7 + length:
                return None
            self._buffer = self._buffer[len(whole) :]
            intact = crc16(whole[:-2]) == int.from_bytes(whole[-2:], "little")
            body = unstuff(whole[7:-2])
            if body[0] != STATUS:
                return Packet(whole[4], body[0], body[1:], None, intact)
            if len(body) > 1:
                return Packet(whole[4], STATUS, body[2:], body[1], intact)
        return None

    def _next_1(self) -> Packet | None:
        while self._start(_HEADER_1):
            if len(self._buffer) < 4:
                return None
            number, length = self._buffer[2:4]
            if number == 0xFF or length < 2:
                self._buffer = self._buffer[1:]
                continue
            whole = self._buffer[: 4 + length]
            if len(whole) < 4 + length:
                return None
            self._buffer = self._buffer[len(whole) :]
            intact = checksum(whole[2:-1]) == whole[-1]
            if self._status:
                return Packet(number, 0, whole[5:-1], whole[4], intact)
            return Packet(number, whole[4], whole[5:-1], None, intact)
        return None
