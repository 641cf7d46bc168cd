"""What sync and bulk instructions ask of one servo among many.

Source: ROBOTIS e-Manual, pages "DYNAMIXEL Protocol 2.0" and "Protocol 1.0".
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ikns.finger.emulator.packet import Protocol


class ReadRequest(NamedTuple):
    """Bytes that a servo has to send.

    Parameters
    ----------
    turn : int
        How many servos respond before it.
    address, size : int
    """

    turn: int
    address: int
    size: int


def sync_writes(
    data: bytes, protocol: Protocol, id: int
) -> Iterator[tuple[int, bytes]]:
    """Addresses and bytes that a sync write has for the servo `id`."""
    size = protocol  # bytes of an address or a length
    address, count = _number(data, 0, size), _number(data, size, size)
    for at in range(2 * size, len(data), count + 1):
        if data[at] == id:
            yield address, data[at + 1 : at + 1 + count]


def bulk_writes(data: bytes, id: int) -> Iterator[tuple[int, bytes]]:
    """Addresses and bytes that a bulk write (Protocol 2.0) has for the servo `id`."""
    at = 0
    while at + 5 <= len(data):
        count = _number(data, at + 3, 2)
        if data[at] == id:
            yield _number(data, at + 1, 2), data[at + 5 : at + 5 + count]
        at += 5 + count


def sync_read(data: bytes, id: int) -> ReadRequest | None:
    """Return what a sync read (Protocol 2.0) asks of the servo `id`, if anything."""
    if id not in data[4:]:
        return None
    return ReadRequest(data[4:].index(id), _number(data, 0, 2), _number(data, 2, 2))


def bulk_read(data: bytes, protocol: Protocol, id: int) -> ReadRequest | None:
    """Return what a bulk read asks of the servo `id`, if anything."""
    if protocol == 2:
        entries = [data[i : i + 5] for i in range(0, len(data), 5)]
        for turn, entry in enumerate(entries):
            if len(entry) == 5 and entry[0] == id:
                return ReadRequest(turn, _number(entry, 1, 2), _number(entry, 3, 2))
        return None
    entries = [data[i : i + 3] for i in range(1, len(data), 3)]
    for turn, entry in enumerate(entries):
        if len(entry) == 3 and entry[1] == id:
            return ReadRequest(turn, entry[2], entry[0])
    return None


def _number(data: bytes, at: int, size: int) -> int:
    return int.from_bytes(data[at : at + size], "little")
