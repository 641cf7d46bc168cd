"""Which freedoms a recording shows, and the motions that several outputs shall read."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration.elbow import motion_rows
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.dual import Motions

#: Outputs with more than this correlation over the still samples are reported.
_CORRELATED = 0.5


def freedom_motions(
    skeleton: Skeleton, posture: Array, chain: ChainLike, *, n_dof: int
) -> Motions | None:
    """Return the motions that the outputs of a map shall read, one row each.

    First each elbow's self-motion: what raises the elbow fastest with its hand held in
    place and orientation. Then single joints of each side: forearm pronation, wrist
    flexion, wrist deviation. Rows are the references of
    :func:`ikns.calibration.elbow.elbow_reference`.

    Parameters
    ----------
    skeleton : Skeleton
    posture : (18,) array
        Joints outside the chain, rad.
    chain : str
    n_dof : int

    Returns
    -------
    callable or None
        From the joint vector (n,) of the chain to motions (n_dof, n), unit rows. None
        when there are fewer motions than degrees of freedom.
    """
    if len(motion_rows(skeleton, posture, chain)[0]) < n_dof:
        return None
    columns = [skeleton.joint_names.index(joint) for joint in chain_joints(chain)]

    def motions(q: Array) -> Array:
        at = np.array(posture)
        at[columns] = q
        rows, elbows = motion_rows(skeleton, at, chain)
        rows, elbows = rows[:n_dof], min(elbows, n_dof)
        basis, rank = skeleton.null_spaces(at, chain)
        free = basis[: len(columns) - int(rank)]
        rows[:elbows] = rows[:elbows] @ free.T @ free
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return motions


def check_freedoms(learned: NullSpaceMap, joints: Array) -> list[str]:
    """Say which outputs of a map of several move together.

    That each place shows every freedom is checked as the map is fitted
    (:func:`ikns.nullspace.map.dual.assemble_dual`).

    Parameters
    ----------
    learned : NullSpaceMap
        Just fitted, with two outputs or more.
    joints : (N, n) array
        The joint vectors that it was fitted to, rad.

    Returns
    -------
    list of str
    """
    d = learned.directions_.shape[1]
    together = [
        np.abs(np.corrcoef(joints[learned.labels_ == k] @ z.T, rowvar=False))
        for k, z in enumerate(learned.directions_)
    ]
    middle = np.median(together, axis=0)
    return [
        f"outputs {i + 1} and {j + 1} move together (r {middle[i, j]:.2f} over the "
        "still samples, median of the places): move one without the other for longer."
        for i in range(d)
        for j in range(i + 1, d)
        if middle[i, j] > _CORRELATED
    ]
