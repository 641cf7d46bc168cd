"""Writer of C3D files; a file is written completely or not at all."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ikns.errors import FileError, InvalidInput, plain
from ikns.output.file import sync
from ikns.recording.files.c3d_encode import encode_c3d
from ikns.recording.recording import Recording

#: Largest frame number in two 16-bit words.
_LAST_FRAME = 2**31 - 1

#: Labels are padded to the longest one; this many of this length still fit into the
#: 255 blocks of 512 bytes that the parameters of a C3D file may take.
_LABEL_BYTES = 120
_MOST_POINTS = 1000

#: Millimeters per meter: C3D positions are in mm by convention.
_MM = 1e3
#: Single precision holds no larger position, m.
_FARTHEST = float(np.finfo(np.float32).max) / _MM


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
    >>> from ikns.recording.files import read
    >>> recording = Recording([0.0, 0.01], [[[0.1, 0.2, 0.3]]] * 2, ["RSHO"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "shoulder.c3d"
    ...     write_c3d(path, recording)
    ...     read(path).labels
    ('RSHO',)
    """
    path = Path(path)
    if path.suffix.lower() != ".c3d":
        raise FileError(f"{path}: expected a name that ends in .c3d.")
    if not path.parent.is_dir():
        raise FileError(f"{path}: the folder {path.parent} does not exist.")
    if path.is_dir():
        raise FileError(f"{path}: expected a file name, found a folder.")
    if path.exists() and not force:
        raise FileError(f"{path}: the file exists already and was left as it is.")
    _check_labels(recording)
    _check_positions(recording)
    first, rate = frame_numbers(recording)
    content = encode_c3d(
        recording.markers * _MM, recording.labels, first=first, rate=rate
    )
    try:
        # A temporary folder next to the target is on the same disk, so the move is
        # atomic, and it is removed in any case.
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".ikns-") as folder:
            draft = Path(folder) / "draft.c3d"
            draft.write_bytes(content)
            sync(draft)
            draft.replace(path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {plain(error)}.") from None


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


def _check_positions(recording: Recording) -> None:
    far = np.abs(recording.markers[~np.isnan(recording.markers)]).max(initial=0.0)
    if far >= _FARTHEST:
        raise InvalidInput(
            f"{recording.source}: expected positions within {_FARTHEST:.2g} m, as "
            f"single precision holds them, found {far:g} m."
        )


def frame_numbers(recording: Recording) -> tuple[int, float]:
    """Return the number of the first frame, 1 at 0 s, and the frames per second."""
    time, rate = recording.time, recording.rate
    if len(time) < 2:
        raise InvalidInput(
            f"{recording.source}: the recording has {len(time)} frame; at least 2 are "
            "needed, as the file states a frame rate."
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
