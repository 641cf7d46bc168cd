"""Proximal and intent, learned from the same recordings as the paper's map."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike, no_swivel, whole_arms
from ikns.body.skeleton import Skeleton
from ikns.calibration.natural import (
    LEAST_BENT,
    LEAST_NATURAL,
    check_covered,
    check_own_arm,
    elbow_degrees,
)
from ikns.calibration.places import ONE_PLACE
from ikns.errors import IknsError, NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import MapWarning, NullSpaceMap
from ikns.nullspace.posture_terms import wrist_of
from ikns.nullspace.readout import IntentMap, Readout, readout_samples
from ikns.nullspace.readout.coordinates import elbow_height_gradient, mean_orientation
from ikns.nullspace.readout.ends import swept_ends


def learn_readouts(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    explorations: Sequence[tuple[Motion, Mask]],
    chain: ChainLike,
    *,
    natural: Sequence[Motion] = (),
    max_hand_speed: float = 0.05,
) -> tuple[dict[str, Readout], dict[str, Any]]:
    """Fit the other methods at the places of the paper's map.

    Parameters
    ----------
    skeleton : Skeleton
    learned : NullSpaceMap
        Fitted to the still samples of the explorations, in their order.
    explorations : sequence of (Motion, (T,) boolean array)
        With their still samples.
    chain : str
    natural : sequence of Motion
        Ordinary movement. Reaches between the places count as well.
    max_hand_speed : float
        Faster hands move, m/s.

    Returns
    -------
    readouts : dict
        Without the methods that cannot be learned here.
    report : dict
        ``without``: method and why it is missing; ``warnings``; and of intent
        ``natural_posture``, ``ends_rad`` and ``places``, whose ``scatter`` is how far
        the farther end is from the mean of all, in units of the range.

    Raises
    ------
    NotEnoughData
        When natural movement was given and covers nothing, or is of the other arm.
    """
    found: dict[str, Readout] = {}
    report: dict[str, Any] = {"without": {}, "warnings": []}
    if (n_dof := learned.directions_.shape[1]) > 1:
        reason = f"it reads one degree of freedom, and this map has {n_dof}"
        report["without"] = dict.fromkeys(("proximal", "intent"), reason)
        return found, report
    if not whole_arms(chain):
        reason = no_swivel(chain).rstrip(".")
        report["without"] = dict.fromkeys(("proximal", "intent"), reason)
        return found, report
    moving = _natural_samples(
        skeleton, learned, explorations, chain, natural, max_hand_speed=max_hand_speed
    )
    steps = {
        "proximal": lambda: _proximal(skeleton, learned, explorations, chain),
        "intent": lambda: _intent(skeleton, learned, explorations, chain, moving),
    }
    for method, fit in steps.items():
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", MapWarning)
            try:
                found[method] = fit()
            except IknsError as error:
                report["without"][method] = str(error)
        report["warnings"] += [f"{method}: {one.message}" for one in caught]
    if "intent" in found and isinstance(intent := found["intent"].map, IntentMap):
        report["natural_posture"] = intent.natural_.coverage_
        report["ends_rad"] = list(intent.ends_)
        points = _points(intent, learned)
        report["places"] = [
            {
                "point": point,
                "lower_rad": float(intent.lower_[k]),
                "upper_rad": float(intent.upper_[k]),
                "scatter": float(intent.scatter_[k]),
            }
            for k, point in enumerate(points)
        ]
    return found, report


def _proximal(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    explorations: Sequence[tuple[Motion, Mask]],
    chain: ChainLike,
) -> Readout:
    _require_bent(explorations, chain)
    still = np.concatenate([motion.angles[gate] for motion, gate in explorations])
    reference = mean_orientation(skeleton, still, chain)
    rows = [
        readout_samples(skeleton, motion, chain, "proximal", reference=reference)
        for motion, _ in explorations
    ]
    x, y, time = _still(rows, explorations)
    made = NullSpaceMap(
        len(learned.centers_),
        variance=learned.variance,
        radius=learned.radius_,
        interpolation="smooth",
        reference=elbow_height_gradient(reference),
        min_samples=1,
    ).fit(x, y, groups=learned.labels_)
    for k, z in enumerate(made.directions_[:, 0]):
        row = made.labels_ == k
        made.lower_[k], made.upper_[k], _ = swept_ends(y[row] @ z, time[row])
    return Readout("proximal", chain, made, reference)


def _intent(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    explorations: Sequence[tuple[Motion, Mask]],
    chain: ChainLike,
    moving: tuple[Array, Array] | None,
) -> Readout:
    _require_bent(explorations, chain)
    rows = [
        readout_samples(skeleton, motion, chain, "intent") for motion, _ in explorations
    ]
    x, y, time = _still(rows, explorations)
    natural = {} if moving is None else {"natural_X": moving[0], "natural_y": moving[1]}
    made = IntentMap(len(learned.centers_), min_samples=1)
    made.fit(x, y, groups=learned.labels_, time=time, **natural)
    made.warn_of_scatter([f"point {point}" for point in _points(made, learned)])
    return Readout("intent", chain, made)


def _require_bent(
    explorations: Sequence[tuple[Motion, Mask]], chain: ChainLike
) -> None:
    """Refuse a straight arm, whose elbow goes nowhere as it swivels."""
    bent = max(elbow_degrees(motion, gate, chain) for motion, gate in explorations)
    if bent < LEAST_BENT:
        raise NotEnoughData(
            f"the arm is straight wherever the hand is held, with the elbow at "
            f"{bent:.0f} deg at most; hold it closer, so that the elbow bends by "
            f"{LEAST_BENT:.0f} deg or more"
        )


def _points(intent: IntentMap, learned: NullSpaceMap) -> list[int]:
    """Return the number of the PCA point, from 1, of most samples of each place."""
    return [
        1
        + int(
            np.bincount(
                learned.labels_[intent.labels_ == k] + 1,
                minlength=len(learned.centers_) + 1,
            )[1:].argmax()
        )
        for k in range(len(intent.centers_))
    ]


def _still(
    rows: Sequence[tuple[Array, Array]], explorations: Sequence[tuple[Motion, Mask]]
) -> tuple[Array, Array, Array]:
    """Places, coordinates and times of the still samples of all explorations.

    One recording follows the other, 1 s apart.
    """
    gates = [gate for _, gate in explorations]
    starts = np.cumsum([0.0, *(np.ptp(motion.time) + 1 for motion, _ in explorations)])
    time = np.concatenate(
        [
            start + (motion.time - motion.time[0])[gate]
            for start, (motion, gate) in zip(starts, explorations, strict=False)
        ]
    )
    x = np.concatenate([x[gate] for (x, _), gate in zip(rows, gates, strict=True)])
    y = np.concatenate([y[gate] for (_, y), gate in zip(rows, gates, strict=True)])
    return x, y, time


def _natural_samples(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    explorations: Sequence[tuple[Motion, Mask]],
    chain: ChainLike,
    natural: Sequence[Motion],
    *,
    max_hand_speed: float,
) -> tuple[Array, Array] | None:
    """Places and swivels of ordinary movement; None where there is too little.

    In the explorations these are the frames away from every held place.
    """
    check_own_arm(natural, chain)
    if len(whole_arms(chain)) != 1:
        return None
    found = moving_samples(
        skeleton,
        learned,
        [motion for motion, _ in explorations],
        natural,
        chain,
        max_hand_speed=max_hand_speed,
    )
    if natural:
        check_covered(
            np.concatenate([wrist_of(x[row]) for x, _, row in found[-len(natural) :]])
        )
    motions = [*(motion for motion, _ in explorations), *natural]
    seconds = sum(
        float(row.sum() * np.median(np.diff(motion.time)))
        for motion, (_, _, row) in zip(motions, found, strict=True)
    )
    if seconds < LEAST_NATURAL:
        return None
    places = np.concatenate([x[row] for x, _, row in found])
    swivel = np.concatenate([s[row] for _, s, row in found])
    return places, swivel


def moving_samples(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    explorations: Sequence[Motion],
    natural: Sequence[Motion],
    chain: ChainLike,
    *,
    max_hand_speed: float,
) -> list[tuple[Array, Array, Mask]]:
    """Place, swivel (T,), and the frames of ordinary movement, of each motion.

    Places (T, 6) are those of intent, :func:`ikns.nullspace.readout.readout_samples`.
    In the explorations these are frames with a moving hand away from every held place.
    """
    found = []
    for motion, away in [(motion, True) for motion in explorations] + [
        (motion, False) for motion in natural
    ]:
        place, swivel = readout_samples(skeleton, motion, chain, "intent")
        row = np.isfinite(place).all(axis=1) & np.isfinite(swivel[:, 0])
        row &= motion.hand_speed(chain) >= max_hand_speed
        if away:
            hand = motion.task_position(chain)[row]
            row[row] = nearest_center(hand, learned.centers_, radius=ONE_PLACE)[0] < 0
        found.append((place, swivel[:, 0], row))
    return found
