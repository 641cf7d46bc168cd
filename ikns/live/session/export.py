"""Export a run for other programs: CSV, MAT and C3D."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from ikns.live.session.reader import Run
from ikns.output.file import refuse_overwriting, write_bytes, write_text
from ikns.recording.files import write_c3d
from ikns.recording.recording import Recording

FORMATS = ("csv", "mat", "c3d")


def check_export(path: Path, session: Path, *, force: bool) -> None:
    """Check, before any work, that a run of a session may be exported to a file.

    Raises
    ------
    InvalidInput
        When the extension is not that of a format, or the file may not be written; see
        :func:`ikns.output.file.refuse_overwriting`.
    """
    endings = [f".{name}" for name in FORMATS]
    refuse_overwriting(path, force=force, inputs=[session], endings=endings)


def export_run(run: Run, path: str | Path, *, force: bool = False) -> None:
    """Write a run into one file, whose format follows from its extension.

    ``.csv`` has one row per frame and one column per channel; ``.mat`` the same columns
    as variables, with ``markers`` (T, M, 3) in meters and ``labels``; ``.c3d`` only the
    markers.

    Parameters
    ----------
    run : Run
    path : str or Path
    force : bool
        Whether to replace an existing file.

    Raises
    ------
    InvalidInput
        See :func:`check_export`; or when the run has too few frames for a C3D file.
    """
    target = Path(path)
    check_export(target, run.session, force=force)
    kind = target.suffix.lower().removeprefix(".")
    timing = {
        "frame": run.frame,
        "device_time": run.device_time,
        "receive_time": run.receive_time,
    }
    if kind == "mat":
        from scipy.io import savemat  # slow to load

        table = io.BytesIO()
        savemat(
            table,
            {
                **timing,
                **run.model,
                "markers": run.markers,
                "labels": np.array(run.labels, dtype=object),
                "rate": run.rate,
            },
            oned_as="column",
        )
        write_bytes(target, table.getvalue(), force=force)
    elif kind == "c3d":
        # Dropped frames are missing in this file: C3D has a rate but no times.
        time = np.arange(len(run.frame)) / run.rate
        recording = Recording(time, run.markers, run.labels, str(run.session))
        write_c3d(target, recording, force=force)
    else:
        names = [f"{label}_{axis}" for label in run.labels for axis in "xyz"]
        markers = dict(
            zip(names, run.markers.reshape(len(run.frame), -1).T, strict=True)
        )
        columns = timing | markers | run.model
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*(c.tolist() for c in columns.values()), strict=True):
            writer.writerow(["" if value != value else value for value in row])
        write_text(target, text.getvalue(), force=force)
