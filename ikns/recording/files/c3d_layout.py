"""Header and parameters of a C3D file, with every offset checked.

A C3D file is made of blocks of 512 bytes: a header, a section of named parameters in
groups, and frames of points and analog samples, in one of three machines' number
formats (https://www.c3d.org, user guide). Every count and offset is checked against the
size of the file before it is used, so a damaged file gives an error message where
compiled readers ended in a segmentation fault.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.errors import FileError
from ikns.recording.files.conversion import existing_file, shown

#: Bytes of a block, of which a C3D file is made.
BLOCK = 512
_KEY = 0x50
_INTEL, _DEC, _MIPS = 84, 85, 86
_CHAR, _BYTE, _INT, _FLOAT = -1, 1, 2, 4

Value = list[str] | Array


@dataclass(frozen=True)
class C3dLayout:
    """Header and parameters of a C3D file."""

    machine: int  # 84 Intel, 85 DEC, 86 MIPS: how numbers are stored
    header: tuple[int, int, int, int]  # points, analog a frame, first and last frame
    scale: float  # negative for floating-point data
    rate: float
    data_start: int  # byte where the frames begin
    size: int  # of the file, bytes
    parameters: dict[str, Value]  # "GROUP:NAME" to texts or a flat array of numbers

    def number(self, name: str, default: float) -> float:
        """Return a parameter's first number, or the default when there is none."""
        value = self.parameters.get(name)
        if isinstance(value, np.ndarray) and value.size:
            return float(value[0])
        return default

    def texts(self, name: str) -> list[str]:
        """Return a parameter's texts, with those of NAME2, NAME3 and so on."""
        texts: list[str] = []
        number = 1
        while True:
            key = name if number == 1 else f"{name}{number}"
            value = self.parameters.get(key)
            if not isinstance(value, list):
                return texts
            texts += value
            number += 1


def read_layout(path: Path) -> C3dLayout:
    """Read header and parameters of a C3D file."""
    size = existing_file(path)
    with path.open("rb") as file:
        head = file.read(BLOCK)
        if len(head) < 2 or head[1] != _KEY or head[0] == 0:
            raise FileError(
                f"{path}: this is not a C3D file (it starts with the bytes "
                f"{head[:4].hex(' ')})."
            )
        section_start = (head[0] - 1) * BLOCK
        if len(head) < BLOCK or section_start + 4 > size:
            raise _cut(path, section_start + 4, size)
        file.seek(section_start)
        machine = file.read(4)[3]
        if machine not in (_INTEL, _DEC, _MIPS):
            raise FileError(
                f"{path}: expected machine type 84, 85 or 86 in a C3D file, found "
                f"{machine}, so its header is damaged."
            )
        order = ">" if machine == _MIPS else "<"
        words = struct.unpack(f"{order}4H2x4sH2x4s", head[2:24])
        data_start = (words[5] - 1) * BLOCK
        if data_start <= section_start:
            raise FileError(
                f"{path}: expected data after the parameters of a C3D file, found the "
                f"data in block {words[5]} and the parameters in block {head[0]}."
            )
        if data_start > size:
            raise _cut(path, data_start, size)
        file.seek(section_start)
        section = file.read(data_start - section_start)
    return C3dLayout(
        machine=machine,
        header=words[:4],
        scale=float(floats(words[4], machine)[0]),
        rate=float(floats(words[6], machine)[0]),
        data_start=data_start,
        size=size,
        parameters=_parameters(path, section, machine),
    )


def floats(raw: bytes, machine: int) -> NDArray[np.float32]:
    """Return 4-byte floats of a machine.

    >>> floats(bytes.fromhex("803f0000"), 85)  # DEC: words swapped, exponent off by 2
    array([0.25], dtype=float32)
    """
    if machine != _DEC:
        return np.frombuffer(raw, ">f4" if machine == _MIPS else "<f4")
    swapped = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1].tobytes()
    with np.errstate(invalid="ignore"):
        return np.frombuffer(swapped, "<f4") * np.float32(0.25)


def _cut(path: Path, expected: int, size: int) -> FileError:
    return FileError(
        f"{path}: expected at least {expected} bytes as its header says, found {size}, "
        f"so the file is cut off."
    )


def _parameters(path: Path, section: bytes, machine: int) -> dict[str, Value]:
    """Walk the records of the parameter section.

    A record is a length and a name, the number of its group (negative when it *is* the
    group), the offset to the next record, and its content; length 0 ends the section.
    """
    order = ">" if machine == _MIPS else "<"
    groups: dict[int, str] = {}
    values: list[tuple[int, str, Value]] = []
    at = 4
    while at < len(section) and section[at]:
        try:
            length, number = struct.unpack_from("bb", section, at)
            name_end = at + 2 + abs(length)
            name = _text(section[at + 2 : name_end]).upper()
            (offset,) = struct.unpack_from(f"{order}H", section, name_end)
            end = name_end + offset if offset else len(section)
            if end <= name_end or end > len(section):
                raise ValueError
            if number < 0:
                groups[-number] = name
            else:
                value = _value(section[name_end + 2 : end], machine)
                values.append((number, name, value))
        except (struct.error, ValueError, IndexError):
            raise FileError(
                f"{path}: expected a parameter {at} bytes into the parameter section "
                f"of a C3D file, found {shown(section[at : at + 16].hex(' '))}, so "
                f"the file is damaged or cut off."
            ) from None
        at = end
    return {
        f"{groups[number]}:{name}": value
        for number, name, value in values
        if number in groups
    }


def _value(record: bytes, machine: int) -> Value:
    """Return a parameter's content: type, dimensions, then the data in column order."""
    kind, n_dims = struct.unpack_from("bb", record)
    if kind not in (_CHAR, _BYTE, _INT, _FLOAT) or not 0 <= n_dims <= 7:
        raise ValueError
    dims = record[2 : 2 + n_dims]
    data = record[2 + n_dims : 2 + n_dims + math.prod(dims) * abs(kind)]
    if len(dims) < n_dims or len(data) < math.prod(dims) * abs(kind):
        raise ValueError
    if kind == _CHAR:
        width = dims[0] if dims else 1
        return [_text(data[i : i + width]) for i in range(0, len(data), width or 1)]
    if kind == _FLOAT:
        with np.errstate(invalid="ignore"):  # a damaged value may be a signaling NaN
            return floats(data, machine).astype(np.float64)
    if kind == _INT:
        return np.frombuffer(data, ">i2" if machine == _MIPS else "<i2").astype(float)
    return np.frombuffer(data, np.int8).astype(float)


def _text(raw: bytes) -> str:
    """Return a fixed-width text without its padding."""
    raw = raw.replace(b"\0", b" ")
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()
