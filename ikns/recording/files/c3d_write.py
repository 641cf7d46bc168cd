"""Writer of C3D files; a file is written completely or not at all."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ikns.errors import FileError, InvalidInput
from ikns.output.file import sync
from ikns.recording.files.c3d_layout import read_layout
from ikns.recording.recording import Recording

#: Largest 16-bit word; the largest frame number in two of them.
_WORD = 0xFFFF
_LAST_FRAME = 2**31 - 1

#: Labels are padded to the longest one; this many of this length still fit into the
#: 255 blocks of 512 bytes that the parameters of a C3D file may take.
_LABEL_BYTES = 120
_MOST_POINTS = 1000

#: Millimeters per meter: C3D positions are in mm by convention.
_MM = 1e3


def write_c3d(path: str | Path, recording: Recording, *, force: bool = False) -> None:
    """Write a recording as a C3D file with positions in mm.

    Positions are stored in single precision. Times become frame numbers, frame 1 at
    0 s. A marker that was not seen is stored as a point with negative residual; so is
    one at exactly (0, 0, 0), which C3D cannot distinguish from it.

    Parameters
    ----------
    path : str or Path
        Must end in ``.c3d``.
    recording : Recording
        At least two frames at a constant rate.
    force : bool
        Whether to replace a file that exists. It is replaced once the new one is
        complete, so an interruption loses neither.

    Raises
    ------
    FileError
        When the file exists already, or cannot be written.
    InvalidInput
        When C3D cannot hold the recording.

    Examples
    --------
    >>> recording = Recording([0.0, 0.01], [[[0.1, 0.2, 0.3]]] * 2, ["RSHO"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "shoulder.c3d"
    ...     write_c3d(path, recording)
    ...     read_layout(path).texts("POINT:LABELS")
    ['RSHO']
    """
    path = Path(path)
    if path.suffix.lower() != ".c3d":
        raise FileError(f"{path}: expected a name that ends in .c3d.")
    if not path.parent.is_dir():
        raise FileError(f"{path}: expected a folder to write into, found none there.")
    if path.is_dir():
        raise FileError(f"{path}: expected a file name, found a folder.")
    if path.exists() and not force:
        raise FileError(f"{path}: the file exists already and was left as it is.")
    _check_labels(recording)
    first, rate = frame_numbers(recording)
    try:
        # A temporary folder next to the target is on the same disk, so the move is
        # atomic, and it is removed in any case.
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".ikns-") as folder:
            draft = Path(folder) / "draft.c3d"
            _write(draft, recording, first, rate)
            _check_complete(draft, recording)
            sync(draft)
            draft.replace(path)
    except (OSError, RuntimeError, ValueError, TypeError) as error:
        raise FileError(f"{path}: the file cannot be written ({error}).") from None


def _check_labels(recording: Recording) -> None:
    for label in recording.labels:
        if not label or label != label.strip() or len(label.encode()) > _LABEL_BYTES:
            raise InvalidInput(
                f"{recording.source}: expected marker labels of 1 to {_LABEL_BYTES} "
                f"bytes without blanks at their ends, found '{label}'."
            )
    if not 1 <= len(recording.labels) <= _MOST_POINTS:
        raise InvalidInput(
            f"{recording.source}: expected 1 to {_MOST_POINTS} markers for a C3D file, "
            f"found {len(recording.labels)}."
        )


def frame_numbers(recording: Recording) -> tuple[int, float]:
    """Return the number of the first frame, 1 at 0 s, and the frames per second."""
    time, rate = recording.time, recording.rate
    if len(time) < 2:
        raise InvalidInput(
            f"{recording.source}: expected at least 2 frames to know the frame rate "
            f"that the file states, found {len(time)}."
        )
    counted = (time - time[0]) * rate
    # A lost frame is a long step, a drifting clock a growing difference.
    lost = np.abs(np.diff(counted) - 1).max()
    drift = np.abs(counted - np.arange(len(time))).max()
    if max(lost, drift) >= 0.5:
        raise InvalidInput(
            f"{recording.source}: expected a constant frame rate, as frame numbers "
            f"need, found times up to {max(lost, drift):.1f} frames off; resample it."
        )
    first = round(float(time[0]) * rate) + 1
    if not 1 <= first <= _LAST_FRAME - len(time):
        raise InvalidInput(
            f"{recording.source}: expected to start between 0 and "
            f"{_LAST_FRAME / rate:.0f} s, as frame numbers say, found {time[0]:g} s."
        )
    return first, rate


def _write(path: Path, recording: Recording, first: int, rate: float) -> None:
    import ezc3d  # compiled; loaded only where it is used

    file = ezc3d.c3d()
    file["header"]["points"]["first_frame"] = min(first, _WORD) - 1
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = np.array([rate])
    point["LABELS"]["value"] = list(recording.labels)
    point["DESCRIPTIONS"]["value"] = [""] * len(recording.labels)
    point["UNITS"]["value"] = ["mm"]
    last = first + len(recording.time) - 1
    file["parameters"]["TRIAL"] = {
        "__METADATA__": {"DESCRIPTION": "", "IS_LOCKED": False},
        "ACTUAL_START_FIELD": _long(first),
        "ACTUAL_END_FIELD": _long(last),
    }
    positions = recording.markers.transpose(2, 1, 0) * _MM
    seen = ~np.isnan(positions).any(axis=0)
    file["data"]["points"] = np.where(seen, positions, 0.0)
    file["data"]["meta_points"]["residuals"] = np.where(seen, 0.0, -1.0)[None]
    file.write(str(path))


def _check_complete(path: Path, recording: Recording) -> None:
    """Refuse a truncated file: the library does not report a full disk."""
    layout = read_layout(path)
    n_frames, n_markers, _ = recording.markers.shape
    if layout.size < layout.data_start + 16 * n_frames * n_markers:
        raise OSError(f"only {layout.size} bytes of it could be stored")


def _long(number: int) -> dict[str, object]:
    """Return a 32-bit number as the two words, low word first, that Vicon writes."""
    return {
        "type": 2,
        "description": "",
        "is_locked": False,
        "value": np.array([number % (_WORD + 1), number // (_WORD + 1)]),
    }
