"""Which files a motion can be written to; to ask that loads no body."""

from __future__ import annotations

from pathlib import Path

from ikns.output.file import check_ending
from ikns.recording.files.storage import STORAGE

#: Endings of files with the markers of the fitted body.
FITTED = (".trc", ".c3d")

#: Ending of a model of OpenSim: the body alone.
MODEL = ".osim"

#: Endings that :func:`ikns.motion.export.write_motion` knows.
MOTION_FILES = (".csv", *STORAGE, *FITTED, MODEL)


def check_motion_file(path: Path) -> None:
    """Refuse a name whose ending is not of :data:`MOTION_FILES`."""
    check_ending(path, MOTION_FILES)
