"""Forward kinematics and Jacobians as CasADi expressions, from the joint tree.

The joints are those of the compiled kernels (:mod:`ikns._kernels.body.tree`), so
optimizers use the same body model as everything else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ikns._kernels.body.tree import FREE_FLYER, PRISMATIC, Tree
from ikns.arrays import Array
from ikns.body.chains import ChainLike, as_chain, chain_joints
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.body.skeleton.markers import part_along
from ikns.errors import InvalidInput

#: Rotation (3, 3) and translation (3, 1), m, as expressions.
Pose = tuple[ca.SX, ca.SX]
#: A frame fixed to a joint of a tree: joint, rotation (3, 3), translation (3,) m.
End = tuple[int, Array, Array]

#: An entry of a placement this close to an integer is rounded to it, so that zeros and
#: ones drop out of the expressions.
_BLUR = 1e-15


def joint_frames(
    tree: Tree, q: ca.SX, *, growth: Mapping[int, ca.SX] | None = None
) -> list[Pose]:
    """Pose of every joint in the world at a configuration (nq,).

    `growth` has size factors of what a joint carries, by joint.
    """
    frames: list[Pose] = []
    grown = {} if growth is None else growth
    for j, (kind, parent) in enumerate(zip(tree.kind, tree.parent, strict=True)):
        above = frames[parent] if parent >= 0 else (ca.SX.eye(3), ca.SX.zeros(3, 1))
        factor = grown.get(int(parent), 1.0)
        placed = frame(above, tree.rotation[j], factor * _whole(tree.translation[j]))
        frames.append(_moved(placed, int(kind), q, int(tree.first_q[j])))
    return frames


def frame(above: Pose, rotation: Array, translation: Array | ca.SX) -> Pose:
    """Pose of a frame fixed to another."""
    R, p = above
    return R @ ca.SX(_whole(rotation)), p + R @ ca.SX(translation)


def root_at_origin(angles: ca.SX) -> ca.SX:
    """Return the configuration (n + 7,) whose free flyer is at the world's origin."""
    return ca.vertcat(0, 0, 0, 0, 0, 0, 1, angles)


def path_jacobian(
    tree: Tree, frames: Sequence[Pose], end: End, joints: Sequence[int], *, rows: int
) -> ca.SX:
    """Jacobian of a frame by joints of the tree, (3 or 6, n).

    Columns ``[z x (x - p); z]`` of revolute and ``[z; 0]`` of sliding joints on the way
    to the frame, zeros for all others (Siciliano et al. 2009, Robotics, sec. 3.1).
    """
    x = frame(frames[end[0]], end[1], end[2])[1]
    way = {end[0]}
    while tree.parent[min(way)] >= 0:
        way.add(int(tree.parent[min(way)]))
    columns = []
    for joint in joints:
        R, p = frames[joint]
        z = R[:, 2]
        if joint not in way:
            column = ca.SX.zeros(6, 1)
        elif tree.kind[joint] == PRISMATIC:
            column = ca.vertcat(z, ca.SX.zeros(3, 1))
        else:
            column = ca.vertcat(ca.cross(z, x - p), z)
        columns.append(column[:rows])
    return ca.horzcat(*columns)


def link_in_thorax(skeleton: Skeleton, link: str) -> ca.Function:
    """Return the function from joint angles (18,) to a link's position and rotation.

    Angles in rad, position (3,) in m, rotation (3, 3), seen from the thorax.

    Examples
    --------
    >>> skeleton = Skeleton.load()
    >>> position, _ = link_in_thorax(skeleton, "right_hand")(np.zeros(18))
    >>> place = skeleton.link_in_thorax(np.zeros(18), "right_hand")[0]
    >>> bool(np.allclose(position.full().ravel(), place))
    True
    """
    angles = ca.SX.sym("angles", len(skeleton.joint_names))
    frames = joint_frames(skeleton.tree, root_at_origin(angles))
    joint, rotation, translation = skeleton.tree_link(link)
    R, p = frame(frames[joint], rotation, translation)
    names = ["angles"], ["position", "rotation"]
    return ca.Function("link_in_thorax", [angles], [p, R], *names)


def chain_jacobian(
    skeleton: Skeleton, chain: ChainLike, *, task: str = "pose"
) -> ca.Function:
    """Return the function from joint angles (18,) to a chain's Jacobian (k, n).

    Its rows and columns are those of
    :meth:`ikns.body.skeleton.Skeleton.chain_jacobian`.
    """
    if task not in ("pose", "position"):
        raise InvalidInput(f"task must be 'pose' or 'position', not '{task}'.")
    angles = ca.SX.sym("angles", len(skeleton.joint_names))
    tree = skeleton.tree
    frames = joint_frames(tree, root_at_origin(angles))
    joints = [skeleton.joint_names.index(name) + 1 for name in chain_joints(chain)]
    blocks = [
        path_jacobian(
            tree,
            frames,
            skeleton.tree_link(end),
            joints,
            rows=6 if task == "pose" else 3,
        )
        for end in ends_of(chain)
    ]
    J = ca.vertcat(*blocks)
    return ca.Function("chain_jacobian", [angles], [J], ["angles"], ["jacobian"])


def ends_of(chain: ChainLike) -> tuple[str, ...]:
    """Return the links that end a chain, which are seen from the thorax."""
    own = as_chain(chain)
    if own.base != "thorax" or own.extrinsic:
        raise InvalidInput(
            f"the chain '{own}' is {'extrinsic' if own.extrinsic else 'seen from'}"
            f"{'' if own.extrinsic else f' {own.base}'}; expected one whose joints "
            "move its ends in the thorax frame."
        )
    return own.ends


def markers_in_world(skeleton: Skeleton) -> ca.Function:
    """Return the function from a configuration, sizes and offsets to markers.

    From q (25,), the logarithms of size factors (9,) in the order of
    :data:`ikns.body.model_file.SEGMENTS` and offsets (M, 3) m in the links' frames to
    positions (M, 3) m in the world. With zeros it is
    :meth:`ikns.body.skeleton.Skeleton.markers_in_world`, with others that of the
    skeleton :meth:`~ikns.body.skeleton.Skeleton.resized` by the factors and then
    offset.
    """
    q = ca.SX.sym("q", 7 + len(skeleton.joint_names))
    sizes = ca.SX.sym("log_sizes", len(SEGMENTS))
    offsets = ca.SX.sym("offsets", len(skeleton.marker_set.markers), 3)
    places = sized_markers(skeleton, q, sizes, offsets)
    names = ["q", "log_sizes", "offsets"], ["markers"]
    return ca.Function("markers_in_world", [q, sizes, offsets], [places], *names)


def sized_markers(skeleton: Skeleton, q: ca.SX, sizes: ca.SX, offsets: ca.SX) -> ca.SX:
    """Expression of the markers (M, 3), see :func:`markers_in_world`."""
    factors = ca.exp(sizes)
    carriers = {link: skeleton.tree_link(link)[0] for link in SEGMENTS}
    growth = {carriers[link]: factors[i] for i, link in enumerate(SEGMENTS)}
    frames = joint_frames(skeleton.tree, q, growth=growth)
    positions, worn = skeleton.marker_positions, skeleton.marker_set
    along = part_along(skeleton.urdf, worn, positions)
    grown = {link: factors[i] - 1 for i, link in enumerate(SEGMENTS)}
    rows = []
    for m, marker in enumerate(worn.markers):
        joint, rotation, translation = skeleton.tree_link(marker.link)
        place = ca.SX(positions[m]) + offsets[m, :].T
        place += grown.get(marker.link, 0.0) * along[m]
        R, p = frame(frames[joint], rotation, translation)
        rows.append((p + R @ place).T)
    return ca.vertcat(*rows)


def _moved(placed: Pose, kind: int, q: ca.SX, at: int) -> Pose:
    """Pose after the joint's own motion about or along its z axis."""
    R, p = placed
    if kind == FREE_FLYER:
        x, y, z, w = (q[at + 3 + i] for i in range(4))
        turn = ca.vertcat(
            ca.horzcat(
                1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
            ),
            ca.horzcat(
                2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
            ),
            ca.horzcat(
                2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
            ),
        )
        return R @ turn, p + R @ q[at : at + 3]
    if kind == PRISMATIC:
        return R, p + R[:, 2] * q[at]
    c, s = ca.cos(q[at]), ca.sin(q[at])
    x, y = R[:, 0], R[:, 1]
    return ca.horzcat(c * x + s * y, c * y - s * x, R[:, 2]), p


def _whole(values: Array) -> Array:
    """Values rounded where they are integers up to rounding errors."""
    near = np.round(values)
    return np.where(np.abs(values - near) <= _BLUR, near, values)
