"""The compiled solver: a skeleton handed over to the kernel as plain arrays."""

from __future__ import annotations

import threading

import numpy as np

from ikns._kernels.body.frame_sequence import FrameMemory, new_memory, solve_frames
from ikns._kernels.body.marker_problem import MarkerProblem, pack, scratch_size
from ikns._kernels.body.tree import Tree
from ikns.arrays import Array, Indices
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.gate import GateLimits, marker_gate
from ikns.motion.marker_ik.pose import (
    LIMIT,
    LOST,
    MAX_ITERATIONS,
    PRIOR,
    PRIOR_FROM_SCRATCH,
    STEP_TOLERANCE,
    SolvedFrames,
    starting_poses,
)
from ikns.motion.marker_ik.turns import turning_clusters


def marker_problem(
    skeleton: Skeleton, *, max_iterations: int, tolerance: float
) -> MarkerProblem:
    """Arrange a skeleton, its marker set and the weights of the cost for the kernel."""
    worn = skeleton.marker_set.markers
    joint, position = skeleton.tree_markers
    weight = [0.0 if marker.static_only else marker.weight for marker in worn]
    held = skeleton.columns(skeleton.marker_set.held)
    free = np.ones(skeleton.nv)
    free[np.isin(np.arange(skeleton.nv), held)] = 0.0
    path, depth = tree_paths(skeleton.tree)
    n_joints = len(skeleton.joint_names)
    angle = np.full(skeleton.nv, -1, dtype=np.int64)
    starts = starting_poses(skeleton)
    angle[-n_joints:] = np.arange(starts.shape[1] - n_joints, starts.shape[1])
    lower, upper = np.full(skeleton.nv, -np.inf), np.full(skeleton.nv, np.inf)
    lower[-n_joints:], upper[-n_joints:] = skeleton.lower, skeleton.upper
    q_branch = np.full(starts.shape[1], -1, dtype=np.int64)
    q_branch[-n_joints:] = [_side(name) for name in skeleton.joint_names]
    turn_joint, turn = turning_clusters(skeleton)
    return MarkerProblem(
        tree=skeleton.tree,
        marker_joint=joint,
        marker_carrier=np.where(turn >= 0, skeleton.tree.parent[joint], joint),
        marker_turn=turn,
        turn_joint=turn_joint,
        marker_position=position,
        marker_weight=np.array(weight, dtype=np.float64),
        path=path,
        depth=depth,
        free=free,
        angle=angle,
        lower=lower,
        upper=upper,
        starts=starts,
        marker_branch=np.array([_side(m.link) for m in worn], dtype=np.int64),
        q_branch=q_branch,
        n_branches=len(SIDES),
        pull=PRIOR,
        pull_from_scratch=PRIOR_FROM_SCRATCH,
        limit=LIMIT,
        tolerance=tolerance,
        lost=LOST,
        max_iterations=max_iterations,
    )


class KernelSolver:
    """Solve frames for one skeleton; the arguments are those of `MarkerIK`."""

    def __init__(
        self,
        skeleton: Skeleton,
        *,
        max_iterations: int = MAX_ITERATIONS,
        tolerance: float = STEP_TOLERANCE,
        limits: GateLimits | None = None,
    ) -> None:
        self.gate = marker_gate(skeleton, limits)
        self.problem = marker_problem(
            skeleton, max_iterations=max_iterations, tolerance=tolerance
        )
        self.packed = pack(self.problem)
        self._neutral = skeleton.neutral()
        self._of_thread = threading.local()

    @property
    def work(self) -> Array:
        """Scratch memory, one array for each thread."""
        if not hasattr(self._of_thread, "work"):
            self._of_thread.work = np.empty(scratch_size(self.problem))
        work: Array = self._of_thread.work
        return work

    def new_memory(self) -> FrameMemory:
        """Return the memory before a first frame, for frames one after the other."""
        return new_memory(len(self._neutral), len(SIDES))

    def solve(
        self,
        markers: Array,
        span: tuple[int, int, int],
        before: Array | None,
        frames: SolvedFrames,
        *,
        patience: int = 0,
        memory: FrameMemory | None = None,
    ) -> None:
        """Solve the frames of ``range(*span)``; the step is 1 or -1.

        Markers are (T, M, 3), NaN where not seen. The first frame starts from the pose
        before, or from scratch; others from the one next to them, or the last that fit
        within so many frames of `patience`. Iterations of -1 stand for an infinite
        marker, an infinite residual for a pose before that is not finite.
        """
        scratch = before is None
        start = self._neutral if before is None else before
        known = self.new_memory() if memory is None else memory
        solve_frames(
            *self.packed,
            self.gate,
            _writable(markers),
            *span,
            _writable(start),
            scratch,
            patience,
            known,
            self.work,
            *frames,
        )


def _writable(array: Array) -> Array:
    """Return an array for which the kernel is compiled: it is again for others."""
    return array if array.flags.writeable else array.copy()


def tree_paths(tree: Tree) -> tuple[Indices, Indices]:
    """Each degree of freedom's way from the root; see the kernels' `tree_cholesky`."""
    ways: list[list[int]] = []
    for d, parent in enumerate(tree.dof_parent.tolist()):
        ways.append([*(ways[parent] if parent >= 0 else []), d])
    depth = np.array([len(way) - 1 for way in ways], dtype=np.int64)
    path = np.full((len(ways), depth.max() + 1), -1, dtype=np.int64)
    for row, way in zip(path, ways, strict=True):
        row[: len(way)] = way
    return path, depth


def _side(name: str) -> int:
    for k, side in enumerate(SIDES):
        if name.startswith(side):
            return k
    return -1
