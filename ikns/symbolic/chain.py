"""The joints of a task and its constraints as expressions: hands, clearances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ikns._kernels.body.tree import Tree
from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_joints, chain_sides
from ikns.body.skeleton import Robot, Skeleton
from ikns.errors import InvalidInput
from ikns.symbolic.kinematics import (
    End,
    Pose,
    ends_of,
    frame,
    joint_frames,
    path_jacobian,
    root_at_origin,
)
from ikns.symbolic.volumes import Capsule, arm_pairs, capsules, distance

Pair = tuple[Capsule, Capsule]


@dataclass(frozen=True, eq=False)
class ChainModel:
    """The joints of a task in a body.

    Parameters
    ----------
    tree : Tree
        Every joint; joint 0 is a free flyer that carries the body.
    columns : (n,) integer array
        The task's joints among the body's angles.
    lower, upper : (n,) array
        Limits, rad; infinite where a joint has none.
    ends : tuple
        The frames that do the task.
    pairs : tuple
        Capsules that must not overlap, each with where its link sits in the tree.
    alone : bool
        Whether a posture consists of the task's joints only.
    """

    tree: Tree
    columns: NDArray[np.int64]
    names: tuple[str, ...]
    lower: Array
    upper: Array
    ends: tuple[End, ...]
    pairs: tuple[tuple[Capsule, End, Capsule, End], ...] = ()

    alone: bool = False

    @property
    def n_angles(self) -> int:
        """Angles of the whole body."""
        return len(self.tree.kind) - 1

    def whole(self, q: Array) -> Array:
        """Angles of the whole body (m,) from its own, its configuration, or a robot's.

        A robot's joints that do not move its frame are zero.
        """
        n = len(self.columns) if self.alone else self.n_angles
        if q.shape not in ((n,), (n + 7,)) or (self.alone and len(q) != n):
            raise InvalidInput(f"expected {n} joint angles, found {len(q)}.")
        if not self.alone:
            return np.array(q[-n:])
        angles = np.zeros(self.n_angles)
        angles[self.columns] = q
        return angles


@dataclass(frozen=True, eq=False)
class Held:
    """Functions of the chain's joints x (n,) and the angles of the whole body.

    `place` gives the hands' positions (3, h) m and rotations (3, 3 h); `off`, of these
    too, the hands' errors (k,) m and rad; `jacobian` the hands' Jacobian (k, n);
    `clearance` that between the capsules of each pair, m, named by `names`.
    """

    place: ca.Function
    off: ca.Function
    jacobian: ca.Function
    clearance: ca.Function
    names: tuple[str, ...]


def chain_of(
    body: Skeleton | Robot,
    chain: ChainLike | None = None,
    *,
    hands_move: bool = False,
    pairs: Sequence[Pair] | None = None,
) -> ChainModel:
    """Describe the chain of a skeleton, or a whole robot.

    `hands_move` says whether a skeleton's hands turn, so that they too can touch the
    body. Pairs that must not overlap are by default a skeleton's own
    (:func:`ikns.symbolic.volumes.arm_pairs`), none for a robot.
    """
    if isinstance(body, Robot):
        if pairs:
            raise InvalidInput(
                "volumes are known for skeletons only, found pairs of a robot's."
            )
        if not np.array_equal(body.coupling, np.eye(len(body.joint_names))):
            raise InvalidInput(
                "expected joints that move one by one, found some of "
                f"{', '.join(body.joint_names)} that others mimic."
            )
        joint, way = body.end[0], list[int]()
        while joint > 0:
            way.insert(0, joint)
            joint = int(body.tree.parent[joint])
        columns = np.array(way, dtype=np.int64) - 1
        return ChainModel(
            tree=body.tree,
            columns=columns,
            names=body.joint_names,
            lower=body.lower,
            upper=body.upper,
            ends=(body.end,),
            alone=True,
        )
    if chain is None:
        raise InvalidInput("name the chain of the skeleton, such as 'right_arm'.")
    names, sides = chain_joints(chain), chain_sides(chain)
    unknown = [name for name in names if name not in body.joint_names]
    if unknown:
        raise InvalidInput(f"the skeleton has no joint {', '.join(unknown)}.")
    columns = np.array([body.joint_names.index(name) for name in names])
    if pairs is None:
        pairs = arm_pairs(capsules(body.urdf), sides, hands=hands_move)
    links = {capsule.link for pair in pairs for capsule in pair}
    ends = {link: body.tree_link(link) for link in links}
    return ChainModel(
        tree=body.tree,
        columns=columns,
        names=names,
        lower=body.lower[columns],
        upper=body.upper[columns],
        ends=tuple(body.tree_link(end) for end in ends_of(chain)),
        pairs=tuple((a, ends[a.link], b, ends[b.link]) for a, b in pairs),
    )


def held(chain: ChainModel, *, task: str) -> Held:
    """Build the functions of a chain that holds its hands' pose or position."""
    if task not in ("pose", "position"):
        raise InvalidInput(f"task must be 'pose' or 'position', not '{task}'.")
    n, h = len(chain.columns), len(chain.ends)
    x, given = ca.SX.sym("x", n), ca.SX.sym("angles", chain.n_angles)
    angles = ca.SX(given)
    for i, column in enumerate(chain.columns):
        angles[int(column)] = x[i]
    frames = joint_frames(chain.tree, root_at_origin(angles))
    poses = [frame(frames[j], R, p) for j, R, p in chain.ends]
    positions = ca.horzcat(*(p for _, p in poses))
    rotations = ca.horzcat(*(R for R, _ in poses))
    wanted_p, wanted_R = ca.SX.sym("p", 3, h), ca.SX.sym("R", 3, 3 * h)
    rows = 6 if task == "pose" else 3
    off = []
    for e, (R, p) in enumerate(poses):
        off.append(p - wanted_p[:, e])
        if task == "pose":
            # Sine of the angle between the two, about its axis.
            D = R @ wanted_R[:, 3 * e : 3 * e + 3].T
            axis = ca.vertcat(D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1])
            off.append(axis / 2)
    joints = [int(column) + 1 for column in chain.columns]
    J = [path_jacobian(chain.tree, frames, e, joints, rows=rows) for e in chain.ends]
    rooms = [
        distance(_ends(a, at_a, frames), _ends(b, at_b, frames)) - a.radius - b.radius
        for a, at_a, b, at_b in chain.pairs
    ]
    inputs = [x, given]
    return Held(
        place=ca.Function("place", inputs, [positions, rotations]),
        off=ca.Function("off", [*inputs, wanted_p, wanted_R], [ca.vertcat(*off)]),
        jacobian=ca.Function("jacobian", inputs, [ca.vertcat(*J)]),
        clearance=ca.Function(
            "clearance", inputs, [ca.vertcat(*rooms) if rooms else ca.SX.zeros(0, 1)]
        ),
        names=tuple(f"{a.name} touches {b.name}" for a, _, b, _ in chain.pairs),
    )


def _ends(capsule: Capsule, at: End, frames: Sequence[Pose]) -> tuple[ca.SX, ca.SX]:
    """Return the ends of a capsule's segment in the body's frame."""
    R, p = frame(frames[at[0]], at[1], at[2])
    first = p + R @ ca.SX(np.array(capsule.start))
    if capsule.start == capsule.end:
        return first, first
    return first, p + R @ ca.SX(np.array(capsule.end))
