"""A learned map against an analytic one at the points that a motion visits."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.analysis.compare.maps import MapComparison, compare
from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.errors import NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map import NullSpaceMap, analytic_map, null_space_samples


class VisitedComparison(NamedTuple):
    """What :func:`compare_visited` found; V of the map's P points were visited.

    Parameters
    ----------
    counts : (P,) integer array
        Still samples near each point of the map.
    points : (V,) integer array
        Points with at least one, from 0.
    learned, analytic, comparison
        Both maps at these V points, and :func:`compare` of the two.
    """

    counts: NDArray[np.int64]
    points: NDArray[np.int64]
    learned: NullSpaceMap
    analytic: NullSpaceMap
    comparison: MapComparison


def compare_visited(
    learned: NullSpaceMap,
    skeleton: Skeleton,
    motion: Motion,
    *,
    chain: ChainLike = "right_arm",
    task: Literal["pose", "position"] = "pose",
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
) -> VisitedComparison:
    """Compare a map with the analytic one of a motion, which need not visit all points.

    Parameters
    ----------
    learned : NullSpaceMap
        Of `chain`, with a radius: fitted, or from a subject's folder.
    skeleton, motion, chain, task, max_hand_speed, min_duration
        As :func:`compare_motion` takes them.

    Raises
    ------
    NotEnoughData
        When no sample is still, or none near a point.

    Warns
    -----
    MapWarning
        As :func:`ikns.analytic_map`.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, rate=25, quick=True)
    >>> motion, body = run.points.truth, run.subject.skeleton
    >>> learned = ikns.NullSpaceMap(10).fit(*ikns.null_space_samples(motion))
    >>> found = compare_visited(learned, body, motion)
    >>> found.points.tolist(), bool(found.comparison.angles.max() < np.radians(20))
    ([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], True)
    """
    gate: dict[str, Any] = {
        "max_hand_speed": max_hand_speed,
        "min_duration": min_duration,
    }
    x, _ = null_space_samples(motion, chain, **gate)
    near, _ = nearest_center(x, learned.centers_, radius=learned.radius_)
    counts = np.bincount(near[near >= 0], minlength=len(learned.centers_))
    # The analytic map needs samples at each of its points.
    points = np.flatnonzero(counts > 0)
    if not points.size:
        raise NotEnoughData(
            "the hand was never held near a PCA point; use the recording that the map "
            "was learned from, or one with the hand held at its points."
        )
    some = NullSpaceMap.from_arrays(
        learned.centers_[points],
        learned.directions_[points],
        learned.lower_[points],
        learned.upper_[points],
    )
    some.radius_ = learned.radius_
    analytic = analytic_map(
        skeleton,
        motion,
        some.centers_,
        chain=chain,
        task=task,
        radius=learned.radius_,
        n_dof=learned.n_dof,
        **gate,
        reference=some.directions_.sum(axis=0),
    )
    found = compare(
        some,
        analytic,
        motion,
        chain=chain,
        max_hand_speed=max_hand_speed,
        min_duration=min_duration,
    )
    return VisitedComparison(counts, points, some, analytic, found)
