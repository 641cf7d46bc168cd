"""The analytic map: null spaces of the Jacobian at the visited postures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ikns.body.chains import ChainLike
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.map.assembly import assemble
from ikns.nullspace.map.checks import checked_settings, format_point
from ikns.nullspace.map.estimator import NullSpaceMap
from ikns.nullspace.map.interpolator import make_interpolator
from ikns.nullspace.map.samples import null_space_samples, still_mask
from ikns.numerics.subspace import mean_null_direction

if TYPE_CHECKING:
    from ikns.body.skeleton import Skeleton


def analytic_map(
    skeleton: Skeleton,
    motion: Motion,
    centers: ArrayLike,
    *,
    chain: ChainLike = "right_arm",
    task: Literal["pose", "position"] = "pose",
    max_hand_speed: float = 0.05,
    min_duration: float = 0.0,
    radius: float | None = None,
    **parameters: Any,
) -> NullSpaceMap:
    """Map of the null spaces of the Jacobian at visited postures.

    At each center Z is the null space of the chain's Jacobian averaged
    (:func:`ikns.numerics.subspace.mean_null_direction`) over the still samples that are
    nearest to this center. m and M are the ends of ``Z @ q`` over the same samples, and
    signs agree as in a learned map.

    Where the null space has more dimensions than `n_dof` (seven joints that hold the
    position alone have four), Z is what varies least between postures, whether or not
    the arm moved that way; a :class:`MapWarning` then names neighbors that disagree.

    Parameters
    ----------
    skeleton : Skeleton
        Owner of the Jacobian.
    motion : Motion
        Motion of the arm.
    centers : (P, 3) array
        PCA points, m; those of a learned map to compare with it.
    chain : str
        See :class:`ikns.Chain`.
    task : {"pose", "position"}
        What is held: hand position and orientation, or position alone.
    max_hand_speed, min_duration : float
        See :func:`ikns.nullspace.map.still_mask`, m/s and s.
    radius : float, optional
        Samples farther from their center are left out, m; the ``radius_`` of a learned
        map to use its samples. Default as in
        :func:`ikns.nullspace.clustering.nearest_center`.
    **parameters
        Of :class:`NullSpaceMap`: `n_dof`, `quantiles`, `outside`, `interpolation`,
        `reference`.

    Returns
    -------
    NullSpaceMap
        With all centers in use, in their order.

    Raises
    ------
    InvalidInput
        When a parameter is out of its range.
    NotEnoughData
        When a center has no still sample, or the centers lie in a plane.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, quick=True
    ... )
    >>> motion, body = run.points.truth, run.subject.skeleton
    >>> learned = NullSpaceMap(10).fit(*null_space_samples(motion))
    >>> analytic = analytic_map(body, motion, learned.centers_)
    >>> analytic.directions_.shape
    (10, 1, 7)
    """
    places = np.asarray(centers, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        raise InvalidInput(f"expected finite centers (P, 3), found {places.shape}.")
    gate = {"max_hand_speed": max_hand_speed, "min_duration": min_duration}
    x, q = null_space_samples(motion, chain, **gate)
    visited = motion.q[still_mask(motion, chain, **gate)]
    made = NullSpaceMap(len(places), **parameters)
    settings = checked_settings(made, q.shape)
    labels, _ = nearest_center(x, places, radius=radius)
    rows = [np.flatnonzero(labels == k) for k in range(len(places))]
    for k, r in enumerate(rows):
        if not r.size:
            raise NotEnoughData(
                f"expected still samples at the point {format_point(places, k)} m, "
                "found none."
            )
    jacobians = skeleton.chain_jacobian(visited, chain, task=task)
    spans = [mean_null_direction(jacobians[r], settings.n_dof)[0] for r in rows]
    arrays = assemble(
        places,
        spans,
        [np.ones(settings.n_dof)] * len(places),
        [q[r] for r in rows],
        settings=settings,
        edges=make_interpolator(places, made.outside).edges,
    )
    counts = np.array([r.size for r in rows])
    return NullSpaceMap.from_arrays(places, *arrays, counts=counts, **parameters)
