"""Surrogates: data with the variance of each joint, but without covariation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ikns.analysis.ucm.split import VarianceSplit, half_log_ratio, sums_of_squares
from ikns.arrays import Array
from ikns.errors import InvalidInput

#: Differences of dVz up to this are rounding: the same trials summed in another order.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class SurrogateTest:
    """dVz compared with its values if the joints did not covary.

    Parameters
    ----------
    observed : (...) array
        dVz of the data.
    surrogates : (S, ...) array
        dVz of each surrogate.
    p : (...) array
        ``(1 + surrogates at least as large) / (1 + S)``; not corrected for looking at
        several times. NaN where there is no split.
    p_overall : float
        The same for the mean over all (...), which is one test.
    """

    observed: Array
    surrogates: Array
    p: Array
    p_overall: float

    @property
    def mean(self) -> Array:
        """Mean dVz of the surrogates, (...)."""
        return np.asarray(self.surrogates.mean(axis=0))

    def band(self, level: float = 0.95) -> Array:
        """Central range of the surrogates, (2, ...)."""
        edge = (1 - level) / 2
        return np.asarray(np.quantile(self.surrogates, [edge, 1 - edge], axis=0))


def surrogate_test(
    split: VarianceSplit,
    *,
    n_surrogates: int = 1000,
    by: Literal["trials", "shift"] = "trials",
    seed: int | np.random.Generator = 0,
) -> SurrogateTest:
    """Test whether joints covary so that the task is stabilized.

    Each joint is shuffled on its own over the trials, the whole time course with it
    (Muller and Sternad 2003, Biol Cybern 89:22). Mean posture, Jacobian, the variance
    of every joint and its course over time stay; covariance between joints is
    destroyed. The null hypothesis is that joints vary independently of each other; a
    small p says that they covary *and* that this puts more of the variance into the
    null space. It does not say that V_UCM exceeds V_ORT: joints that hardly affect the
    task may be variable without any covariation.

    Parameters
    ----------
    split : VarianceSplit
    n_surrogates : int
        S; the smallest p is 1 / (1 + S).
    by : {"trials", "shift"}
        ``"trials"`` are exchangeable and are shuffled. Samples of one trial are not,
        because neighbors are similar: ``"shift"`` rotates the whole series of each
        joint by a random number of samples.
    seed : int or numpy.random.Generator

    Returns
    -------
    SurrogateTest
        One-sided: large dVz counts.

    Raises
    ------
    InvalidInput
        When `n_surrogates` is below 1 or `by` is neither.

    Examples
    --------
    Two joints that compensate each other, so that their sum is kept:

    >>> from ikns.analysis.ucm import variance_split
    >>> rng = np.random.default_rng(0)
    >>> first = rng.normal(size=30)
    >>> q = np.stack([first, 0.1 * rng.normal(size=30) - first], axis=1)
    >>> surrogate_test(variance_split(q, [[1.0, 1.0]]), n_surrogates=99).p
    np.float64(0.01)
    """
    if n_surrogates < 1 or by not in ("trials", "shift"):
        raise InvalidInput(
            "expected at least 1 surrogate by 'trials' or 'shift', found "
            f"{n_surrogates} by {by!r}."
        )
    rng = np.random.default_rng(seed)
    deviations, seen = split.deviations, split.seen
    n_trials, n = len(deviations), split.n_joints
    flat = deviations.reshape(n_trials, -1, n)
    known = seen.reshape(n_trials, -1)
    basis = split.basis.reshape(-1, *split.basis.shape[-2:])
    drawn = np.empty((n_surrogates, flat.shape[1]))
    complete = bool(known.all())
    rows = np.arange(n_trials)
    for s in range(n_surrogates):
        # A column for each joint.
        if by == "trials":
            order = np.stack([rng.permutation(n_trials) for _ in range(n)], axis=1)
        else:
            order = (rows[:, None] - rng.integers(n_trials, size=n)) % n_trials
        shuffled = np.take_along_axis(flat, order[:, None], axis=0)
        if not complete:
            # Known trials first, in this order, so that they meet known ones.
            unknown = np.swapaxes(~known[order], 1, 2)
            first = np.argsort(unknown, axis=0, kind="stable")
            shuffled = np.take_along_axis(shuffled, first, axis=0)
        drawn[s] = half_log_ratio(*sums_of_squares(shuffled, basis))
    observed = split.delta_vz
    surrogates = drawn.reshape(n_surrogates, *np.shape(observed))
    defined = np.isfinite(drawn).all(axis=0)
    p = (1 + np.sum(surrogates >= observed - _SAME, axis=0)) / (1 + n_surrogates)
    total = observed.reshape(-1)[defined].mean() if defined.any() else np.nan
    beyond = np.sum(drawn[:, defined].mean(axis=1) >= total - _SAME)
    return SurrogateTest(
        observed=observed,
        surrogates=surrogates,
        p=np.where(np.isnan(observed), np.nan, p)[()],
        p_overall=float((1 + beyond) / (1 + n_surrogates)) if defined.any() else np.nan,
    )
