"""Which joints a marker set shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ikns.arrays import Array
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton

#: What skin and cameras move a marker by, standard deviation per axis, m.
_NOISE = 0.003
#: A joint that this noise turns by more is not shown, rad. The joints of `oxford24` and
#: `plug_in_gait` turn by 1 to 3.3 deg, the clavicles of `ue_adl`, which one marker on
#: the trunk does not tell apart from it, by 6 to 10.
_UNSHOWN = np.radians(5.0)
#: Middles and halves of the ranges from which postures are drawn, rad: the hand before
#: the chest, as in the calibration.
_POSTURES = {
    "shoulder_abduction": (0.6, 0.4),
    "shoulder_flexion": (0.4, 0.4),
    "elbow_flexion": (1.3, 0.5),
}
_SPREAD, _DRAWS = 0.3, 20
#: Which of several joints that move the same markers is held: the one with the least
#: range of motion comes first.
_ORDER = ("clavicle_elevation", "clavicle_protraction", "wrist_", "forearm_pronation")


def unshown_joints(skeleton: Skeleton) -> tuple[str, ...]:
    """Joints that the markers of a skeleton do not show, those it holds left out.

    A joint's angle is as uncertain as the noise of the markers over how far they move
    with it, less what all other joints and the trunk can undo: the standard deviation
    of a least-squares fit, at postures before the chest. Where it is more than 5 deg,
    one joint after the other is taken away until the rest is shown.

    Examples
    --------
    >>> unshown_joints(Skeleton.load(marker_set="oxford24"))
    ()
    """
    body = skeleton.with_markers(skeleton.marker_set.without_static())
    jacobians = _jacobians(body)
    fixed = set(body.columns(body.marker_set.held).tolist())
    free = [column for column in range(body.nv) if column not in fixed]
    names = dict(enumerate(body.joint_names, start=body.nv - len(body.joint_names)))
    found: list[str] = []
    while True:
        unsure = {
            column: sd
            for column, sd in zip(free, _deviations(jacobians[:, :, free]), strict=True)
            if column in names and sd > _UNSHOWN
        }
        if not unsure:
            return tuple(sorted(found, key=body.joint_names.index))
        first = min(
            unsure, key=lambda column: (_place(names[column]), -unsure[column], column)
        )
        found.append(names[first])
        free.remove(first)


def with_unshown_held(generic: Skeleton, worn: MarkerSet) -> MarkerSet:
    """Return the set with the joints held that it does not show."""
    more = unshown_joints(generic.with_nominal_markers(worn))
    return replace(worn, held=(*worn.held, *more))


def _place(joint: str) -> int:
    name = joint.partition("_")[2]
    return next((k for k, o in enumerate(_ORDER) if name.startswith(o)), len(_ORDER))


def _jacobians(body: Skeleton) -> Array:
    """Jacobians of all markers at drawn postures, (draws, 3 M, nv)."""
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(_DRAWS):
        q = body.neutral()
        for k, joint in enumerate(body.joint_names):
            name = joint.partition("_")[2]
            middle, half = _POSTURES.get(name, (0.0, _SPREAD))
            if not name.startswith("clavicle"):
                q[k - len(body.joint_names)] = middle + half * rng.uniform(-1, 1)
        drawn.append(body.marker_jacobian(q)[1].reshape(-1, body.nv))
    return np.array(drawn)


def _deviations(jacobians: Array) -> Array:
    """Median standard deviation of each column's coordinate, (k,) rad or m.

    The noise over the part of a column that is orthogonal to all others; infinite where
    there is none.
    """
    k = jacobians.shape[2]
    found = np.empty((len(jacobians), k))
    for own, J in zip(found, jacobians, strict=True):
        for j in range(k):
            others = np.delete(J, j, axis=1)
            left = J[:, j] - others @ np.linalg.lstsq(others, J[:, j], rcond=1e-9)[0]
            own[j] = _NOISE / max(float(np.linalg.norm(left)), 1e-12)
    return np.asarray(np.median(found, axis=0))
