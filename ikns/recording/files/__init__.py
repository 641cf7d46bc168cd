"""Marker files: C3D, TRC and Vicon CSV in, C3D out.

Millimeters, frame numbers and empty cells exist only here; everywhere else there are
meters, seconds and NaN.
"""

from __future__ import annotations

from pathlib import Path

from ikns.errors import FileError
from ikns.recording.files.c3d import read_c3d
from ikns.recording.files.c3d_write import write_c3d
from ikns.recording.files.trc import read_trc
from ikns.recording.files.vicon_csv import read_vicon_csv
from ikns.recording.recording import Recording

__all__ = ["read", "write_c3d"]

_READERS = {".c3d": read_c3d, ".trc": read_trc, ".csv": read_vicon_csv}


def read(path: str | Path) -> Recording:
    """Read a recording of markers.

    Labels stay as the file has them, subject prefixes such as ``ADL001:`` included.
    Points that are not markers (angles, forces, unnamed trajectories) are dropped.

    Parameters
    ----------
    path : str or Path
        A C3D file, a TRC file, or a Vicon Nexus CSV export; the ending decides.

    Returns
    -------
    Recording
        Times in seconds, frame 1 of a trial at 0 s unless the file states its own
        times; positions in meters, NaN where a marker was not seen.

    Raises
    ------
    FileError
        One sentence with the file, what was expected and what was found.

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
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise FileError(
            f"{path}: expected a marker file that ends in "
            f"{', '.join(_READERS)}, found {path.suffix or 'no ending'}."
        )
    return reader(path)
