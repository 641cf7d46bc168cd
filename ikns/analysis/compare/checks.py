"""Checks of the samples of a comparison."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.map.checks import checked_map
from ikns.numerics.subspace import null_spaces


class CheckedSamples(NamedTuple):
    """Samples and directions in full shape; see :func:`compare_samples`.

    `rows` are the samples of each point, `bases` (N, null_dim, n) the null space of
    each sample.
    """

    q: Array
    jacobians: Array
    bases: Array
    position: Array
    rotation: Array
    rows: list[NDArray[np.int64]]
    directions: Array
    lower: Array
    upper: Array
    null_dim: int


def checked_samples(
    time: ArrayLike,
    q: ArrayLike,
    jacobians: ArrayLike,
    position: ArrayLike,
    rotation: ArrayLike,
    labels: ArrayLike,
    directions: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
) -> CheckedSamples:
    """Return the samples in full shape, or raise what is wrong with them."""
    t, angles, J, x, R = (
        np.asarray(given, dtype=np.float64)
        for given in (time, q, jacobians, position, rotation)
    )
    near = np.asarray(labels)
    places = np.zeros((len(np.asarray(directions)), 3))
    _, Z, m, M = checked_map(places, directions, lower, upper)
    P, d, n = Z.shape
    N = len(t)
    shapes = (t.shape, angles.shape, J.shape, x.shape, R.shape, near.shape)
    if J.ndim != 3 or shapes != (
        (N,), (N, n), (N, J.shape[1], n), (N, 3), (N, 3, 3), (N,)
    ):  # fmt: skip
        raise InvalidInput(
            f"expected time (N,), q (N, {n}), Jacobians (N, k, {n}), positions (N, 3), "
            f"rotations (N, 3, 3) and labels (N,) for directions of {n} joints, found "
            f"{', '.join(map(str, shapes))}."
        )
    if not all(np.isfinite(given).all() for given in (t, angles, J, x, R)):
        raise InvalidInput("expected samples of finite numbers, found others.")
    if (np.diff(t) <= 0).any():
        raise InvalidInput(
            f"expected increasing time, found {t[np.argmax(np.diff(t) <= 0) + 1]:g} s "
            "after a later or equal one."
        )
    if near.size and (near.max() >= P or not np.issubdtype(near.dtype, np.integer)):
        raise InvalidInput(
            f"expected labels as integers below the {P} points, found {near.max()}."
        )
    rows = [np.flatnonzero(near == k) for k in range(P)]
    used = np.concatenate(rows)
    if not used.size:
        raise NotEnoughData("expected samples at a PCA point, found none.")
    few = [k for k in range(P) if len(rows[k]) < 2 * n]
    if few:
        raise NotEnoughData(
            f"expected at least {2 * n} samples of {n} joints at each PCA point, found "
            f"{len(rows[few[0]])} at point {few[0] + 1}."
        )
    moved = np.ptp(angles[used], axis=0)
    if not (moved > 1e-9).all():
        raise NotEnoughData(
            f"expected joints that move, found the {int(np.argmin(moved)) + 1}. of "
            f"{n} constant."
        )
    bases, rank = null_spaces(J)
    full = int(rank[used].max())
    if full == 0:
        raise InvalidInput(
            "expected a chain that ends in the hand, found Jacobians of zeros."
        )
    lost = used[rank[used] < full]
    if lost.size:
        raise InvalidInput(
            f"expected Jacobians of rank {full}, found rank {rank[lost[0]]} in "
            f"{lost.size} of {used.size} samples, first at {t[lost.min()]:g} s."
        )
    if full == n:
        raise InvalidInput(
            f"expected fewer task dimensions than the {n} joints, found Jacobians of "
            f"rank {full} and no null space."
        )
    bases = bases[:, : n - full]
    return CheckedSamples(angles, J, bases, x, R, rows, Z, m, M, n - full)
