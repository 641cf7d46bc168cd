"""Marker files in and out.

Millimeters, frame numbers and empty cells exist only here; everywhere else there are
meters, seconds and NaN.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from pathlib import Path

from ikns.errors import FileError, RecordingWarning
from ikns.recording.files.c3d import read_c3d
from ikns.recording.files.c3d_write import write_c3d
from ikns.recording.files.conversion import existing_file, refuse_folder
from ikns.recording.files.file_events import event_time
from ikns.recording.files.marker_csv import read_marker_csv
from ikns.recording.files.qualisys_tsv import read_qualisys_tsv
from ikns.recording.files.trc import read_trc
from ikns.recording.files.trc_write import write_nexus_csv, write_trc
from ikns.recording.files.xdf import read_xdf
from ikns.recording.part import between, one_subject
from ikns.recording.recording import Recording

__all__ = ["read", "write", "write_c3d"]

_READERS: dict[str, Callable[[Path], Recording]] = {
    ".c3d": read_c3d,
    ".trc": read_trc,
    ".csv": read_marker_csv,
    ".tsv": read_qualisys_tsv,
    ".xdf": read_xdf,
}
_WRITERS = {".c3d": write_c3d, ".trc": write_trc, ".csv": write_nexus_csv}

#: Endings of the files that :func:`read` reads, and :func:`write` writes.
READABLE, WRITABLE = tuple(_READERS), tuple(_WRITERS)


def read(
    path: str | Path,
    *,
    subject_prefix: str | None = None,
    start: float | str | None = None,
    end: float | str | None = None,
    stream: str | None = None,
) -> Recording:
    """Read a recording of markers.

    Labels stay as the file has them, subject prefixes such as ``ADL001:`` included.
    Points that are not markers (angles, forces, unnamed trajectories) are dropped.
    Markers of one name are numbered, ``RKNE #1`` and ``RKNE #2``.

    Parameters
    ----------
    path : str or Path
        The extension decides: C3D; TRC; a CSV export of Vicon Nexus, Vicon Workstation
        or OptiTrack Motive; a TSV export of Qualisys; or XDF, a recording of LSL
        streams, which needs the extra ``xdf``.
    subject_prefix : str, optional
        Keep only the markers of this subject, ``Ann`` of ``Ann:RSHO``, and remove the
        prefix.
    start, end : float or str, optional
        Keep the frames between these moments: seconds, or events of a C3D file by
        name.
    stream : str, optional
        Name of the stream to read from an XDF file that has several with markers.

    Returns
    -------
    Recording
        Times in seconds, frame 1 of a trial at 0 s unless the file states its own
        times; positions in meters, NaN where a marker was not seen. Its notes say what
        was repaired.

    Raises
    ------
    FileError
        One sentence with the file, what was expected and what was found.
    MarkerMismatch
        When there is no marker of the subject.
    InvalidInput
        When there is no frame between `start` and `end`.

    Warns
    -----
    RecordingWarning
        For every note.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> place, unseen = [[0.1, 0.2, 0.3]], [[float("nan")] * 3]
    >>> recording = Recording([0.0, 0.01], [place, unseen], ["RSHO"])
    >>> with TemporaryDirectory() as folder:
    ...     write_c3d(f"{folder}/shoulder.c3d", recording)
    ...     found = read(f"{folder}/shoulder.c3d")
    >>> found.labels, found.markers.round(6).tolist()
    (('RSHO',), [[[0.1, 0.2, 0.3]], [[nan, nan, nan]]])
    """
    path = Path(path)
    reader = _reader(path)
    if stream is None:
        recording = reader(path)
    elif reader is read_xdf:
        recording = read_xdf(path, stream)
    else:
        raise FileError(f"{path}: only XDF files have streams, found {path.suffix}.")
    if subject_prefix is not None:
        recording = one_subject(recording, subject_prefix)
    if start is not None or end is not None:
        recording = between(recording, _moment(path, start), _moment(path, end))
    for note in recording.notes:
        warnings.warn(RecordingWarning(path, note), stacklevel=2)
    return recording


def check_marker_file(path: str | Path) -> None:
    """Refuse what is no file of markers by its name, or not there.

    Raises
    ------
    FileError
        As :func:`read` does.
    """
    _reader(Path(path))
    existing_file(Path(path))


def _reader(path: Path) -> Callable[[Path], Recording]:
    reader = _READERS.get(path.suffix.lower())
    refuse_folder(path)
    if reader is None:
        raise FileError(
            f"{path}: expected a marker file that ends in "
            f"{', '.join(_READERS)}, found {path.suffix or 'no ending'}."
        )
    return reader


def write(path: str | Path, recording: Recording, *, force: bool = False) -> None:
    """Write a recording of markers, in mm.

    Parameters
    ----------
    path : str or Path
        The extension decides: C3D, TRC, or CSV in the format of Vicon Nexus.
    recording : Recording
        At least two frames at a constant rate.
    force : bool
        Whether to replace a file that exists.

    Raises
    ------
    FileError
        When the extension is not supported, or the file cannot be written.
    InvalidInput
        When such a file cannot hold the recording.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> recording = Recording([0.0, 0.01], [[[0.1, 0.2, 0.3]]] * 2, ["RSHO"])
    >>> with TemporaryDirectory() as folder:
    ...     write(f"{folder}/shoulder.trc", recording)
    ...     read(f"{folder}/shoulder.trc").markers[0].round(6).tolist()
    [[0.1, 0.2, 0.3]]
    """
    path = Path(path)
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise FileError(
            f"{path}: expected a name that ends in {', '.join(_WRITERS)}, found "
            f"{path.suffix or 'no ending'}."
        )
    writer(path, recording, force=force)


def _moment(path: Path, said: float | str | None) -> float | None:
    """Return a moment in seconds, of a number or the name of an event."""
    if said is None:
        return None
    try:
        seconds = float(said)
    except ValueError:
        return event_time(path, str(said))
    if not math.isfinite(seconds):
        raise FileError(f"{path}: expected a finite number of seconds, found {said}.")
    return seconds
