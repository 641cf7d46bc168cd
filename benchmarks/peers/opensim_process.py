"""OpenSim's InverseKinematicsSolver in a process of its own.

Its libraries clash with those of other packages when both are in one process. Run as a
script this file is the other end of the pipe and imports OpenSim and NumPy only.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from pathlib import Path

import numpy as np


class OpenSim:
    """The end of the pipe that asks."""

    def __init__(self, problem) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).resolve())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        version = self._ask("build", problem.plain())
        if version is None:
            self.close()
            raise ImportError("opensim")
        self.version = version

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        from peers.problem import coordinates

        return self._ask("markers_at", coordinates(q))

    def begin(self) -> None:
        """Go to the start."""
        self._ask("begin")

    def run(self, first: int, last: int):
        """Solve frames; configurations, and seconds of each."""
        from peers.problem import from_coordinates

        x, seconds = self._ask("run", first, last)
        return from_coordinates(x), seconds

    def call_seconds(self) -> float:
        """Seconds of a call that does next to nothing."""
        return self._ask("call_seconds")

    def close(self) -> None:
        """End the other process."""
        self.process.stdin.close()
        self.process.wait()

    def _ask(self, *question):
        pickle.dump(question, self.process.stdin)
        self.process.stdin.flush()
        answer = pickle.load(self.process.stdout)
        if isinstance(answer, Exception):
            raise answer
        return answer


class _Worker:
    """The end that answers: the model through OpenSim's own interface."""

    def build(self, body) -> str | None:
        try:
            import opensim
        except ImportError:
            return None
        opensim.Logger.setLevelString("Off")
        self.opensim, self.body = opensim, body
        self.model = _model(opensim, body)
        table = opensim.TimeSeriesTableVec3()
        table.setColumnLabels(body["labels"])
        for i, frame in enumerate(body["markers"]):
            row = opensim.RowVectorVec3([opensim.Vec3(*place) for place in frame])
            table.appendRow(i / body["rate"], row)
        weights = opensim.SetMarkerWeights()
        for label in body["labels"]:
            weights.cloneAndAppend(opensim.MarkerWeight(label, 1.0))
        self.reference = opensim.MarkersReference(table, weights)
        self.coordinates = [
            self.model.getCoordinateSet().get(i)
            for i in range(self.model.getNumCoordinates())
        ]
        self.begin()
        return opensim.GetVersion()

    def begin(self) -> None:
        opensim, body = self.opensim, self.body
        self.state = self.model.initSystem()
        self.solver = opensim.InverseKinematicsSolver(
            self.model,
            self.reference,
            opensim.SimTKArrayCoordinateReference(),
            float("inf"),
        )
        self.solver.setAccuracy(body["accuracy"])
        self._set(body["start"])
        self.state.setTime(0.0)
        self.solver.assemble(self.state)
        self._set(body["start"])

    def markers_at(self, x):
        self._set(x)
        self.model.realizePosition(self.state)
        places = self.model.getMarkerSet()
        return np.array(
            [
                places.get(label).getLocationInGround(self.state).to_numpy()
                for label in self.body["labels"]
            ]
        )

    def run(self, first: int, last: int):
        state, track, clock = self.state, self.solver.track, time.thread_time_ns
        x = np.empty((last - first, len(self.coordinates)))
        spent = np.empty(last - first)
        for i in range(first, last):
            state.setTime(i / self.body["rate"])
            begun = clock()
            track(state)
            spent[i - first] = clock() - begun
            x[i - first] = [c.getValue(state) for c in self.coordinates]
        return x, 1e-9 * spent

    def call_seconds(self) -> float:
        clock, call = time.thread_time_ns, self.solver.setAccuracy
        spent = []
        for _ in range(1000):
            begun = clock()
            call(self.body["accuracy"])
            spent.append(clock() - begun)
        return 1e-9 * float(np.median(spent))

    def _set(self, x) -> None:
        for coordinate, value in zip(self.coordinates, x, strict=True):
            coordinate.setValue(self.state, float(value), False)


def _model(opensim, body):
    """Build a free joint and pins, offset frames turned so that every axis is z."""
    model = opensim.Model()
    model.setName("body")
    carriers = []
    for i, parent in enumerate(body["parent"]):
        # Inertia plays no part in inverse kinematics but must not be zero.
        link = opensim.Body(f"body_{i}", 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
        model.addBody(link)
        if parent < 0:
            joint = opensim.FreeJoint("root", model.getGround(), link)
        else:
            joint = opensim.PinJoint(
                f"joint_{i}",
                carriers[parent],
                opensim.Vec3(*body["translation"][i]),
                opensim.Vec3(*_angles(body["rotation"][i])),
                link,
                opensim.Vec3(0),
                opensim.Vec3(0),
            )
        model.addJoint(joint)
        carriers.append(link)
    for label, joint, place in zip(
        body["labels"], body["marker_joint"], body["marker_place"], strict=True
    ):
        model.addMarker(opensim.Marker(label, carriers[joint], opensim.Vec3(*place)))
    model.finalizeConnections()
    return model


def _angles(R):
    """Angles of turns about x, y, z, each in the frame turned so far, rad."""
    cosine = np.hypot(R[0, 0], R[0, 1])
    y = np.arctan2(R[0, 2], cosine)
    if cosine < 1e-9:  # x and z turn about one line: x does it all
        return np.arctan2(R[2, 1], R[1, 1]), y, 0.0
    return np.arctan2(-R[1, 2], R[2, 2]), y, np.arctan2(-R[0, 1], R[0, 0])


def _serve() -> None:
    # What libraries print must not end up in the pipe.
    pipe = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    worker = _Worker()
    while True:
        try:
            verb, *arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = getattr(worker, verb)(*arguments)
        except Exception as error:
            answer = RuntimeError(f"{type(error).__name__}: {error}")
        pickle.dump(answer, pipe)
        pipe.flush()


if __name__ == "__main__":
    _serve()
