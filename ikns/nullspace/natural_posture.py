"""Where the elbow would be at this place of the wrist if the person meant nothing.

A quadratic in the wrist center, learned from ordinary movement and drawn toward what
other people do, and what this person does at particular places beyond it. What departs
from it is what a person means (posture is not intent).
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.errors import InvalidInput
from ikns.nullspace.estimator_base import EstimatorBase
from ikns.nullspace.local_posture import fit_local, local_swivel
from ikns.nullspace.map.checks import checked_rows
from ikns.nullspace.people_posture import natural_posture_people

#: Middle of the work space, m, and the unit of length, m: the quadratic terms are then
#: of order 1 wherever a hand goes (ISB thorax, right arm).
MIDDLE, UNIT = np.array([0.25, -0.15, 0.20]), 0.2
#: What of the taught places counts as taught.
_TAUGHT = 0.99


def quadratic_terms(wrist_in_thorax: ArrayLike) -> Array:
    """Terms 1, x_i, x_i^2 and x_i x_j of positions, (..., 10) for three dimensions.

    Positions (..., 3) in m count from (0.25, -0.15, 0.20) m, in units of 0.2 m; of
    other dimensions they count from zero.
    """
    w = np.asarray(wrist_in_thorax, dtype=np.float64)
    x = (w - MIDDLE if w.shape[-1] == 3 else w) / UNIT
    i, j = np.triu_indices(w.shape[-1], 1)
    return np.concatenate([np.ones((*x.shape[:-1], 1)), x, x**2, x[..., i] * x[..., j]],
                          axis=-1)  # fmt: skip


class NaturalPosture(EstimatorBase):
    """Ridge regression of the hinge swivel on the wrist center, toward a population.

    ``s_nat(w) = phi(w) . beta`` with the terms of :func:`quadratic_terms` and ::

        beta = argmin mean_t (s_t - phi(w_t) . beta)^2 + penalty |beta - beta_people|^2

    in which the constant term is free of the penalty. Where the wrist is in none of the
    places that were taught (its leverage ``h = phi (Phi'Phi / N + penalty)^-1 phi``
    exceeds the 99th percentile h99 of the taught ones), the difference from the
    population fades to its mean by ``h99 / h``: there, other people's data predict
    better than an extrapolated quadratic. Directions that the penalty decides do not
    count.

    What the quadratic leaves at places that were visited is remembered as well
    (:mod:`ikns.nullspace.local_posture`): people come back to them in the same posture.

    :meth:`of_people` is the population's, without any data of the person.

    Parameters
    ----------
    penalty : float
        Weight of the population, above 0. With the default, 20 s of ordinary movement
        outweigh it where they went.
    guard : bool
        Whether the person's own part fades outside what was taught.
    local_penalty : float, optional
        Weight against remembering places, above 0; None remembers none.

    Attributes
    ----------
    coefficients_ : (K,) array
        beta, rad.
    people_ : (K,) array
        beta_people, rad; zeros unless `X` has three columns.
    offset_ : float
        Mean difference from the population over the taught places, rad.
    leverage_ : (K, K) array
        Matrix of the leverage, and of the normal equations.
    taught_leverage_ : float
        h99.
    places_ : (M, D) array
        Wrist centers around which something is remembered, m.
    heights_ : (M,) array
        How much, rad; see :func:`ikns.nullspace.local_posture.fit_local`.
    coverage_ : dict
        What was taught: ``frames``, ``low_m`` and ``high_m`` (1st and 99th percentile
        of each coordinate), ``residual_rad`` (root mean square).

    Examples
    --------
    >>> share = np.random.default_rng(0).uniform(size=(500, 3))
    >>> wrist = [0.1, -0.4, 0.0] + share * [0.3, 0.5, 0.4]
    >>> people = natural_posture_people()
    >>> swivel = quadratic_terms(wrist) @ people.mean + 0.2
    >>> own = NaturalPosture().fit(wrist, swivel)
    >>> bool(np.allclose(own.predict(wrist), swivel)), round(own.offset_, 6)
    (True, 0.2)
    """

    _fitted, _vectors = "coefficients_", False

    def __init__(
        self,
        *,
        penalty: float = 0.03,
        guard: bool = True,
        local_penalty: float | None = 0.01,
    ) -> None:
        self.penalty = penalty
        self.guard = guard
        self.local_penalty = local_penalty

    @classmethod
    def of_people(cls, **parameters: Any) -> Self:
        """Return the population's natural posture, not fitted to a person's movement.

        Parameters are those of the constructor.
        """
        people = natural_posture_people()
        return cls.from_arrays(
            people.mean,
            people.mean,
            people.leverage,
            taught_leverage=people.taught_leverage,
            **parameters,
        )

    @classmethod
    def from_arrays(
        cls,
        coefficients: ArrayLike,
        people: ArrayLike,
        leverage: ArrayLike,
        *,
        taught_leverage: float,
        offset: float = 0.0,
        places: ArrayLike = (),
        heights: ArrayLike = (),
        coverage: dict[str, Any] | None = None,
        **parameters: Any,
    ) -> Self:
        """Make one from its attributes, as from a file; rad, in the wrist's space.

        Raises
        ------
        InvalidInput
            When shapes disagree or values are not finite.
        """
        made = cls(**parameters)
        made.n_features_in_ = 3
        made.coefficients_ = np.array(coefficients, dtype=np.float64)
        made.people_ = np.array(people, dtype=np.float64)
        made.leverage_ = np.array(leverage, dtype=np.float64)
        made.taught_leverage_, made.offset_ = float(taught_leverage), float(offset)
        made.coverage_ = dict(coverage or {"frames": 0})
        made.heights_ = np.array(heights, dtype=np.float64)
        found = np.array(places, dtype=np.float64)
        made.places_ = found if found.size else np.empty((0, 3))
        if made.places_.shape != (made.heights_.size, 3) or made.heights_.ndim != 1:
            raise InvalidInput(
                "expected places (M, 3) and their heights (M,), found "
                f"{made.places_.shape} and {made.heights_.shape}."
            )
        arrays = (made.coefficients_, made.people_, made.leverage_)
        if [array.shape for array in arrays] != [(10,), (10,), (10, 10)]:
            raise InvalidInput(
                "expected 10 coefficients, those of other people and a leverage "
                f"(10, 10), found {', '.join(str(a.shape) for a in arrays)}."
            )
        more = (made.places_, made.heights_, [made.offset_])
        numbers = np.concatenate([*map(np.ravel, arrays), *map(np.ravel, more)])
        if not np.isfinite([*numbers, made.taught_leverage_]).all():
            raise InvalidInput("expected a natural posture of finite numbers.")
        if not made.taught_leverage_ > 0:
            raise InvalidInput("expected a taught leverage above 0.")
        return made

    def fit(
        self, X: ArrayLike, y: ArrayLike, *, people: ArrayLike | None = None
    ) -> Self:
        """Learn from ordinary movement.

        Parameters
        ----------
        X : (N, 3) array
            Wrist centers in the thorax frame, m; of a left arm mirrored to the right.
        y : (N,) array
            Hinge swivel, rad, without jumps of a full turn.
        people : (K,) array, optional
            Other people's coefficients, rad; default those that ship.

        Raises
        ------
        InvalidInput, ValueError
            When the penalty is not above 0, or samples are not finite or do not match.
        """
        w, s = self._validated(X, y, y_numeric=True, dtype=np.float64)
        near = self.local_penalty
        for penalty in (self.penalty, 1.0 if near is None else near):
            if not 0 < penalty < np.inf:
                raise InvalidInput(f"expected a penalty above 0, found {penalty}.")
        s = np.asarray(s, dtype=np.float64)
        phi = quadratic_terms(w)
        others = _people(phi.shape[1], people)
        beyond = s - phi @ others
        self.leverage_, self.taught_leverage_ = leverage_of(phi, self.penalty)
        own = self.leverage_ @ phi.T @ beyond / len(w)
        self.people_, self.coefficients_ = others, others + own
        self.offset_ = float((phi @ own).mean())
        left = beyond - phi @ own
        places, heights = w[:0], s[:0]
        if near is not None:
            places, heights = fit_local(w, left, near)
        self.places_, self.heights_ = places, heights
        left = left - local_swivel(w, self.places_, self.heights_)
        low, high = np.quantile(w, [0.01, 0.99], axis=0)
        self.coverage_: dict[str, Any] = {
            "frames": len(w),
            "low_m": low.tolist(),
            "high_m": high.tolist(),
            "residual_rad": float(np.sqrt(np.mean(left**2))),
        }
        return self

    def swivel(self, wrist_in_thorax: ArrayLike) -> Array:
        """Natural swivel at wrist centers (..., 3) m, (...) rad; NaN where unknown."""
        self._check_fitted()
        rows = checked_rows(wrist_in_thorax, self.n_features_in_, "wrist centers")
        phi = quadratic_terms(rows)
        own = phi @ (self.coefficients_ - self.people_)
        if self.guard:
            beyond = np.maximum(self._leverage(phi) / self.taught_leverage_, 1.0)
            own = self.offset_ + (own - self.offset_) / beyond
        near = local_swivel(rows, self.places_, self.heights_)
        return np.asarray(phi @ self.people_ + own + near)

    def predict(self, X: ArrayLike) -> Array:
        """Return :meth:`swivel` at wrist centers (N, 3), all of them finite, (N,)."""
        self._check_fitted()
        return self.swivel(self._validated(X, dtype=np.float64, reset=False))

    def score(self, X: ArrayLike, y: ArrayLike) -> float:
        """Share of the variance of held-out swivels (N,) that is explained.

        A constant difference counts as explained, since the ends of a range absorb it.
        """
        s = np.asarray(y, dtype=np.float64)
        rest = s - self.predict(X)
        total = float(np.var(s))
        return 1.0 - float(np.var(rest)) / total if total > 0 else 0.0

    def taught(self, X: ArrayLike) -> Mask:
        """Whether wrist centers (..., 3) m lie where movement was taught, (...)."""
        self._check_fitted()
        phi = quadratic_terms(checked_rows(X, self.n_features_in_, "wrist centers"))
        return np.asarray(self._leverage(phi) <= self.taught_leverage_)

    def _leverage(self, phi: Array) -> Array:
        return np.einsum("...i,ij,...j->...", phi, self.leverage_, phi)


def leverage_of(phi: Array, penalty: float) -> tuple[Array, float]:
    """Matrix of the leverage of terms (N, K), (K, K), and its 99th percentile.

    The first term is the constant, which has no penalty.
    """
    k = phi.shape[1]
    free = np.diag(np.r_[0.0, np.full(k - 1, float(penalty))])
    matrix = np.linalg.inv(phi.T @ phi / len(phi) + free)
    levels = np.einsum("ni,ij,nj->n", phi, matrix, phi)
    return matrix, float(np.quantile(levels, _TAUGHT))


def _people(terms: int, given: ArrayLike | None) -> Array:
    """Return other people's coefficients; zeros for other than 3 dimensions."""
    if given is None:
        return natural_posture_people().mean if terms == 10 else np.zeros(terms)
    people = np.array(given, dtype=np.float64)
    if people.shape != (terms,) or not np.isfinite(people).all():
        raise InvalidInput(
            f"expected {terms} finite coefficients of other people, found an array "
            f"{people.shape}."
        )
    return people
