"""Checks of a map's input, and warnings about its samples."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Indices
from ikns.errors import InvalidInput, NotEnoughData

if TYPE_CHECKING:
    from ikns.nullspace.clustering import BoundingBoxKMeans

DOMAINS = ("position", "velocity")
OUTSIDES = ("nearest", "project", "nan")
# Points thinner than this share of their width are flat: 2 cm of 40 cm, about the drift
# of a held hand.
_FLAT = 0.05
# A point with less than this share of an equal part of the samples is left out.
_SHARE = 0.1


class MapWarning(UserWarning):
    """The map was made, but the message needs a look."""


class MapSettings(NamedTuple):
    """Checked parameters of a map."""

    n_dof: int
    variance: float
    quantiles: tuple[float, float]
    reference: Array | None  # (d, n)
    min_samples: int


def checked_settings(parameters: Any, shape: tuple[int, int]) -> MapSettings:
    """Return a map's parameters for samples (N, n), or raise what is wrong."""
    p = parameters
    if len(p.quantiles) != 2 or p.n_points < 1:
        raise InvalidInput(
            f"expected two quantiles and at least one point, found {p.quantiles} and "
            f"n_points={p.n_points}."
        )
    low, high = p.quantiles
    least = p.min_samples
    if least is None:
        least = max(1, int(_SHARE * shape[0] / p.n_points))
    n = shape[1]
    for right, sentence in (
        (1 <= p.n_dof <= n, f"n_dof between 1 and the {n} joints, found {p.n_dof}"),
        (0 < p.variance <= 1, f"variance above 0 and at most 1, found {p.variance}"),
        (
            0 <= low < high <= 1,
            f"quantiles 0 <= low < high <= 1, found {p.quantiles}",
        ),
        (least >= 1, f"min_samples of at least 1, found {least}"),
        (p.domain in DOMAINS, f"domain as one of {DOMAINS}, found '{p.domain}'"),
        (p.outside in OUTSIDES, f"outside as one of {OUTSIDES}, found '{p.outside}'"),
    ):
        if not right:
            raise InvalidInput(f"expected {sentence}.")
    reference = None
    if p.reference is not None:
        reference = np.atleast_2d(np.asarray(p.reference, dtype=np.float64))
        if reference.shape != (p.n_dof, n) or not np.isfinite(reference).all():
            raise InvalidInput(
                f"expected a finite reference of shape ({p.n_dof}, {n}), found "
                f"{reference.shape}."
            )
        if np.linalg.matrix_rank(reference) < p.n_dof:
            raise InvalidInput(
                f"expected a reference with {p.n_dof} independent rows, found "
                f"{np.linalg.matrix_rank(reference)}."
            )
    return MapSettings(p.n_dof, p.variance, (low, high), reference, least)


def checked_rows(rows: ArrayLike, width: int, what: str) -> Array:
    """Return an array (..., width) with NaN for all that is not finite."""
    array = np.asarray(rows, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != width:
        raise InvalidInput(
            f"expected {what} of shape (..., {width}), found {array.shape}."
        )
    return np.where(np.isfinite(array), array, np.nan)


def checked_map(
    centers: ArrayLike, directions: ArrayLike, lower: ArrayLike, upper: ArrayLike
) -> tuple[Array, Array, Array, Array]:
    """Return a map's arrays in full shape, or raise what is wrong with them."""
    places, z = np.array(centers, dtype=float), np.array(directions, dtype=float)
    m, M = np.array(lower, dtype=float), np.array(upper, dtype=float)
    if z.ndim == 2:
        z = z[:, None, :]
    m, M = (end[:, None] if end.ndim == 1 else end for end in (m, M))
    if (
        places.ndim != 2
        or z.ndim != 3
        or not len(places) == len(z)
        or not m.shape == M.shape == z.shape[:2]
    ):
        raise InvalidInput(
            f"expected centers (P, 3), directions (P, d, n), lower and upper (P, d), "
            f"found {places.shape}, {z.shape}, {m.shape} and {M.shape}."
        )
    if not all(np.isfinite(array).all() for array in (places, z, m, M)):
        raise InvalidInput("expected a map of finite numbers, found others.")
    if (m > M).any():
        k = int(np.argwhere(m > M)[0, 0])
        raise InvalidInput(
            f"expected lower <= upper, found {m[k]} and {M[k]} at "
            f"{format_point(places, k)}."
        )
    return places, z, m, M


def checked_velocities(velocity: ArrayLike | None, q: Array) -> Array:
    """Return joint velocities that match joint vectors (N, n)."""
    if velocity is None:
        raise InvalidInput(
            'domain="velocity" needs joint velocities, pass them to fit as velocity.'
        )
    v = np.asarray(velocity, dtype=np.float64)
    if v.shape != q.shape or not np.isfinite(v).all():
        raise InvalidInput(
            f"expected a finite joint velocity for each joint angle {q.shape}, found "
            f"{v.shape} with {np.count_nonzero(~np.isfinite(v))} that are not finite."
        )
    return v


def usable_points(found: BoundingBoxKMeans, need: int) -> list[int]:
    """Points of fitted clusters with at least so many samples; warn about the others.

    Raises
    ------
    NotEnoughData
        When no point is left; and for 4 or more points in space when fewer than 4 are
        left, or all samples or points lie at one place, on one line or in one plane.
    """
    centers, counts = found.cluster_centers_, found.counts_
    natural = centers.shape[1] == 3 and len(centers) >= 4
    if natural:
        _check_volume(2 * found.box_.half_lengths, f"the {counts.sum()} samples")
    used = np.flatnonzero(counts >= need).tolist()
    few = [k for k in range(len(centers)) if k not in used]
    _warn_of_merged(found)
    sentence = (
        f"{len(few)} of {len(centers)} PCA points have fewer than {need} samples and "
        f"are left out: {_too_few(found, few)}"
    )
    if len(used) < (4 if natural else 1):
        raise NotEnoughData(
            f"the map needs {'4 PCA points' if natural else 'a PCA point'}, but "
            f"{sentence}."
        )
    if natural:
        spread = centers[used] - centers[used].mean(axis=0)
        axes = np.linalg.svd(spread, full_matrices=False)[2]
        width = np.ptp(spread @ axes.T, axis=0)
        _check_volume(width, f"the {len(used)} points")
        if width[0] < 2 * found.radius_ or width[2] < found.radius_:
            warnings.warn(
                f"the PCA points are hardly farther apart ({_by(width)} m) than the "
                f"samples around each (radius {found.radius_:.2g} m).",
                MapWarning,
                stacklevel=3,
            )
    if few:
        if not counts[few].all():
            sentence += f"; use {len(used)} points, or record more places"
        warnings.warn(f"{sentence}.", MapWarning, stacklevel=3)
    return used


def _too_few(found: BoundingBoxKMeans, few: list[int]) -> str:
    """Say how many samples points have and why; empty ones together."""
    centers, counts, total = found.cluster_centers_, found.counts_, len(found.labels_)
    if 2 * counts.sum() < total:
        return (
            f"only {counts.sum()} of {total} samples are within the radius of "
            f"{found.radius_:.2g} m; give a larger radius, or none"
        )
    shared = {k for k, *_ in found.merged_}
    empty = [k for k in few if not counts[k] and k not in shared]
    told = []
    if len(empty) == 1:
        told = [
            f"{format_point(centers, empty[0])} has 0, as the hand was not held there"
        ]
    elif empty:
        told = [f"{len(empty)} have 0, as the hand was not held there"]
    told += [
        f"{format_point(centers, k)} has {counts[k]}"
        + ", as it lies between two places" * (k in shared)
        for k in few
        if k not in empty
    ]
    return listed(told)


def _warn_of_merged(found: BoundingBoxKMeans) -> None:
    """Name places that share a point; c there is a mean of what it is at either."""
    shared = [
        f"{format_point(np.array([a, b]), 0)} and {format_point(np.array([a, b]), 1)}"
        for _, a, b in found.merged_
    ]
    if shared:
        warnings.warn(
            f"two places share one PCA point: {listed(shared)}; use as many points "
            "as there are places, or one recording per place.",
            MapWarning,
            stacklevel=4,
        )


def _check_volume(width: Array, what: str) -> None:
    """Refuse points in a plane, on a line or at a place; `width` (3,) m, decreasing."""
    full = np.count_nonzero(width > _FLAT * width[0])
    if full < 3:
        where = ("at one place", "on one line", "in one plane")[full]
        raise NotEnoughData(
            f"the map needs PCA points that span a volume, but {what} lie {where} "
            f"({_by(width)} m)."
        )


def _by(width: Array) -> str:
    return " x ".join(f"{w:.2g}" for w in width)


def warn_of_components(centers: Array, n_components: Indices, n_dof: int) -> None:
    """Warn of points where no joint moves, and of those with too many components."""
    none = [
        format_point(centers, k) for k in np.flatnonzero(n_components == 0).tolist()
    ]
    if none:
        warnings.warn(
            f"no joint moves at {listed(none)}, so these points do not contribute "
            "to c.",
            MapWarning,
            stacklevel=3,
        )
    more = [
        f"{format_point(centers, k)} took {n_components[k]} components"
        for k in np.flatnonzero(n_components > n_dof).tolist()
    ]
    if more:
        warnings.warn(
            f"the recording holds more degrees of freedom than the {n_dof} requested "
            "(the hand turned, the shoulder girdle moved, or noise): at "
            f"{listed(more)}.",
            MapWarning,
            stacklevel=3,
        )


def listed(what: Sequence[str], most: int = 3) -> str:
    """Return the first of them, and how many more there are."""
    more = len(what) - most
    return "; ".join(what[:most]) + (f"; and {more} more" if more > 0 else "")


def format_point(centers: Array, k: int) -> str:
    """Name a point by its position, as numbers change when points are left out."""
    return f"({', '.join(f'{x:.3f}' for x in centers[k])})"
