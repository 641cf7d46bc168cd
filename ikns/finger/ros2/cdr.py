"""Messages as bytes: CDR (plain, version 1), the encoding of ROS 2.

Every number is aligned to its own size, counted from behind the header of four bytes. A
string has its length with the closing zero in front, a sequence its count.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

from ikns.finger.ros2.definitions import definitions

#: Format characters and sizes of the basic types.
_FORMATS = {
    "int8": ("b", 1),
    "uint8": ("B", 1),
    "byte": ("B", 1),
    "int32": ("i", 4),
    "uint32": ("I", 4),
    "float64": ("d", 8),
}
_LITTLE_ENDIAN, _BIG_ENDIAN = b"\x00\x01\x00\x00", b"\x00\x00\x00\x00"
_HEADER = 4

Message = Mapping[str, Any]


def encode(type_name: str, message: Message) -> bytes:
    """Encode a message, little endian.

    Parameters
    ----------
    type_name : str
        One of ``messages.msg``.
    message : mapping
        Values by field, nested likewise. Every field must be there.

    Examples
    --------
    >>> encode("std_msgs/msg/String", {"data": "ab"}).hex(" ")
    '00 01 00 00 03 00 00 00 61 62 00'
    """
    out = bytearray()
    _write(out, type_name, message)
    return _LITTLE_ENDIAN + out


def decode(type_name: str, data: bytes) -> dict[str, Any]:
    """Decode a message.

    Returns
    -------
    dict
        Values by field; sequences of numbers as tuples.

    Raises
    ------
    ValueError
        When the bytes are no such message.

    Examples
    --------
    >>> decode("std_msgs/msg/Float64", encode("std_msgs/msg/Float64", {"data": 0.5}))
    {'data': 0.5}
    """
    if data[:2] not in (_LITTLE_ENDIAN[:2], _BIG_ENDIAN[:2]):
        raise ValueError("not a CDR message")
    reader = _Reader(data, "<" if data[1] else ">")
    try:
        return reader.message(type_name)
    except struct.error:
        raise ValueError("the message ends too early") from None


def _align(out: bytearray, size: int) -> None:
    out.extend(bytes(-len(out) % size))


def _write(out: bytearray, type_name: str, message: Message) -> None:
    for field in definitions()[type_name]:
        value = message[field.name]
        if field.sequence:
            _align(out, 4)
            out += struct.pack("<I", len(value))
            if field.type in _FORMATS:
                if len(value):
                    form, size = _FORMATS[field.type]
                    _align(out, size)
                    out += struct.pack(f"<{len(value)}{form}", *value)
                continue
        for each in value if field.sequence else (value,):
            if field.type == "string":
                text = each.encode() + b"\0"
                _align(out, 4)
                out += struct.pack("<I", len(text)) + text
            elif field.nested:
                _write(out, field.type, each)
            else:
                form, size = _FORMATS[field.type]
                _align(out, size)
                out += struct.pack(f"<{form}", each)


class _Reader:
    """Reads values one after the other."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order = data, order
        self._at = _HEADER

    def message(self, type_name: str) -> dict[str, Any]:
        values = {}
        for name, kind, sequence in definitions()[type_name]:
            if not sequence:
                values[name] = self._one(kind)
            elif kind in _FORMATS:
                values[name] = self._numbers(kind, self._count())
            else:
                values[name] = [self._one(kind) for _ in range(self._count())]
        return values

    def _one(self, kind: str) -> Any:
        if kind in _FORMATS:
            return self._numbers(kind, 1)[0]
        if kind != "string":
            return self.message(kind)
        length = self._count()
        text = self._data[self._at : self._at + length]
        self._at += length
        return text.rstrip(b"\0").decode(errors="replace")

    def _count(self) -> int:
        """Read a count, of things that have a byte each at least."""
        (count,) = self._numbers("uint32", 1)
        if count > len(self._data) - self._at:
            raise ValueError("the message is shorter than it says")
        return int(count)

    def _numbers(self, kind: str, count: int) -> tuple[Any, ...]:
        form, size = _FORMATS[kind]
        if not count:
            return ()
        self._at += -(self._at - _HEADER) % size
        values = struct.unpack_from(f"{self._order}{count}{form}", self._data, self._at)
        self._at += count * size
        return values
