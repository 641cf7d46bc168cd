"""One simulated person: calibrated, and a recording to play, kept in a folder."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

__all__ = ["load", "make", "piece", "retimed"]


def make(folder: Path, seed: int, *, point_seconds: float = 2.0) -> None:
    """Simulate ten points at 100 Hz, noise and occlusion included, and calibrate."""
    protocol = simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=point_seconds,
    )
    points = protocol.points.recording
    calibrate(protocol.static.recording, [points]).save(folder / "person")
    np.savez(folder / "points.npz", time=points.time, markers=points.markers)
    (folder / "labels.txt").write_text("\n".join(points.labels), encoding="utf-8")


@cache
def load(folder: Path) -> tuple[Subject, Recording]:
    """Read what :func:`make` wrote."""
    labels = (folder / "labels.txt").read_text(encoding="utf-8").split("\n")
    with np.load(folder / "points.npz") as kept:
        recording = Recording(kept["time"], kept["markers"], labels, "simulated")
    return Subject.load(folder / "person"), recording


def retimed(recording: Recording, rate: float) -> Recording:
    """Markers at another rate, on straight lines between frames."""
    time, markers = recording.time, recording.markers
    at = np.arange(time[0], time[-1], 1 / rate)
    columns = markers.reshape(len(time), -1).T
    between = np.stack([np.interp(at, time, column) for column in columns], axis=1)
    return Recording(at, between.reshape(len(at), -1, 3), recording.labels, "simulated")


def piece(recording: Recording, start: int) -> Recording:
    """Take the recording from a frame on, gaps filled: one fault at a time."""
    time, markers = recording.time, recording.markers
    columns = markers.reshape(len(time), -1).T.copy()
    for column in columns:
        seen = np.isfinite(column)
        column[~seen] = np.interp(time[~seen], time[seen], column[seen])
    filled = columns.T.reshape(markers.shape)[start:]
    return Recording(time[start:] - time[start], filled, recording.labels, "simulated")
