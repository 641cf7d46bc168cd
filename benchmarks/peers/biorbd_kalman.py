"""biorbd's extended Kalman filter: the body written as a .bioMod file."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import biorbd
import numpy as np

from peers.problem import RATE, Problem, coordinates, from_coordinates


class Biorbd:
    """State: angles, velocities and accelerations, 72 numbers.

    Parameters
    ----------
    problem : Problem
    noise : float, optional
        Its noise factor; its own default is 1e-10.
    """

    version = biorbd.__version__

    def __init__(self, problem: Problem, *, noise: float | None = None) -> None:
        self.settings = (RATE,) if noise is None else (RATE, noise)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "body.bioMod"
            path.write_text(_text(problem.plain()), encoding="utf-8")
            self.model = biorbd.Model(str(path))
        self.problem = problem
        # The filter takes a hidden marker as NaN.
        self.frames = [
            [biorbd.NodeSegment(*map(float, place)) for place in frame]
            for frame in problem.markers
        ]
        self.begin()

    def begin(self) -> None:
        """Go to the start."""
        self.filter = biorbd.KalmanReconsMarkers(
            self.model, biorbd.KalmanParam(*self.settings)
        )
        n = self.model.nbQ()
        self.q = biorbd.GeneralizedCoordinates(_order(self.problem.start))
        self.v = biorbd.GeneralizedVelocity(np.zeros(n))
        self.a = biorbd.GeneralizedAcceleration(np.zeros(n))
        self.filter.setInitState(self.q, self.v, self.a)
        # The first call of all goes over its frame a hundred times to find a start.
        self.filter.reconstructFrame(self.model, self.frames[0], self.q, self.v, self.a)

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        at = biorbd.GeneralizedCoordinates(_order(q))
        return np.array([marker.to_array() for marker in self.model.markers(at)])

    def run(self, first: int, last: int):
        """Solve frames; configurations, and seconds of each."""
        solve, clock = self.filter.reconstructFrame, time.thread_time_ns
        x, spent = np.empty((last - first, self.model.nbQ())), np.empty(last - first)
        for i in range(first, last):
            frame = self.frames[i]
            begun = clock()
            solve(self.model, frame, self.q, self.v, self.a)
            spent[i - first] = clock() - begun
            x[i - first] = self.q.to_array()
        x[:, :6] = np.roll(x[:, :6], 3, axis=1)
        return from_coordinates(x), 1e-9 * spent


def _order(q):
    """Coordinates with the trunk's place first, as biorbd has them."""
    x = coordinates(q)
    x[:6] = np.roll(x[:6], 3)
    return x


def _text(body) -> str:
    lines = ["version 4"]
    for i, parent in enumerate(body["parent"]):
        lines += [f"segment body_{i}"]
        if parent >= 0:
            lines += [f"  parent body_{parent}"]
        lines += ["  rtinmatrix 1", "  rt"]
        rows = np.column_stack([body["rotation"][i], body["translation"][i]])
        lines += ["    " + " ".join(map(repr, map(float, row))) for row in rows]
        lines += ["    0 0 0 1"]
        lines += ["  translations xyz"] if parent < 0 else []
        lines += ["  rotations xyz" if parent < 0 else "  rotations z"]
        lines += ["  mass 1", "  inertia 1 0 0 0 1 0 0 0 1", "endsegment"]
    for label, joint, place in zip(
        body["labels"], body["marker_joint"], body["marker_place"], strict=True
    ):
        lines += [f"marker {label}", f"  parent body_{joint}"]
        lines += ["  position " + " ".join(map(repr, map(float, place)))]
        lines += ["  technical 1", "endmarker"]
    return "\n".join(lines) + "\n"
