"""Compare a map with the null spaces of an arm, from a motion and a skeleton."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.map_samples import (
    MapSamples,
    change_coordinates,
    compare_map_samples,
    learn_again,
    visited_points,
)
from ikns.analysis.compare.reaching import Crosstalk, crosstalk
from ikns.analysis.compare.samples import NullSpaceComparison
from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, as_chain, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap, still_mask

_SHOULDER = ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation")


def compare_motion(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    motion: Motion,
    *,
    chain: ChainLike = "right_arm",
    analyzed: ChainLike | None = None,
    task: Literal["pose", "position"] = "pose",
    coordinates: str = "internal",
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
    **options: Any,
) -> NullSpaceComparison:
    """Compare a learned map with the null spaces of a person's arm.

    Parameters
    ----------
    learned : NullSpaceMap
        In internal coordinates of `chain`.
    skeleton : Skeleton
        Owner of the Jacobian.
    motion : Motion
        What the arm did; its still samples near each PCA point are compared.
    chain : str
        Joints of the map, see :class:`ikns.Chain`.
    analyzed : str, optional
        Another chain of the same hands, with or without the clavicle. Then directions
        and ranges are learned again from the same samples of its joints, signs as in
        the map: a map of seven joints cannot know what the other two did.
    task : {"pose", "position"}
        What is held: hand position and orientation, or position alone.
    coordinates : str
        Of the shoulder, see :mod:`ikns.analysis.compare.coordinates`. In others than
        ``"internal"`` directions are learned again too; rotation vectors start from the
        mean posture of all samples.
    max_hand_speed, min_duration : float
        See :func:`ikns.nullspace.map.still_mask`, m/s and s.
    **options
        Of :func:`ikns.analysis.compare.compare_samples`.

    Returns
    -------
    NullSpaceComparison
        Its `points` are those of the map that were visited; others are left out. Of two
        hands the leak is that of the point between them and of the right one's
        orientation.

    Raises
    ------
    InvalidInput
        When the chains have different hands, or see :func:`compare_samples`.
    NotEnoughData
        When no point has enough still samples, or see :func:`compare_samples`.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion, body = run.points.truth, run.subject.skeleton
    >>> learned = NullSpaceMap(10).fit(*ikns.null_space_samples(motion))
    >>> found = compare_motion(learned, body, motion, resamples=0)
    >>> bool(np.degrees(found.pooled["angle"][0]) < np.degrees(found.chance_angles[0]))
    True
    """
    whole = chain if analyzed is None else analyzed
    _check_chains(learned, chain, whole)
    names = chain_joints(whole)
    gate = still_mask(
        motion, chain, max_hand_speed=max_hand_speed, min_duration=min_duration
    )
    gate &= np.isfinite(motion.chain_angles(whole)).all(axis=1)
    still = np.flatnonzero(gate)
    labels, points = visited_points(
        learned,
        motion.task_position(chain)[still],
        len(names),
        max_hand_speed=max_hand_speed,
    )
    used, labels = still[labels >= 0], labels[labels >= 0]
    angles = motion.angles[used]
    columns = [motion.joint_names.index(name) for name in names]
    rest = [angles[labels == k].mean(axis=0) for k in range(len(points))]
    samples = MapSamples(
        time=motion.time[used],
        q=motion.chain_angles(whole)[used],
        jacobians=skeleton.chain_jacobian(angles, whole, task=task),
        position=motion.task_position(chain)[used],
        rotation=motion.task_rotation(chain)[used],
        labels=labels,
        directions=_embedded(learned.directions_[points], chain_joints(chain), names),
        lower=learned.lower_[points],
        upper=learned.upper_[points],
        kinematics=[_kinematics(skeleton, whole, task, columns, q) for q in rest],
    )
    if coordinates != "internal":
        if not _shoulders(names):
            raise InvalidInput(
                f"the chain '{whole}' has no whole shoulder; expected its coordinates "
                f"internal, found {coordinates}."
            )
        for shoulder in _shoulders(names):
            samples = change_coordinates(samples, coordinates, shoulder)
    if as_chain(whole) != as_chain(chain) or coordinates != "internal":
        samples = learn_again(samples, variance=learned.variance)
    return compare_map_samples(
        samples, points, variance=learned.variance, options=options
    )


def motion_crosstalk(
    learned: NullSpaceMap,
    motion: Motion,
    *,
    chain: ChainLike = "right_arm",
    c: Array | None = None,
    max_hand_speed: float = 0.05,
    **options: Any,
) -> Crosstalk:
    """Measure how a person's natural reaches change the (first) control signal.

    `learned` is a map of the joints of `chain`, or `c` (T,) the signal that something
    else reads; `max_hand_speed`, m/s, is the gate between reach and rest, and `options`
    are those of :func:`ikns.analysis.compare.crosstalk`.
    """
    if c is None:
        q, x = motion.chain_angles(chain), motion.task_position(chain)
        c = learned.control_signal(q, x)
    return crosstalk(
        c if c.ndim == 1 else c[:, 0],
        motion.hand_speed(chain),
        motion.task_position(chain),
        max_hand_speed=max_hand_speed,
        **options,
    )


def _check_chains(learned: NullSpaceMap, chain: ChainLike, whole: ChainLike) -> None:
    own, other = as_chain(chain), as_chain(whole)
    if (other.ends, other.base) != (own.ends, own.base):
        ends = [end.replace("_knuckle", " hand") for end in own.ends]
        raise InvalidInput(
            f"expected a chain that ends in the {' and '.join(ends)} as the map's "
            f"{chain} does, found {whole}."
        )
    if own.extrinsic or other.extrinsic:
        raise InvalidInput(
            f"the chain '{own if own.extrinsic else other}' is extrinsic: its task "
            "leaves its joints alone, so no Jacobian says which of their motions do."
        )
    if learned.directions_.shape[2] != len(chain_joints(chain)):
        raise InvalidInput(
            f"expected a map of {chain} with {len(chain_joints(chain))} joints, found "
            f"one of {learned.directions_.shape[2]}."
        )


def _kinematics(
    skeleton: Skeleton, chain: ChainLike, task: str, columns: list[int], rest: Array
) -> Kinematics:
    """Kinematics of a chain's hands; the other joints stay as in `rest` (18,) rad."""

    def posture(given: Array) -> Array:
        full = np.broadcast_to(rest, (*given.shape[:-1], len(rest))).copy()
        full[..., columns] = given
        return full

    def pose(given: Array) -> tuple[Array, Array]:
        place, turn = skeleton.chain_ends(posture(given), chain)
        return place.mean(axis=-2), turn[..., 0, :, :]

    return Kinematics(
        pose, lambda y: skeleton.chain_jacobian(posture(y), chain, task=task)
    )


def _embedded(Z: Array, own: Sequence[str], names: Sequence[str]) -> Array:
    """Directions of some joints among others; zero for those they do not know."""
    found = np.zeros((*Z.shape[:2], len(names)))
    for i, name in enumerate(names):
        if name in own:
            found[..., i] = Z[..., list(own).index(name)]
    return found


def _shoulders(names: Sequence[str]) -> list[list[int]]:
    """Columns of each shoulder."""
    return [
        [list(names).index(f"{side}_{joint}") for joint in _SHOULDER]
        for side in SIDES
        if all(f"{side}_{joint}" in names for joint in _SHOULDER)
    ]
