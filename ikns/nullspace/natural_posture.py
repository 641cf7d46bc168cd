"""Where the elbow would be with the hand like this if the person meant nothing.

A quadratic in the wrist center and a linear function of the hand's direction, learned
from ordinary movement and drawn toward what other people do, and what this person does
at particular places beyond it. What departs from it is what a person means (posture is
not intent).
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
from ikns.nullspace.posture_terms import (
    HAND,
    TERMS,
    WRIST,
    leverage_of,
    natural_terms,
    quadratic_terms,
    ridge,
    wrist_of,
)


class NaturalPosture(EstimatorBase):
    """Ridge regression of the hinge swivel on wrist and hand, toward a population.

    ``s_nat(w, l) = phi(w, l) . beta`` for the wrist center w and the hand's direction l
    with the terms of :func:`ikns.nullspace.posture_terms.natural_terms` and ::

        beta = argmin mean_t (s_t - phi_t . beta)^2 + penalty |beta - beta_people|^2

    in which the constant term is free of the penalty. A turned hand is no wish: what
    reads c replaces l by the direction that the wrist has led
    (:mod:`ikns.nullspace.led_direction`).

    A wrist is where it was taught while its leverage
    ``h = phi (Phi'Phi / N + penalty)^-1 phi``, of the terms of w, does not exceed the
    99th percentile h99 of the taught ones. Elsewhere, with a `guard`, the difference
    from the population in these terms fades to its mean by ``h99 / h``. Directions that
    the penalty decides do not count.

    Fitted to wrist centers alone, (N, 3), it is the quadratic without the hand.

    What the quadratic leaves at places that were visited is remembered as well
    (:mod:`ikns.nullspace.local_posture`): people come back to them in the same posture.

    :meth:`of_people` is the population's, without any data of the person.

    Parameters
    ----------
    penalty : float
        Weight of the population, above 0. With the default, 20 s of ordinary movement
        outweigh it where they went.
    guard : bool
        Whether the person's own part fades outside what was taught. It costs more than
        it saves, even where one task of four was taught (``benchmarks/README.md``), but
        for a posture of the wrist alone.
    local_penalty : float, optional
        Weight against remembering places, above 0; None remembers none.

    Attributes
    ----------
    coefficients_ : (K,) array
        beta, rad.
    people_ : (K,) array
        beta_people, rad; zeros unless `X` has three or six columns.
    offset_ : float
        Mean difference from the population over the taught places, in the wrist's
        terms, rad.
    leverage_ : (10, 10) array
        Matrix of the leverage of the wrist's terms.
    taught_leverage_ : float
        h99.
    places_ : (M, D) array
        Wrist centers around which something is remembered, m.
    heights_ : (M,) array
        How much, rad; see :func:`ikns.nullspace.local_posture.fit_local`.
    coverage_ : dict
        What was taught: ``frames``, ``low_m`` and ``high_m`` (1st and 99th percentile
        of the wrist's coordinates), ``residual_rad`` (root mean square).

    Examples
    --------
    >>> share = np.random.default_rng(0).uniform(size=(500, 3))
    >>> wrist = [0.1, -0.4, 0.0] + share * [0.3, 0.5, 0.4]
    >>> swivel = NaturalPosture.of_people().predict(wrist) + 0.2
    >>> own = NaturalPosture().fit(wrist, swivel)
    >>> bool(np.allclose(own.predict(wrist), swivel)), round(own.offset_, 6)
    (True, 0.2)
    """

    _fitted, _vectors = "coefficients_", False

    def __init__(
        self,
        *,
        penalty: float = 0.03,
        guard: bool = False,
        local_penalty: float | None = 0.01,
    ) -> None:
        self.penalty = penalty
        self.guard = guard
        self.local_penalty = local_penalty

    @classmethod
    def of_people(cls, *, hand: bool = False, **parameters: Any) -> Self:
        """Return the population's natural posture, not fitted to a person's movement.

        With `hand`, of wrist and hand, (N, 6), else of the wrist alone. Other
        parameters are those of the constructor.
        """
        people = natural_posture_people()
        mean = people.mean if hand else people.wrist_alone
        return cls.from_arrays(
            mean,
            mean,
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
        """Make one from its attributes, as from a file; rad.

        Ten coefficients are of the wrist alone, thirteen of wrist and hand.

        Raises
        ------
        InvalidInput
            When shapes disagree or values are not finite.
        """
        made = cls(**parameters)
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
        arrays: tuple[Array, ...] = (made.coefficients_, made.people_, made.leverage_)
        shapes = [array.shape for array in arrays]
        if shapes not in [[(k,), (k,), (10, 10)] for k in TERMS.values()]:
            raise InvalidInput(
                "expected 10 or 13 coefficients, those of other people and a leverage "
                f"(10, 10), found {', '.join(str(shape) for shape in shapes)}."
            )
        made.n_features_in_ = WRIST if len(made.people_) == 10 else HAND
        more = (made.places_, made.heights_)
        numbers = np.concatenate([np.ravel(array) for array in (*arrays, *more)])
        alone = (made.offset_, made.taught_leverage_)
        if not np.isfinite([*numbers, *alone]).all():
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
        X : (N, 6) or (N, 3) array
            Wrist centers in the thorax frame, m, and unit vectors from wrist to
            knuckle; of a left arm mirrored to the right. Or wrist centers alone.
        y : (N,) array
            Hinge swivel, rad, without jumps of a full turn.
        people : (K,) array, optional
            Other people's coefficients, rad; default those that ship.

        Raises
        ------
        InvalidInput, ValueError
            When the penalty is not above 0, or samples are not finite or do not match.
        """
        rows, s = self._validated(X, y, y_numeric=True, dtype=np.float64)
        near = self.local_penalty
        for penalty in (self.penalty, 1.0 if near is None else near):
            if not 0 < penalty < np.inf:
                raise InvalidInput(f"expected a penalty above 0, found {penalty}.")
        s = np.asarray(s, dtype=np.float64)
        w, phi = wrist_of(rows), natural_terms(rows)
        terms = quadratic_terms(w)
        others = _people(phi.shape[1], people)
        beyond = s - phi @ others
        own = ridge(phi, beyond, self.penalty)
        self.leverage_, self.taught_leverage_ = leverage_of(terms, self.penalty)
        self.people_, self.coefficients_ = others, others + own
        self.offset_ = float((terms @ own[: terms.shape[1]]).mean())
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

    def swivel(self, X: ArrayLike) -> Array:
        """Natural swivel of rows as for :meth:`fit` (..., 6), (...) rad; NaN for NaN.

        What was fitted to the wrist alone takes rows with the hand too.
        """
        self._check_fitted()
        rows = self._rows(X)
        phi, k = natural_terms(rows), len(self.leverage_)
        own = self.coefficients_ - self.people_
        smooth, turned = phi[..., :k] @ own[:k], phi[..., k:] @ own[k:]
        if self.guard:
            beyond = self._leverage(phi[..., :k]) / self.taught_leverage_
            smooth = self.offset_ + (smooth - self.offset_) / np.maximum(beyond, 1.0)
        near = local_swivel(wrist_of(rows), self.places_, self.heights_)
        return np.asarray(phi @ self.people_ + smooth + turned + near)

    def predict(self, X: ArrayLike) -> Array:
        """Return :meth:`swivel` of rows (N, 6) or (N, 3), all of them finite, (N,)."""
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
        """Whether the wrists of rows (..., 6) lie where movement was taught, (...)."""
        self._check_fitted()
        phi = quadratic_terms(wrist_of(self._rows(X)))
        return np.asarray(self._leverage(phi) <= self.taught_leverage_)

    def _rows(self, X: ArrayLike) -> Array:
        rows = np.array(X, dtype=np.float64)
        if self.n_features_in_ == WRIST and rows.ndim:
            rows = wrist_of(rows)
        return checked_rows(rows, self.n_features_in_, "places")

    def _leverage(self, phi: Array) -> Array:
        return np.einsum("...i,ij,...j->...", phi, self.leverage_, phi)


def _people(terms: int, given: ArrayLike | None) -> Array:
    """Return other people's coefficients; zeros where there are no other people."""
    if given is None:
        known = natural_posture_people()
        shipped = {len(mean): mean for mean in (known.mean, known.wrist_alone)}
        return shipped.get(terms, np.zeros(terms))
    people = np.array(given, dtype=np.float64)
    if people.shape != (terms,) or not np.isfinite(people).all():
        raise InvalidInput(
            f"expected {terms} finite coefficients of other people, found an array "
            f"{people.shape}."
        )
    return people
