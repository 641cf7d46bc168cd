"""Reader of C3D, the binary file of most camera systems.

A C3D point is not always a marker. Model outputs (angles, forces, moments, powers) are
stored as points too and named in separate parameter lists; they are dropped, and so are
trajectories without a name. Virtual points that *are* positions (joint centers, the
center of mass) are kept; callers select markers by label.

ezc3d checks this reader in its tests but does not read our files: version 1.7.2 ends
the whole process on some damaged parameters, refuses parameter descriptions over 127
bytes, and drops all frames after 65535.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.errors import FileError
from ikns.recording.files.c3d_layout import BLOCK, C3dLayout, floats, read_layout
from ikns.recording.files.conversion import (
    checked_rate,
    is_unlabeled,
    meters_per,
    to_recording,
)
from ikns.recording.recording import Recording

#: Parameter lists of the POINT group whose members are not positions.
_NOT_POSITIONS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")

#: Largest count that a 16-bit word holds; longer recordings use other parameters.
_WORD = 0xFFFF
#: Rates that differ by less are the same.
_SAME_RATE = 0.01


def read_c3d(path: Path) -> Recording:
    """Read the markers of a C3D file.

    Frame 1 is at 0 s; a part of a longer recording keeps its times. Positions without a
    unit are taken as mm, the usual unit of C3D files, and refused when that is not
    plausible. Analog channels are ignored.
    """
    layout = read_layout(path)
    rate = checked_rate(path, layout.number("POINT:RATE", layout.rate) or layout.rate)
    unit = next(iter(layout.texts("POINT:UNITS")), "") or "mm"
    meters = meters_per(path, unit)
    labels = layout.texts("POINT:LABELS")
    not_positions = {
        _bare(label)
        for kind in _NOT_POSITIONS
        for label in layout.texts(f"POINT:{kind}")
    }
    columns = [
        column
        for column, label in enumerate(labels[: layout.header[0]])
        if not is_unlabeled(label) and _bare(label) not in not_positions
    ]
    if not columns:
        raise FileError(
            f"{path}: expected at least one named marker, found {layout.header[0]} "
            f"points that are unnamed or model outputs."
        )
    points = _points(path, layout, rate)[:, columns]
    with np.errstate(invalid="ignore"):  # a damaged value may be a signaling NaN
        markers = points[..., :3].astype(np.float64) * meters
        markers[points[..., 3] < 0] = np.nan
    first = _long(layout, "TRIAL:ACTUAL_START_FIELD") or max(layout.header[2], 1)
    time = (first - 1 + np.arange(len(points))) / rate
    notes = _rate_notes(layout, rate)
    named = [labels[i] for i in columns]
    return to_recording(path, time, markers, named, unit=unit, notes=notes)


def _rate_notes(layout: C3dLayout, rate: float) -> list[str]:
    """Say what else in the file speaks against its frame rate (frames per s)."""
    notes = []
    if layout.rate > 0 and abs(layout.rate / rate - 1) > _SAME_RATE:
        notes.append(
            f"its header says {layout.rate:.4g} frames per second, POINT:RATE "
            f"{rate:.4g}, which counts."
        )
    cameras = layout.number("TRIAL:CAMERA_RATE", 0)
    if 0 < cameras * (1 + _SAME_RATE) < rate:
        notes.append(
            f"its cameras took {cameras:.4g} frames per second, fewer than the "
            f"{rate:.4g} of POINT:RATE, which count."
        )
    return notes


def _bare(label: str) -> str:
    """Return a label without the subject's prefix, which lists may leave out."""
    return label.rsplit(":", 1)[-1]


def _points(path: Path, layout: C3dLayout, rate: float) -> NDArray[np.float32]:
    """Return x, y, z and residual (negative: not seen), (T, points, 4), scaled."""
    n_points, n_analog, *_ = layout.header
    used = layout.number("POINT:USED", n_points) % (_WORD + 1)
    if used != n_points:
        raise FileError(
            f"{path}: expected as many points in the header of a C3D file as in "
            f"POINT:USED, found {n_points} and {used:g}."
        )
    channels = layout.number("ANALOG:USED", 0) % (_WORD + 1)
    analog_rate = layout.number("ANALOG:RATE", 0)
    if channels and analog_rate and abs(channels * analog_rate / rate - n_analog) > 0.5:
        raise FileError(
            f"{path}: expected {n_analog} analog samples per frame as the header of a "
            f"C3D file says, found {channels:g} channels at {analog_rate:g} Hz."
        )
    scale = layout.number("POINT:SCALE", layout.scale)
    if not math.isfinite(scale) or scale == 0 or (scale < 0) != (layout.scale < 0):
        raise FileError(
            f"{path}: expected the same kind of scale in the header of a C3D file as "
            f"in POINT:SCALE, found {layout.scale:g} and {scale:g}."
        )
    words = 4 * n_points + n_analog
    frame_bytes = words * (4 if scale < 0 else 2)
    available = layout.size - layout.data_start
    n_frames = _frame_count(layout)
    open_end = n_frames is None
    if n_frames is None:
        n_frames = max(available // frame_bytes, _WORD)
    if n_frames * frame_bytes > available:
        raise FileError(
            f"{path}: expected {n_frames} frames of {frame_bytes} bytes as its header "
            f"says, found {available // frame_bytes}, so the file is cut off."
        )
    with path.open("rb") as file:
        file.seek(layout.data_start)
        raw = file.read(n_frames * frame_bytes)
    if open_end:
        n_frames -= _padding(raw, frame_bytes, available)
        raw = raw[: n_frames * frame_bytes]
    if scale < 0:
        frames = floats(raw, layout.machine).reshape(n_frames, words)
        return frames[:, : 4 * n_points].reshape(n_frames, n_points, 4)
    integers = np.frombuffer(raw, ">i2" if layout.machine == 86 else "<i2")
    frames = integers.reshape(n_frames, words).astype(np.float32)
    return frames[:, : 4 * n_points].reshape(n_frames, n_points, 4) * np.float32(scale)


def _padding(raw: bytes, frame_bytes: int, available: int) -> int:
    """Return how many frames at the end are zeros that fill the last block of a file.

    They look like frames in which no one is seen. Where the frames fill their last
    block, ezc3d adds a whole one.
    """
    if available % BLOCK:
        return 0
    last = raw[len(raw) - BLOCK // frame_bytes * frame_bytes :]
    return (len(last) - len(last.rstrip(b"\0"))) // frame_bytes


def _frame_count(layout: C3dLayout) -> int | None:
    """Return the number of frames, also where it does not fit into 16 bits.

    Then Vicon writes first and last frame as pairs of words, others write a
    floating-point count, and some only the largest word: then all frames to the end of
    the file count, and the answer is None.
    """
    *_, first, last = layout.header
    count = layout.number("POINT:FRAMES", last - first + 1)
    if -_WORD <= count < 0:  # an unsigned word
        count += _WORD + 1
    if count == _WORD:
        start = _long(layout, "TRIAL:ACTUAL_START_FIELD")
        end = _long(layout, "TRIAL:ACTUAL_END_FIELD")
        if start and end - start + 1 >= _WORD:
            count = end - start + 1
        else:
            count = layout.number("POINT:LONG_FRAMES", 0)
            if not count:
                return None
    return int(count) if math.isfinite(count) and count > 0 else 0


def _long(layout: C3dLayout, name: str) -> int:
    """Return a 32-bit number kept as two words, low word first; 0 when missing."""
    value = layout.parameters.get(name)
    if not isinstance(value, np.ndarray) or len(value) != 2:
        return 0
    return int(value[0]) % (_WORD + 1) + (_WORD + 1) * (int(value[1]) % (_WORD + 1))
