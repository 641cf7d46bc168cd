"""The method: from samples with a still hand to the control signal.

At each PCA point (where the user held the hand and moved the arm) joint vectors q vary
along a direction Z, between m and M. Between the points Z, m and M are interpolated
with the natural-neighbor weights w of the hand position, so that

    c = (Z^ q - m^) / (M^ - m^) = sum_i w_i (Z_i q - m_i) / sum_i w_i (M_i - m_i)

is the mean of the local control signals (Z_i q - m_i) / (M_i - m_i), weighted with w_i
times their range. Z^ is not normalized again: that would break this identity.

T. Lisini Baldi et al. (arXiv 2012.03600), section II.
"""

from __future__ import annotations

from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.nullspace.estimator_base import EstimatorBase
from ikns.nullspace.map.assembly import assemble
from ikns.nullspace.map.checks import (
    checked_map,
    checked_rows,
    checked_settings,
    checked_velocities,
    usable_points,
    warn_of_components,
)
from ikns.nullspace.map.dual import Motions, assemble_dual
from ikns.nullspace.map.interpolator import Interpolation, make_interpolator
from ikns.nullspace.map.score import explained_share
from ikns.numerics.subspace import principal_components


class NullSpaceMap(EstimatorBase):
    """Directions Z and ranges m, M at PCA points, and the control signal between them.

    Fitting: hand positions are clustered
    (:class:`ikns.nullspace.clustering.BoundingBoxKMeans`); in each cluster the
    principal components of the joint vectors that explain at least `variance` are
    summed, each times its explained-variance ratio and a sign, and the sum is
    normalized to Z; m and M are the ends of ``Z @ q``.

    The sign of a component is arbitrary, but opposite directions move a robot in
    opposite ways. So signs are made consistent between neighboring points, strongest
    agreement first (:func:`ikns.nullspace.map.alignment.align`), and the overall sign
    follows from `reference`. For ``n_dof = d > 1`` the directions are the d leading
    components of each point, rotated within their span to agree with its neighbors',
    and together to agree best with the reference. Where natural neighbors are undefined
    (fewer than 4 points, or `X` not in space) the nearest point's values are used.

    Parameters
    ----------
    n_points : int
        PCA points.
    n_dof : int
        Degrees of freedom d to control.
    variance : float
        Share of the variance, in (0, 1], that the components summed to Z explain.
    radius : float, optional
        Samples farther from their centroid are ignored, m; see
        :func:`ikns.nullspace.clustering.nearest_center` for the default.
    domain : {"position", "velocity"}
        Components of joint vectors about their mean, or of joint velocities about zero
        (not their mean: a null space contains zero, and slow drift within it counts).
    outside : {"nearest", "project", "nan"}
        Outside the points' hull: the nearest point's values (the paper's rule; c jumps
        there), those at the nearest position of the hull (continuous), or NaN.
    quantiles : (float, float)
        Quantiles that define m and M; (0, 1) are minimum and maximum.
    max_iter : int
        Most iterations of the clustering.
    reference : (n,) or (d, n) array, optional
        Gradient over the joints of a quantity that increases with c: its dot product
        with the sum of all Z is made positive, row by row. Default: that sum's largest
        entry is.
    interpolation : {"natural", "laplace", "nearest", "smooth"}
        Weights between the points: natural neighbors by volume (the paper's), natural
        neighbors by area (Laplace), all the weight to the nearest point, or a smooth
        field (:class:`ikns.nullspace.map.smooth.SmoothField`), which ignores `outside`.
        Signs agree between natural neighbors with all of them.
    min_samples : int, optional
        Points with fewer samples are left out, with a warning. Default: a tenth of an
        equal share, N / (10 n_points); half a second of 5 s at each point.
    up : (3,) array, optional
        Upward direction, for the ninth and the tenth point, which lie above and below
        the others. Default: Y, as in the thorax frame; a robot's is mostly Z.

    Attributes
    ----------
    centers_ : (P, 3) array
        PCA points in use, m.
    directions_ : (P, d, n) array
        Z; orthonormal rows for each point, but see `fit` for motions.
    lower_, upper_ : (P, d) array
        m and M, rad.
    counts_ : (P,) integer array
        Samples at each point in use.
    labels_ : (N,) integer array
        Point of each sample, -1 for none.
    cluster_means_ : (P, n) array
        Mean joint vectors, rad.
    n_components_ : (P,) integer array
        Components that explain `variance`. More than `n_dof` mean further degrees of
        freedom, with a warning. Zero where no joint moves: Z, m, M are zero too, and
        the point has no influence on c.
    explained_variance_ratio_ : (P, n) array
        Of all components, decreasing.
    all_centers_, all_counts_ : (n_points, 3), (n_points,) array
        All PCA points, including those left out.
    start_ : str
        Where the clusters started: "box", or what kept apart places that share a point
        from there.
    radius_ : float
        Radius used, m. Of a map made from arrays: the parameter, None by default.
    interpolator_ : object
        Weights, hull and neighbors; see :mod:`ikns.nullspace.interpolation`.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> x = np.repeat(corners, 50, axis=0)
    >>> q = np.tile(np.linspace(-1, 1, 50)[:, None] * [0.6, 0.8], (8, 1))
    >>> learned = NullSpaceMap(n_points=8).fit(x, q)
    >>> learned.control_signal([0.3, 0.4], [0.5, 0.5, 0.5]).round(12)
    np.float64(0.75)
    """

    def __init__(
        self,
        n_points: int = 10,
        *,
        n_dof: int = 1,
        variance: float = 0.8,
        radius: float | None = None,
        domain: Literal["position", "velocity"] = "position",
        outside: Literal["nearest", "project", "nan"] = "nearest",
        quantiles: tuple[float, float] = (0.0, 1.0),
        max_iter: int = 300,
        reference: ArrayLike | None = None,
        interpolation: Interpolation = "natural",
        min_samples: int | None = None,
        up: ArrayLike | None = None,
    ) -> None:
        self.n_points = n_points
        self.n_dof = n_dof
        self.variance = variance
        self.radius = radius
        self.domain = domain
        self.outside = outside
        self.quantiles = quantiles
        self.max_iter = max_iter
        self.reference = reference
        self.interpolation = interpolation
        self.min_samples = min_samples
        self.up = up

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        *,
        velocity: ArrayLike | None = None,
        groups: ArrayLike | None = None,
        motions: Motions | None = None,
    ) -> Self:
        """Learn the map from samples whose hand is still.

        Parameters
        ----------
        X : (N, 3) array
            Hand positions in the thorax frame, m.
        y : (N, n) array
            Joint vectors there, rad.
        velocity : (N, n) array, optional
            Joint velocities there, rad/s, for ``domain="velocity"``.
        groups : (N,) integer array, optional
            Which samples are known to be of one place, see
            :meth:`ikns.nullspace.clustering.BoundingBoxKMeans.fit`.
        motions : callable, optional
            From the mean joint vector (n,) of a point to the `n_dof` motions (n_dof, n)
            that the outputs shall read. Z are then the rows within the leading
            components that rise with their own motion and do not see the others
            (:func:`ikns.nullspace.map.dual.dual_rows`), instead of these components;
            of unit length, not orthogonal.

        Raises
        ------
        InvalidInput, ValueError
            When a parameter is out of range, or samples are not finite or do not match.
        NotEnoughData
            With fewer samples than points, too few usable points, or points in a plane;
            when more than a third of the points do not show every motion; fewer are
            named in a warning, and left out where they have no direction.
        """
        from ikns.nullspace.clustering import BoundingBoxKMeans

        x, q = self._validated(X, y, multi_output=True, y_numeric=True)
        x, q = np.asarray(x, float), np.asarray(q, float).reshape(len(x), -1)
        settings = checked_settings(self, q.shape)
        centered = self.domain == "position"
        moves = q if centered else checked_velocities(velocity, q)

        found = BoundingBoxKMeans(
            self.n_points, max_iter=self.max_iter, radius=self.radius, up=self.up
        ).fit(x, groups=groups)
        used = usable_points(found, settings.min_samples)
        centers = found.cluster_centers_[used]
        rows = [np.flatnonzero(found.labels_ == k) for k in used]

        parts = [principal_components(moves[r], centered=centered) for r in rows]
        ratios = np.array([ratio for _, ratio in parts])
        # With a margin for rounding: the last sum is 1, and `variance` may be 1 too.
        short = np.cumsum(ratios, axis=1)[:, :-1] < self.variance - 1e-12
        moving = np.any(ratios, axis=1)
        n_components = np.where(moving, 1 + short.sum(axis=1), 0)
        warn_of_components(centers, n_components, self.n_dof)
        samples = [q[r] for r in rows]
        if motions is not None:
            keep = np.where(moving, np.maximum(n_components, self.n_dof), 0)
            shown, self.directions_, self.lower_, self.upper_ = assemble_dual(
                centers,
                [part[:k] for (part, _), k in zip(parts, keep, strict=True)],
                samples,
                motions,
                n_dof=self.n_dof,
                quantiles=settings.quantiles,
            )
            centers, used = centers[shown], [used[k] for k in shown]
            rows, ratios = [rows[k] for k in shown], ratios[shown]
            n_components = n_components[shown]
        interpolator = make_interpolator(centers, self.outside, self.interpolation)
        if motions is None:
            keep = n_components if self.n_dof == 1 else np.where(moving, self.n_dof, 0)
            self.directions_, self.lower_, self.upper_ = assemble(
                centers,
                [part[:k] for (part, _), k in zip(parts, keep, strict=True)],
                [ratio[:k] for ratio, k in zip(ratios, keep, strict=True)],
                samples,
                settings=settings,
                edges=interpolator.edges,
            )
        self.centers_, self.counts_ = centers, found.counts_[used]
        self.all_centers_, self.all_counts_ = found.cluster_centers_, found.counts_
        self.labels_ = np.full(len(x), -1)
        for k, r in enumerate(rows):
            self.labels_[r] = k
        self.cluster_means_ = np.array([q[r].mean(axis=0) for r in rows])
        self.n_components_, self.explained_variance_ratio_ = n_components, ratios
        self.interpolator_ = interpolator
        self.radius_: float | None = found.radius_
        self.start_ = found.start_
        return self

    @classmethod
    def from_arrays(
        cls,
        centers: ArrayLike,
        directions: ArrayLike,
        lower: ArrayLike,
        upper: ArrayLike,
        *,
        counts: ArrayLike = 0,
        **parameters: Any,
    ) -> Self:
        """Make a map from its arrays: one from a file, or an analytic one.

        Parameters
        ----------
        centers : (P, 3) array
            PCA points, m.
        directions : (P, n) or (P, d, n) array
            Z.
        lower, upper : (P,) or (P, d) array
            m and M, rad; ``lower <= upper``.
        counts : int or (P,) array
            Samples at each point.
        **parameters
            Of the constructor; `n_points` and `n_dof` are those of the arrays.

        Raises
        ------
        InvalidInput, NotEnoughData
            When shapes disagree, values are not finite, a range is negative, the
            interpolation is unknown, or 4 or more points in space lie in a plane.
        """
        places, z, m, M = checked_map(centers, directions, lower, upper)
        made = cls(**{**parameters, "n_points": len(places), "n_dof": z.shape[1]})
        made.n_features_in_ = places.shape[1]
        made.centers_, made.directions_, made.lower_, made.upper_ = places, z, m, M
        made.counts_ = np.full(len(places), counts, dtype=np.int64)
        made.radius_ = made.radius
        made.interpolator_ = make_interpolator(places, made.outside, made.interpolation)
        return made

    def control_signal(self, q: ArrayLike, x: ArrayLike) -> Any:
        """Return the control signal c, not clipped.

        Parameters
        ----------
        q : (..., n) array
            Joint vectors, rad.
        x : (..., 3) array
            Hand positions in the thorax frame, m.

        Returns
        -------
        (...) array, or (..., d) for ``n_dof > 1``
            0 at m, 1 at M. NaN where `q` or `x` is not finite, where the range is zero,
            outside the hull with ``outside="nan"``, and where the weights cannot be
            trusted (:class:`ikns.nullspace.interpolation.NaturalNeighborInterpolator`).
        """
        weights = self._weights(x)
        angles = checked_rows(q, self.directions_.shape[2], "joint vectors")
        local = np.tensordot(angles, self.directions_, axes=(-1, -1)) - self.lower_
        above = np.einsum("...p,...pd->...d", weights, local)
        width = np.broadcast_to(weights @ (self.upper_ - self.lower_), above.shape)
        c = np.full(above.shape, np.nan)
        np.divide(above, width, out=c, where=width > 0)
        return c[..., 0] if self.directions_.shape[1] == 1 else c

    def score(self, X: ArrayLike, y: ArrayLike) -> float:
        """Share of held-out joint vectors' variance that lies along Z, see `fit`.

        Each sample counts to its nearest point, about the mean posture learned there.
        """
        self._check_fitted()
        x = self._validated(X, dtype=np.float64, reset=False)
        q = np.reshape(np.asarray(y, dtype=np.float64), (len(x), -1))
        return explained_share(
            x,
            checked_rows(q, self.directions_.shape[2], "joint vectors"),
            centers=self.centers_,
            means=getattr(self, "cluster_means_", None),
            directions=self.directions_,
        )

    def directions(self, x: ArrayLike) -> Array:
        """Interpolated directions Z^ at hand positions (..., 3), (..., d, n)."""
        return np.tensordot(self._weights(x), self.directions_, axes=1)

    def range(self, x: ArrayLike) -> tuple[Array, Array]:
        """Interpolated ends m^ and M^ at hand positions (..., 3), each (..., d) rad."""
        weights = self._weights(x)
        return weights @ self.lower_, weights @ self.upper_

    def inside(self, x: ArrayLike) -> Mask:
        """Whether hand positions (..., 3) lie in the hull of the points, (...)."""
        self._check_fitted()
        places = checked_rows(x, self.n_features_in_, "hand positions")
        return self.interpolator_.inside(places)

    def _weights(self, x: ArrayLike) -> Array:
        self._check_fitted()
        places = checked_rows(x, self.n_features_in_, "hand positions")
        return self.interpolator_.weights(places)
