"""Which freedoms a recording shows, and the motions that several outputs shall read."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.calibration.elbow import elbow_reference
from ikns.errors import NotEnoughData
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.dual import Motions, mean_motions

#: A freedom that is explored spans at least this, rad of its joints: half of a hand
#: that turns by 15 deg to either side, and twice what a hand that is meant to be still
#: tilts in 5 s (`ikns.simulation.Unsteadiness`).
LEAST_SPAN = np.radians(15.0)
#: An output of whose variance this much is a quadratic of those before it follows them
#: (a self-motion is bent, so that one freedom alone also moves the second output).
_FOLLOWS = 0.8
#: Outputs with more than this correlation over the still samples are reported.
_CORRELATED = 0.5
#: The freedoms are there when so many of the places show each of them.
_MOST = 2 / 3


def freedom_motions(
    skeleton: Skeleton, posture: Array, chain: str, *, n_dof: int
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
    if elbow_reference(skeleton, posture, chain, n_dof=n_dof) is None:
        return None
    sides = len(chain_sides(chain))
    columns = [skeleton.joint_names.index(joint) for joint in chain_joints(chain)]

    def motions(q: Array) -> Array:
        at = np.array(posture)
        at[columns] = q
        rows = elbow_reference(skeleton, at, chain, n_dof=max(n_dof, sides + 1))
        assert rows is not None
        rows = np.array(rows[:n_dof])
        basis, rank = skeleton.null_spaces(at, chain)
        free = basis[: len(columns) - int(rank)]
        elbows = min(sides, n_dof)
        rows[:elbows] = rows[:elbows] @ free.T @ free
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    return motions


def check_freedoms(learned: NullSpaceMap, joints: Array, motions: Motions) -> list[str]:
    """Refuse a recording with fewer freedoms than a map of several outputs was given.

    Parameters
    ----------
    learned : NullSpaceMap
        Just fitted, with two outputs or more.
    joints : (N, n) array
        The joint vectors that it was fitted to, rad.
    motions : callable
        What the outputs read.

    Returns
    -------
    list of str
        Which outputs move together.

    Raises
    ------
    NotEnoughData
        When at more than a third of the places an output hardly moves, or only follows
        those before it.
    """
    d = learned.directions_.shape[1]
    spans, follows, together = [], [], []
    for k, z in enumerate(learned.directions_):
        q = joints[learned.labels_ == k]
        moved = mean_motions(motions, q)
        gain = np.einsum("dn,dn->d", z, moved)
        spans.append((learned.upper_[k] - learned.lower_[k]) / gain)
        outputs = (q - q.mean(axis=0)) @ z.T
        follows.append([_explained(outputs, i) for i in range(d)])
        together.append(np.abs(np.corrcoef(outputs.T)))
    span, share = np.array(spans), np.array(follows)
    for i in range(d):
        shown = (span[:, i] >= LEAST_SPAN) & (share[:, i] < _FOLLOWS)
        if shown.mean() < _MOST:
            raise NotEnoughData(
                f"expected {d} freedoms, found the {_nth(i)} at {shown.sum()} of "
                f"{len(shown)} places: it spans "
                f"{np.degrees(np.median(span[:, i])):.0f} deg (median), and "
                f"{100 * np.median(share[:, i]):.0f} % of it follows what is read "
                "before; explore each by itself (turn the hand while it stays in "
                f"place), or ask for {d - 1} with --n-dof (n_dof)."
            )
    middle = np.median(together, axis=0)
    return [
        f"outputs {i + 1} and {j + 1} move together (r {middle[i, j]:.2f} over the "
        "still samples, median of the places): move one without the other for longer."
        for i in range(d)
        for j in range(i + 1, d)
        if middle[i, j] > _CORRELATED
    ]


def _explained(outputs: Array, i: int) -> float:
    """Share of an output's variance that is a quadratic of those before it."""
    others = outputs[:, :i]
    size = np.maximum(others.std(axis=0), 1e-12)
    terms = others / size
    pairs = [
        terms[:, a] * terms[:, b]
        for a in range(terms.shape[1])
        for b in range(a, terms.shape[1])
    ]
    columns = np.column_stack([np.ones(len(terms)), terms, *pairs])
    rest = outputs[:, i] - columns @ np.linalg.lstsq(columns, outputs[:, i])[0]
    total = float(np.var(outputs[:, i]))
    return 1.0 - float(np.var(rest)) / total if total > 0 else 1.0


def _nth(i: int) -> str:
    names = ("first", "second", "third", "fourth", "fifth", "sixth")
    return names[i] if i < len(names) else f"{i + 1}th"
