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
#: Added to the normal equations, m^2, so that they have an inverse: the square of a
#: motion of 1 um, far below what any marker shows.
_RIDGE = 1e-12
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
        sd = dict(zip(free, _deviations(jacobians[:, :, free]), strict=True))
        unsure = [c for c in free if c in names and sd[c] > _UNSHOWN]
        if not unsure:
            return tuple(sorted(found, key=body.joint_names.index))
        first = min(unsure, key=lambda c: (_place(names[c]), -sd[c], c))
        # Both sides alike, where the other is not much better.
        own = names[first].partition("_")[2]
        for column in [c for c in free if c in names]:
            if names[column].endswith(own) and sd[column] > 0.8 * _UNSHOWN:
                found.append(names[column])
                free.remove(column)


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

    The noise over the part of a column that is orthogonal to all others, as the inverse
    of the normal equations has it; thousands of rad where there is none.
    """
    normal = np.swapaxes(jacobians, 1, 2) @ jacobians
    inverse = np.linalg.inv(normal + _RIDGE * np.eye(normal.shape[1]))
    variance = np.diagonal(inverse, axis1=1, axis2=2)
    return np.asarray(_NOISE * np.sqrt(np.median(variance, axis=0)))
