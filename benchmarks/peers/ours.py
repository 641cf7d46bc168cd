"""The package's own solvers through its public door."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import ikns
from ikns import MarkerIK
from ikns._kernels.body.frame_sequence import pack_frames
from ikns.motion.marker_ik.pose import PRIOR_FROM_SCRATCH
from peers.problem import Problem
from peers.timing import FrameByFrame

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from marker_ik_oracle import PlainMarkerIK


class Live(FrameByFrame):
    """One frame a call.

    Parameters
    ----------
    problem : Problem
    **options
        Those of `MarkerIK`.
    """

    version = ikns.__version__
    solver_class: type = MarkerIK

    def __init__(self, problem: Problem, **options: object) -> None:
        self.solver = self.solver_class(problem.skeleton, **options)
        self.skeleton = problem.skeleton
        solve = self.solver.solve
        super().__init__(
            lambda seen, before: solve(seen, before).q, problem.markers, problem.start
        )

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        return self.skeleton.markers_in_world(q)

    def call_seconds(self) -> float:
        """Seconds of a call that has nothing to solve."""
        nothing, q = np.full_like(self.markers[0], np.nan), self.start
        solve, clock, spent = self.solve, time.thread_time_ns, []
        for _ in range(1000):
            begun = clock()
            solve(nothing, q)
            spent.append(clock() - begun)
        return 1e-9 * float(np.median(spent))


class Plain(Live):
    """The plain solver that tests check the kernel against."""

    solver_class = PlainMarkerIK


class WithoutPull(Live):
    """The kernel with the cost that OpenSim has: marker distances and nothing else.

    What is left of the pull to the pose before settles what no marker shows. Joints
    that markers barely show then need many steps.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, max_iterations=1000)
        kernel = self.solver.solver
        kernel.problem = kernel.problem._replace(pull=PRIOR_FROM_SCRATCH, limit=0.0)
        kernel.packed = pack_frames(kernel.problem, kernel.gate)


class Batch:
    """A whole recording a call, hands and velocities included."""

    version = ikns.__version__

    def __init__(self, problem: Problem) -> None:
        self.solver, self.recording = MarkerIK(problem.skeleton), problem.recording

    def run(self):
        """Solve the recording; configurations, and seconds of the average frame."""
        begun = time.thread_time_ns()
        motion = self.solver.track(self.recording)
        spent = time.thread_time_ns() - begun
        return motion.q, 1e-9 * spent / len(motion.q)
