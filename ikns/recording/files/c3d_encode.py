"""The bytes of a C3D file: header, named parameters, frames.

Written here rather than by a library, so that every system that runs the rest can write
recordings: ezc3d has no build for Linux on ARM. The tests read what is written with it,
and with our own reader (https://www.c3d.org, user guide, has the format).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ikns.recording.files.c3d_layout import BLOCK

#: Largest 16-bit word.
WORD = 0xFFFF
#: A parameter has at most so many texts; more go on in NAME2, NAME3 and so on.
_MOST_TEXTS = 255
#: Block, counted from 1, where the parameters start; the header is block 1.
_PARAMETERS_AT = 2
_INTEL = 84  # little-endian numbers
#: A negative scale says that positions are floating-point numbers.
_SCALE = -1.0
#: Points have x, y, z and a residual.
_VALUES_PER_POINT = 4


def encode_c3d(
    positions: NDArray[np.float64], labels: Sequence[str], *, first: int, rate: float
) -> bytes:
    """Return a C3D file of positions in mm.

    Parameters
    ----------
    positions : (T, M, 3) array
        mm, stored in single precision; NaN becomes a point with negative residual.
    labels : sequence of str
        120 kB of them at most fit into the 255 blocks of the parameters.
    first : int
        Number of the first frame, from 1.
    rate : float
        Frames per second.
    """
    n_frames, n_points, _ = positions.shape
    last = first + n_frames - 1
    section = _parameters(labels, n_frames=n_frames, first=first, rate=rate)
    data_start = _PARAMETERS_AT + len(section) // BLOCK
    # Numbers that a word does not hold are in TRIAL; Vicon writes the largest here.
    header = struct.pack(
        "<BB5Hf2Hf",
        _PARAMETERS_AT,
        0x50,
        n_points,
        0,  # analog samples a frame
        min(first, WORD),
        min(last, WORD),
        0,  # interpolated over a gap of this length at most: none was
        _SCALE,
        data_start,
        0,  # analog samples a frame and channel
        rate,
    )
    seen = ~np.isnan(positions).any(axis=2, keepdims=True)
    points = np.zeros((n_frames, n_points, _VALUES_PER_POINT), "<f4")
    points[..., :3] = np.where(seen, positions, 0.0)
    points[..., 3:] = np.where(seen, 0.0, -1.0)
    return _whole_blocks(header) + section + _whole_blocks(points.tobytes())


def _parameters(
    labels: Sequence[str], *, n_frames: int, first: int, rate: float
) -> bytes:
    """Return the section of the parameters, whole blocks."""

    def records(n_blocks: int) -> bytes:
        point = {
            "USED": _word(len(labels)),
            "SCALE": _float(_SCALE),
            "RATE": _float(rate),
            "DATA_START": _word(_PARAMETERS_AT + n_blocks),
            "FRAMES": _word(min(n_frames, WORD)),
            "UNITS": _texts(["mm"]),
            **_lists("LABELS", labels),
            **_lists("DESCRIPTIONS", [""] * len(labels)),
        }
        analog = {"USED": _word(0), "RATE": _float(0.0)}
        trial = {
            "ACTUAL_START_FIELD": _long(first),
            "ACTUAL_END_FIELD": _long(first + n_frames - 1),
        }
        groups = {"POINT": point, "ANALOG": analog, "TRIAL": trial}
        all_records = b"".join(
            _record(name, -number, b"\0")
            + b"".join(_record(key, number, value) for key, value in values.items())
            for number, (name, values) in enumerate(groups.items(), start=1)
        )
        # An empty record ends them.
        return bytes([1, 0x50, n_blocks, _INTEL]) + all_records + b"\0\0"

    return _whole_blocks(records(-(-len(records(0)) // BLOCK)))


def _record(name: str, group: int, content: bytes) -> bytes:
    """Return a named record: a parameter, or a group where the number is negative."""
    head = struct.pack("<bb", len(name), group) + name.encode("ascii")
    if group > 0:
        content += b"\0"  # no description
    # Counted from the offset itself to the next record.
    return head + struct.pack("<H", 2 + len(content)) + content


def _word(number: int) -> bytes:
    return struct.pack("<bBH", 2, 0, number)


def _long(number: int) -> bytes:
    """Return a 32-bit number as the two words, low word first, that Vicon writes."""
    return struct.pack("<bBBHH", 2, 1, 2, number % (WORD + 1), number // (WORD + 1))


def _float(number: float) -> bytes:
    return struct.pack("<bBf", 4, 0, number)


def _texts(texts: Sequence[str]) -> bytes:
    words = [text.encode("utf-8") for text in texts]
    width = max(map(len, words))
    padded = b"".join(word.ljust(width) for word in words)
    return struct.pack("<bBBB", -1, 2, width, len(words)) + padded


def _lists(name: str, texts: Sequence[str]) -> dict[str, bytes]:
    """Return a list of texts as parameters of at most 255."""
    parts = range(0, len(texts), _MOST_TEXTS)
    return {
        f"{name}{part + 1 if part else ''}": _texts(texts[at : at + _MOST_TEXTS])
        for part, at in enumerate(parts)
    }


def _whole_blocks(content: bytes) -> bytes:
    return content + bytes(-len(content) % BLOCK)
