"""Export a run for other programs: CSV, MAT and C3D."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.io import savemat

from ikns.errors import InvalidInput
from ikns.live.session.reader import Run
from ikns.recording.files import write_c3d
from ikns.recording.recording import Recording

__all__ = ["FORMATS", "export_run"]

FORMATS = ("csv", "mat", "c3d")


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
        When the extension is another one, the file exists, or the run has too few
        frames for a C3D file.
    """
    target = Path(path)
    kind = target.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InvalidInput(
            f"{target}: expected a name that ends in .csv, .mat or .c3d."
        )
    if target.exists() and not force:
        raise InvalidInput(f"{target}: exists already; use --force to overwrite it.")
    timing = {
        "frame": run.frame,
        "device_time": run.device_time,
        "receive_time": run.receive_time,
    }
    if kind == "mat":
        savemat(
            target,
            {
                **timing,
                **run.model,
                "markers": run.markers,
                "labels": np.array(run.labels, dtype=object),
                "rate": run.rate,
            },
            oned_as="column",
        )
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
        with target.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            for row in zip(*(c.tolist() for c in columns.values()), strict=True):
                writer.writerow(["" if value != value else value for value in row])
