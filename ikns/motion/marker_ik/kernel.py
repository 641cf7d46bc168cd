"""The compiled solver: a skeleton handed over to the kernel as plain arrays."""

from __future__ import annotations

import threading

import numpy as np

from ikns._kernels.body.frame_sequence import new_memory, pack_frames, solve_frames
from ikns._kernels.body.marker_problem import MarkerProblem, scratch_size
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
    Pose,
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
    n_joints = len(skeleton.joint_names)
    angle = np.full(skeleton.nv, -1, dtype=np.int64)
    starts = starting_poses(skeleton)
    angle[-n_joints:] = np.arange(starts.shape[1] - n_joints, starts.shape[1])
    lower, upper = np.full(skeleton.nv, -np.inf), np.full(skeleton.nv, np.inf)
    lower[-n_joints:], upper[-n_joints:] = skeleton.lower, skeleton.upper
    q_branch = np.full(starts.shape[1], -1, dtype=np.int64)
    q_branch[-n_joints:] = [_side(name) for name in skeleton.joint_names]
    turn_joint, turn = turning_clusters(skeleton)
    tree, at = limbs_in_turn(skeleton.tree)
    joint = at[joint]
    return MarkerProblem(
        tree=tree,
        marker_joint=joint,
        marker_carrier=np.where(turn >= 0, tree.parent[joint], joint),
        marker_turn=turn,
        turn_joint=at[turn_joint],
        marker_position=position,
        marker_weight=np.array(weight, dtype=np.float64),
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


def limbs_in_turn(tree: Tree) -> tuple[Tree, Indices]:
    """Return the tree by depth, the first joint of each limb, the second and so on.

    In a limb each joint waits for the one before; the processor works on the other limb
    meanwhile, if its joints come in between. Also returns where each joint is now.
    """
    depth = np.zeros(len(tree.parent), dtype=np.int64)
    for j, parent in enumerate(tree.parent):
        depth[j] = depth[parent] + 1 if parent >= 0 else 0
    order = np.argsort(depth, kind="stable")
    at = np.argsort(order)
    parent = tree.parent[order]
    moved = Tree(
        kind=tree.kind[order],
        parent=np.where(parent >= 0, at[parent], -1),
        first_q=tree.first_q[order],
        first_v=tree.first_v[order],
        rotation=tree.rotation[order],
        translation=tree.translation[order],
    )
    return moved, at


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
        self.packed = pack_frames(self.problem, self.gate)
        self._neutral = skeleton.neutral()
        self._of_thread = _OfThread(self)

    @property
    def work(self) -> Array:
        """Scratch memory, one array for each thread."""
        return self._of_thread.work

    def new_memory(self) -> Array:
        """Return the memory before a first frame, for frames one after the other.

        It ends with the pose from which the next frame starts.
        """
        return new_memory(len(self._neutral), len(SIDES))

    def new_rows(self, n: int) -> Array:
        """Make room for the solutions of n frames, see :class:`SolvedFrames`."""
        return np.empty((n, len(self._neutral) + 3 + len(SIDES)))

    def solve_one(self, markers: Array, before: Array | None) -> Pose:
        """Solve one frame of markers (M, 3), as :meth:`solve` does.

        Iterations of -1 stand for an infinite marker, an infinite residual for a pose
        before that is not finite.
        """
        own = self._of_thread
        own.seen[...] = markers
        own.memory[...] = own.new_memory
        own.start[...] = self._neutral if before is None else before
        solve_frames(
            *self.packed, own.markers, 0, 1, 1, before is None, 0, own.memory, own.work,
            own.row,
        )  # fmt: skip
        residual, iterations, converged = own.report.tolist()
        return Pose(own.q.copy(), residual, int(iterations), converged > 0)

    def solve(
        self,
        markers: Array,
        span: tuple[int, int, int],
        before: Array | None,
        rows: Array,
        *,
        patience: int = 0,
        memory: Array | None = None,
    ) -> None:
        """Solve the frames of ``range(*span)``; the step is 1 or -1.

        Markers are (T, M, 3), NaN where not seen, `rows` those of :meth:`new_rows`. The
        first frame starts from the pose before, or from scratch; others from the one
        next to them, or the last that fit within so many frames of `patience`.
        """
        known = self.new_memory() if memory is None else memory
        known[-len(self._neutral) :] = self._neutral if before is None else before
        # A kernel is compiled again for arrays that cannot be written.
        seen = markers if markers.flags.writeable else markers.copy()
        solve_frames(
            *self.packed, seen, *span, before is None, patience, known, self.work, rows
        )


class _OfThread(threading.local):
    """Arrays of one thread: scratch memory, and a frame that is solved by itself."""

    def __init__(self, solver: KernelSolver) -> None:
        nq = solver.problem.starts.shape[1]
        self.work = np.empty(scratch_size(solver.problem))
        self.markers = np.empty((1, len(solver.problem.marker_joint), 3))
        self.seen = self.markers[0]
        self.memory, self.new_memory = solver.new_memory(), solver.new_memory()
        self.start = self.memory[-nq:]
        self.row = solver.new_rows(1)
        self.q, self.report = self.row[0, :nq], self.row[0, nq : nq + 3]


def _side(name: str) -> int:
    for k, side in enumerate(SIDES):
        if name.startswith(side):
            return k
    return -1
