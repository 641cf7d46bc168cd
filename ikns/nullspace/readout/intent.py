"""The control signal that measures what a person means, not how the arm is held.

    c = (s - s_nat(w, l) - a) / (b - a)

s is the hinge swivel (:mod:`ikns.nullspace.hinge_swivel`), s_nat the natural posture
with the wrist center at w and the hand in the direction l
(:mod:`ikns.nullspace.natural_posture`), which counts as the wrist has led it there
(:mod:`ikns.nullspace.led_direction`). a and b come from the lower and upper ends of
s - s_nat at the held places: their middle is a robust mean over the places, their
distance the mean width. Two numbers for the whole range: fields through ends that
scatter would put this scatter back into c. A place at which the natural posture is far
off, or that was half explored, has no say. Where times are known, the ends are those of
the motion without its noise (:mod:`ikns.nullspace.readout.ends`).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.estimator_base import EstimatorBase
from ikns.nullspace.led_direction import LEASH, led_direction
from ikns.nullspace.map.checks import MapWarning, checked_rows, format_point
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.posture_terms import HAND, wrist_of
from ikns.nullspace.readout.ends import checked_times, robust_mean, swept_ends_of

#: A place whose ends are off the mean by more than this share of the range is named.
_HALF_EXPLORED = 0.1
#: A place with less than this share of the usual width has no say in it.
_HALF = 0.6
#: Most places that are named.
_NAMED = 3
#: A place with less than this share of an equal part of the samples is left out.
_SHARE = 0.1


class IntentMap(EstimatorBase):
    """Departure of the hinge swivel from the natural posture, from 0 to 1.

    Parameters
    ----------
    n_points : int
        Held places.
    penalty : float
        Weight of other people in the natural posture, see :class:`NaturalPosture`.
    quantiles : (float, float)
        Quantiles that define the ends at a place; (0, 1) are minimum and maximum. Not
        used where times are known.
    radius : float, optional
        Samples farther from the center of their place are ignored, m; default as in
        :func:`ikns.nullspace.clustering.nearest_center`.
    max_iter : int
        Most iterations of the clustering.
    min_samples : int, optional
        Places with fewer samples are left out; default a tenth of an equal share.
    leash : float
        Of the hand's direction, m; 0 in maps of before, which follow a hand that turns
        where it is, and count what hidden markers shift as an error.

    Attributes
    ----------
    natural_ : NaturalPosture
        The person's; the population's where no natural movement was given.
    centers_ : (P, 3) array
        Wrist centers of the places in use, m.
    lower_, upper_ : (P,) arrays
        Ends of s - s_nat at each place, rad.
    counts_ : (P,) integer array
        Samples at each place.
    labels_ : (N,) integer array
        Place of each sample, -1 for none; of a fitted map only.
    ends_ : (float, float)
        a and b, rad.
    scatter_ : (P,) array
        How far the farther end of each place is from the mean, in units of b - a.

    Examples
    --------
    >>> import numpy as np
    >>> corners = 0.3 * np.array(list(np.ndindex(2, 2, 2))) + [0.1, -0.3, 0.0]
    >>> wrist = np.repeat(corners, 50, axis=0)
    >>> natural = NaturalPosture.of_people()
    >>> meant = np.tile(np.linspace(-0.5, 0.5, 50), 8)
    >>> intent = IntentMap(8).fit(wrist, natural.swivel(wrist) + meant)
    >>> held = natural.swivel([0.3, -0.2, 0.1]) + 0.25
    >>> float(intent.control_signal([held], [0.3, -0.2, 0.1]).round(9))
    0.75
    """

    _fitted, _vectors = "ends_", False

    def __init__(
        self,
        n_points: int = 10,
        *,
        penalty: float = 0.03,
        quantiles: tuple[float, float] = (0.0, 1.0),
        radius: float | None = None,
        max_iter: int = 300,
        min_samples: int | None = None,
        leash: float = LEASH,
    ) -> None:
        self.n_points = n_points
        self.penalty = penalty
        self.quantiles = quantiles
        self.radius = radius
        self.max_iter = max_iter
        self.min_samples = min_samples
        self.leash = leash

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        time: ArrayLike | None = None,
        natural_X: ArrayLike | None = None,
        natural_y: ArrayLike | None = None,
    ) -> Self:
        """Learn the range from held places, and the natural posture from movement.

        Parameters
        ----------
        X : (N, 6) or (N, 3) array
            Wrist centers of samples whose hand is still, thorax frame, m, and unit
            vectors from wrist to knuckle; of a left arm mirrored to the right. Or wrist
            centers alone.
        y : (N,) or (N, 1) array
            Hinge swivel there, rad.
        groups : (N,) integer array, optional
            Which samples are of one place, see
            :meth:`ikns.nullspace.clustering.BoundingBoxKMeans.fit`.
        time : (N,) array, optional
            When each sample was taken, s, increasing; the ends of each place are then
            those of :func:`ikns.nullspace.readout.ends.swept_ends`.
        natural_X, natural_y : (K, 6) or (K, 3), and (K,) arrays, optional
            Places as `X` and swivels of ordinary movement; without them the natural
            posture is that of other people.

        Raises
        ------
        InvalidInput, ValueError
            When a parameter is out of range, or samples are not finite or do not match.
        NotEnoughData
            When no place has enough samples, or the elbow does not move.
        """
        from ikns.nullspace.clustering import BoundingBoxKMeans

        one = np.ndim(y) == 2 and np.shape(y)[1] == 1
        w, s = self._validated(
            X, np.ravel(y) if one else y, y_numeric=True, dtype=np.float64
        )
        least = self._least(len(w))
        found = BoundingBoxKMeans(
            self.n_points, max_iter=self.max_iter, radius=self.radius
        ).fit(wrist_of(w), groups=groups)
        used = np.flatnonzero(found.counts_ >= least)
        if not used.size:
            raise NotEnoughData(
                f"expected a held place with {least} samples or more, found at most "
                f"{found.counts_.max()} (n_samples={len(w)})."
            )
        self.natural_ = self._natural(natural_X, natural_y, width=w.shape[1])
        beyond = wrapped(s - self.natural_.swivel(w))
        rows = [np.flatnonzero(found.labels_ == k) for k in used]
        ends = (
            np.array([np.quantile(beyond[row], self.quantiles) for row in rows])
            if time is None
            else swept_ends_of(beyond, checked_times(time, len(w)), rows)
        )
        self.centers_, self.counts_ = found.cluster_centers_[used], found.counts_[used]
        self.labels_ = np.full(len(w), -1)
        for k, row in enumerate(rows):
            self.labels_[row] = k
        self.lower_, self.upper_ = ends[:, 0], ends[:, 1]
        self._finish()
        return self

    @classmethod
    def from_arrays(
        cls,
        natural: NaturalPosture,
        centers: ArrayLike,
        lower: ArrayLike,
        upper: ArrayLike,
        *,
        counts: ArrayLike = 0,
        **parameters: Any,
    ) -> Self:
        """Make a map from its arrays, as from a file; arguments are the attributes.

        Raises
        ------
        InvalidInput
            When shapes disagree, values are not finite, an upper end is below, or the
            leash is negative.
        """
        places = np.array(centers, dtype=np.float64)
        m, M = np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)
        if (
            places.ndim != 2
            or not len(places)
            or not m.shape == M.shape == (len(places),)
        ):
            raise InvalidInput(
                f"expected centers (P, 3) and ends (P,), found {places.shape}, "
                f"{m.shape} and {M.shape}."
            )
        finite = all(np.isfinite(array).all() for array in (places, m, M))
        if not finite or (m > M).any():
            raise InvalidInput("expected finite ends with lower <= upper.")
        made = cls(**{**parameters, "n_points": len(places)})
        made.n_features_in_ = natural.n_features_in_
        made.natural_, made.centers_, made.lower_, made.upper_ = natural, places, m, M
        made.counts_ = np.full(len(places), counts, dtype=np.int64)
        made._finish()
        return made

    def control_signal(self, q: ArrayLike, x: ArrayLike) -> Array:
        """Return the control signal c, not clipped.

        Parameters
        ----------
        q : (..., 1) array
            Hinge swivel, rad.
        x : (..., 6) or (..., 3) array
            As for :meth:`fit`; what was fitted to the wrist alone takes both. Each row
            is taken as if the hand had been led there; of a motion, see :meth:`led`.

        Returns
        -------
        (...) array
            0 at the lower end, 1 at the upper; NaN where an input is not finite.
        """
        self._check_fitted()
        s = checked_rows(q, 1, "swivels")[..., 0]
        a, b = self.ends_
        return np.asarray((wrapped(s - self.natural_.swivel(x)) - a) / (b - a))

    def led(self, x: ArrayLike) -> Array:
        """Rows (T, 6) of a motion, in order of time, with directions as they count."""
        self._check_fitted()
        rows = np.array(x, dtype=np.float64)
        if self.natural_.n_features_in_ != HAND:
            return rows
        return led_direction(rows, self.leash)

    def inside(self, x: ArrayLike) -> Mask:
        """Whether natural movement was taught at the wrists of rows (..., 6), (...)."""
        self._check_fitted()
        return self.natural_.taught(x)

    def score(self, X: ArrayLike, y: ArrayLike) -> float:
        """One minus the share of c's variance that the wrist position explains.

        On held-out samples as for :meth:`fit`: 1 where c does not follow the hand.
        """
        self._check_fitted()
        w = self._validated(X, dtype=np.float64, reset=False)
        c = self.control_signal(np.reshape(y, (len(w), 1)), w)
        w = wrist_of(w)
        terms = np.column_stack([np.ones(len(w)), w - w.mean(axis=0)])
        rest = c - terms @ np.linalg.lstsq(terms, c, rcond=None)[0]
        total = float(np.var(c))
        return float(np.var(rest)) / total if total > 0 else 0.0

    def _least(self, n: int) -> int:
        low, high = self.quantiles
        least = self.min_samples
        if least is None:
            least = max(1, int(_SHARE * n / max(self.n_points, 1)))
        if not 0 <= low < high <= 1 or least < 1:
            raise InvalidInput(
                f"expected quantiles 0 <= low < high <= 1 and min_samples of at least "
                f"1, found {self.quantiles} and {least}."
            )
        return least

    def _natural(
        self, X: ArrayLike | None, y: ArrayLike | None, *, width: int
    ) -> NaturalPosture:
        if (X is None) != (y is None):
            raise InvalidInput("natural_X and natural_y go together.")
        natural = NaturalPosture(penalty=self.penalty)
        if X is not None and y is not None:
            return natural.fit(X, y)
        if width in (3, 6):
            return NaturalPosture.of_people(hand=width == 6, penalty=self.penalty)
        # There are no other people in another space.
        return natural.fit(np.zeros((1, width)), [0.0])

    def _finish(self) -> None:
        """Set the mean ends, and name places that were half explored."""
        if not 0 <= self.leash < np.inf:
            raise InvalidInput(f"expected a leash of 0 m or more, found {self.leash}.")
        widths = self.upper_ - self.lower_
        width = float(widths[widths >= _HALF * np.median(widths)].mean())
        middle = robust_mean((self.lower_ + self.upper_) / 2)
        a, b = middle - width / 2, middle + width / 2
        if not width > 0:
            raise NotEnoughData(
                "expected held places at which the elbow turns, found none "
                f"(n_features={self.n_features_in_})."
            )
        self.ends_ = (a, b)
        off = np.maximum(np.abs(self.lower_ - a), np.abs(self.upper_ - b))
        self.scatter_ = off / (b - a)

    def warn_of_scatter(self, names: Sequence[str] | None = None) -> None:
        """Name places whose ends are more than 0.1 of the range from their mean.

        Those that are also narrow were half explored; at the others the natural posture
        is off. `names` (P,) are the names of the places, by default their positions.
        """
        width = self.upper_ - self.lower_
        narrow = width < (1 - _HALF_EXPLORED) * (self.ends_[1] - self.ends_[0])
        wide = self.scatter_ > _HALF_EXPLORED
        for which, why, remedy in (
            (wide & narrow, "the elbow turned only part of the way, and an end of the "
             "swing is", "hold the hand there again, and turn the elbow to both ends"),
            (wide & ~narrow, "the elbow swings about a posture other than the natural "
             "one, and an end of the swing is", "record ordinary movement there too"),
        ):  # fmt: skip
            worst = [k for k in np.argsort(-self.scatter_).tolist() if which[k]]
            if not worst:
                continue
            told = worst[:_NAMED]
            at = _list(names[k] if names else format_point(self.centers_, k)
                       for k in told)  # fmt: skip
            by = _list(f"{self.scatter_[k]:.2f}" for k in told)
            more = len(worst) - len(told)
            warnings.warn(
                f"at {at}{f' (and {more} more)' * (more > 0)} {why} {by} of the range "
                f"from where it is at the other points; {remedy}.",
                MapWarning,
                stacklevel=2,
            )


def _list(words: Iterable[str]) -> str:
    """Join words as in a sentence: point 6, point 7 and point 2."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def wrapped(angle: Array) -> Array:
    """Angles in [-pi, pi), rad."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
