"""Try exchanges of names on a static posture, and see whether everything fits then."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.chains import SIDES
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.plausible import (
    LIKELY_BEYOND,
    SUSPECT_OFFSET,
    Assumed,
    assumed,
)
from ikns.calibration.judge.pose_cost import PoseCost
from ikns.calibration.judge.sides import other_side
from ikns.calibration.size_fit import fit_sizes

#: Names are exchanged one pair after the other, at most so many.
_MOST_PAIRS = 3
#: The most promising exchanges of a round, which the whole fit then judges.
_TRIED = 3
#: A repair must gain more than this, squared standard deviations: odds of e^6. Names
#: within a cluster, which change nothing, gain up to 8 when exchanged.
_LEAST_GAIN = 12.0
#: Markers nearer than this to one another are one place, m.
_ONE_PLACE = 0.015


class Repair(NamedTuple):
    """What makes a static posture plausible."""

    exchanges: tuple[tuple[int, int], ...]  # pairs of markers, empty if mirrored
    mirrored: bool  # left and right exchanged, or a mirror image
    left: Assumed  # what the fit still assumes
    sure: bool  # whether the posture was unlikely before


def find_repair(reference: Skeleton, target: Array, found: Assumed) -> Repair | None:
    """Find the exchange of names after which a person can stand like that.

    Parameters
    ----------
    reference : Skeleton
        The body with the markers at their nominal places.
    target : (M, 3) array
        Mean marker positions, m; NaN where never seen.
    found : Assumed
        What the fit to the target assumes.

    Returns
    -------
    Repair or None
        None where no exchange of up to three pairs, and no mirror, explains it.
    """
    nominal = PoseCost(
        reference,
        np.array([np.mean(m.placement_sd) for m in reference.marker_set.markers]),
    )
    for image in _mirrored(reference.marker_set, target):
        # A person is not quite symmetric, and stands so even less: by cost alone.
        if nominal(image) < nominal(target) / 2:
            after = _assume(reference, image)
            if after.likely and after.cost < found.cost - _LEAST_GAIN:
                return Repair((), True, after, not found.likely)
    order = np.arange(len(target))
    done: list[tuple[int, int]] = []
    now = found
    for _ in range(_MOST_PAIRS):
        pairs = _candidates(reference, target[order], now)
        if not len(pairs):
            return None
        costs = [nominal(target[_exchange(order, a, b)]) for a, b in pairs]
        best = None
        for k in np.argsort(costs)[:_TRIED]:
            trial = _assume(reference, target[_exchange(order, *pairs[k])])
            if best is None or trial.cost < best[0].cost:
                best = trial, (int(pairs[k][0]), int(pairs[k][1]))
            if trial.likely:
                break
        if best is None or best[0].cost > now.cost - _LEAST_GAIN:
            return None
        now, pair = best
        order = _exchange(order, *pair)
        done.append(pair)
        if now.likely:
            return Repair(tuple(done), False, now, not found.likely)
    return None


def _assume(reference: Skeleton, target: Array) -> Assumed:
    return assumed(reference, target, fit_sizes(reference, target))


def _candidates(reference: Skeleton, target: Array, found: Assumed) -> Indices:
    """Pairs (K, 2) of markers at different places, one of them suspected."""
    worn = reference.marker_set
    suspects = found.offsets_sd > SUSPECT_OFFSET
    if not found.likely:
        # A wrong name turns joints before and after it, so its whole arm is suspected.
        off = [m.link for m, s in zip(worn.markers, suspects, strict=True) if s]
        off += np.array(reference.joint_names)[found.beyond > LIKELY_BEYOND].tolist()
        sides = tuple(s for s in SIDES if any(name.startswith(s) for name in off))
        own = [m.link.startswith(sides or ("",)) for m in worn.markers]
        suspects = suspects | np.array(own)
    first, second = np.triu_indices(len(target), 1)
    apart = np.linalg.norm(target[first] - target[second], axis=1)
    keep = (suspects[first] | suspects[second]) & (apart > _ONE_PLACE)
    return np.column_stack([first, second])[keep]


def _mirrored(worn: MarkerSet, target: Array) -> Iterator[Array]:
    """Exchange left and right; where not all of it is seen twice, mirror the places."""
    other = other_side(worn.labels)
    if (other != np.arange(len(other))).any():
        yield target[other]
    yield target * [-1.0, 1.0, 1.0]


def _exchange(order: Indices, a: int, b: int) -> Indices:
    changed = order.copy()
    changed[[a, b]] = order[[b, a]]
    return changed
