"""The variance split: joint variance along the task's null space, and across it.

With n joints, k task variables and d = n - k, over N trials with deviations ``e`` from
the mean posture and P the projector on the null space of the Jacobian there::

    V_UCM = sum |P e|^2 / (d (N - 1))        V_ORT = sum |e - P e|^2 / (k (N - 1))
    V_TOT = (d V_UCM + k V_ORT) / n          dV    = (V_UCM - V_ORT) / V_TOT

dV is n/d when V_ORT is zero and -n/k when V_UCM is zero. The Fisher-like transform
between these bounds (Verrel 2010, J Neurosci Methods 191:166) is half a log ratio::

    dVz = ln[(n/k + dV) / (n/d - dV)] / 2 = ln[d V_UCM / (k V_ORT)] / 2

Without structure (V_UCM = V_ORT) it is ln(d/k)/2, not zero; ``delta_vz_corrected`` is
``ln[V_UCM / V_ORT] / 2``, which is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.analysis.ucm.deviations import check_joints, check_trials, mean_jacobian
from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.numerics.subspace import null_spaces

#: A part of the squares below this share is what rounding leaves of zero: a deviation
#: is projected with an error of some 1e-15 of its length, so its square with 1e-30.
_ROUNDING = 1e-28


@dataclass(frozen=True, eq=False)
class VarianceSplit:
    """Joint variance along and across the null space of a task.

    Leading axes (...) are those of the given angles after the first, such as time.

    Parameters
    ----------
    v_ucm, v_ort : (...) array
        Variance per degree of freedom, rad^2 (or the square of the joints' unit); NaN
        where the Jacobian loses rank or trials are too few.
    n_joints, n_task : int
        n and k.
    trials : (...) integer array
        How many entered.
    rank : (...) integer array
        Of the Jacobian; -1 where it is not finite.
    deviations : (N, ..., n) array
        Of each trial from the mean posture; zero where `seen` is false.
    seen : (N, ...) boolean array
        Trials whose joints are all known.
    basis : (..., n - k, n) array
        Orthonormal rows spanning the null space; NaN where there is no split.
    """

    v_ucm: Array
    v_ort: Array
    n_joints: int
    n_task: int
    trials: NDArray[np.int64]
    rank: NDArray[np.int64]
    deviations: Array
    seen: NDArray[np.bool_]
    basis: Array

    @property
    def v_tot(self) -> Array:
        """Variance per joint, (...)."""
        k = self.n_task
        return ((self.n_joints - k) * self.v_ucm + k * self.v_ort) / self.n_joints

    @property
    def delta_v(self) -> Array:
        """(V_UCM - V_ORT) / V_TOT, (...), from -n/k to n/(n - k)."""
        with np.errstate(invalid="ignore"):
            share: Array = (self.v_ucm - self.v_ort) / self.v_tot
            return share

    @property
    def delta_vz(self) -> Array:
        """Log-transformed `delta_v`, (...); infinite at its bounds."""
        k = self.n_task
        return half_log_ratio((self.n_joints - k) * self.v_ucm, k * self.v_ort)

    @property
    def delta_vz_corrected(self) -> Array:
        """`delta_vz` less its value without structure, ln(d/k)/2, (...)."""
        return half_log_ratio(self.v_ucm, self.v_ort)

    @property
    def no_structure(self) -> float:
        """`delta_vz` of equal V_UCM and V_ORT, ln(d/k)/2."""
        return math.log((self.n_joints - self.n_task) / self.n_task) / 2

    @property
    def rank_lost(self) -> NDArray[np.bool_]:
        """Where the Jacobian has less than full rank or is not finite, (...)."""
        return np.asarray(self.rank < self.n_task)


def variance_split(
    q: ArrayLike,
    jacobian: ArrayLike | Callable[[Array], Array],
    *,
    at: Literal["mean", "visited"] = "mean",
    min_trials: int | None = None,
    joint_names: Sequence[str] | None = None,
    rtol: float = 1e-9,
) -> VarianceSplit:
    """Split joint variance over the first axis along and across a task's null space.

    Across trials: `q` is (trials, T, n) with time normalized, and the result has one
    entry per time. Within a trial: `q` is (N, n), the samples of one trial or of one
    held posture, and the result is a single split.

    Parameters
    ----------
    q : (N, ..., n) array
        Joint angles, rad; NaN where unknown. A trial counts where all its joints are
        known.
    jacobian : array or callable
        Of the task, k rows. As an array (k, n) it holds everywhere (a weighted sum of
        joints is a row of weights); (..., k, n) is that of the mean postures; (N, ...,
        k, n) has one per posture and is averaged over the trials. A callable takes
        postures (..., n) and returns (..., k, n); see
        :func:`ikns.analysis.ucm.chain_task` and
        :func:`ikns.analysis.ucm.numerical_task`.
    at : {"mean", "visited"}
        Where a callable is evaluated: at the mean posture, as is usual, or at every
        posture, averaged.
    min_trials : int, optional
        Smallest number of trials. Default: n + 1, the least for which the covariance of
        n joints can have full rank. The split alone needs 2.
    joint_names : sequence of n str, optional
        For messages.
    rtol : float
        See :func:`ikns.numerics.subspace.null_spaces`.

    Returns
    -------
    VarianceSplit
        With NaN where some time has too few known trials or its Jacobian loses rank.

    Raises
    ------
    InvalidInput
        When shapes disagree, angles are infinite, the task has as many variables as
        there are joints, or the Jacobian has full rank nowhere.
    NotEnoughData
        When trials are too few, or a joint never moves.

    Notes
    -----
    Joint variance depends on the joints' units and coordinates, and so does the split:
    it does not change when joint axes are rotated into each other, nor with the choice
    of task coordinates.

    Examples
    --------
    Three joints whose sum is the task. Here every trial has the same sum:

    >>> q = [[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [2.0, 0.0, -2.0]]
    >>> split = variance_split(q, [[1.0, 1.0, 1.0]])
    >>> split.delta_v.round(12), split.delta_vz
    (np.float64(1.5), np.float64(inf))
    """
    angles = np.asarray(q, dtype=np.float64)
    seen = check_trials(angles)
    n = angles.shape[-1]
    least = n + 1 if min_trials is None else min_trials
    if least < 2:
        raise InvalidInput(f"expected min_trials of at least 2, found {least}.")
    trials = np.count_nonzero(seen, axis=0)
    if trials.max() < least:
        raise NotEnoughData(
            f"expected at least {least} trials with every joint known for {n} joints, "
            f"found {trials.max()}."
        )
    check_joints(angles, seen, joint_names)
    kept = np.where(seen[..., None], angles, 0.0)
    with np.errstate(invalid="ignore"):
        mean = kept.sum(axis=0) / trials[..., None]
    J = mean_jacobian(jacobian, angles, mean, seen, at=at)
    k = J.shape[-2]
    if k >= n:
        raise InvalidInput(
            f"expected a task of fewer variables than the {n} joints, found {k}: "
            "nothing is left uncontrolled."
        )
    basis, rank = null_spaces(J, rtol=rtol)
    tried = rank[trials >= least]
    if tried.max() < k:
        raise InvalidInput(
            f"expected a Jacobian of rank {k}, as it has {k} rows, but found "
            + (f"rank {tried.max()} at most" if tried.max() >= 0 else "none finite")
            + f" over {tried.size} mean posture{'s' * (tried.size > 1)}."
        )
    known = (rank == k) & (trials >= least)
    basis = np.where(known[..., None, None], basis[..., : n - k, :], np.nan)
    deviations = np.where(seen[..., None], angles - mean, 0.0)
    ucm, ort = sums_of_squares(deviations, basis)
    with np.errstate(divide="ignore", invalid="ignore"):
        v_ucm, v_ort = (
            np.where(known, part / (freedom * (trials - 1)), np.nan)
            for part, freedom in ((ucm, n - k), (ort, k))
        )
    return VarianceSplit(
        v_ucm[()], v_ort[()], n, k, trials, rank, deviations, seen, basis
    )


def delta_vz(delta_v: ArrayLike, *, n_joints: int, n_task: int) -> Array:
    """Log-transform of dV between its bounds -n/k and n/(n - k).

    Parameters
    ----------
    delta_v : array
    n_joints, n_task : int
        n and k.

    Raises
    ------
    InvalidInput
        When k is not between 1 and n - 1, or a value lies outside the bounds.

    Examples
    --------
    >>> delta_vz([-1.5, 0.0, 3.0], n_joints=3, n_task=2).round(4)
    array([   -inf, -0.3466,     inf])
    """
    if not 0 < n_task < n_joints:
        raise InvalidInput(
            f"expected 0 < n_task < n_joints, found {n_task} and {n_joints}."
        )
    value = np.asarray(delta_v, dtype=np.float64)
    lower, upper = -n_joints / n_task, n_joints / (n_joints - n_task)
    slack = 1e-12 * (upper - lower)
    if (value < lower - slack).any() or (value > upper + slack).any():
        raise InvalidInput(
            f"expected delta V from {lower:g} to {upper:g} for {n_joints} joints and "
            f"{n_task} task variables, found {np.nanmin(value):g} to "
            f"{np.nanmax(value):g}."
        )
    inside = np.clip(value, lower, upper)
    return half_log_ratio(inside - lower, upper - inside)


def parts(deviations: Array, basis: Array) -> tuple[Array, Array]:
    """Deviations (N, ..., n) along a basis, (N, ..., n - k), and the rest of them."""
    rows = np.moveaxis(deviations, 0, -2)
    along = rows @ np.swapaxes(basis, -2, -1)
    # What is left over is exact to rounding, unlike a difference of squares.
    rest = rows - along @ basis
    return np.moveaxis(along, -2, 0), np.moveaxis(rest, -2, 0)


def sums_of_squares(deviations: Array, basis: Array) -> tuple[Array, Array]:
    """Squared length over all trials along the null space and across it, (...)."""
    along, rest = (np.sum(p**2, axis=(0, -1)) for p in parts(deviations, basis))
    least = _ROUNDING * (along + rest)
    return np.where(along <= least, 0.0, along), np.where(rest <= least, 0.0, rest)


def half_log_ratio(a: Array, b: Array) -> Array:
    """``ln(a / b) / 2``; infinite where one is zero, NaN where both are."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: Array = (np.log(a) - np.log(b)) / 2
        return ratio
