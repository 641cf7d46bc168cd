"""Ways from values at PCA points to values in between.

All but one interpolate the entries of Z and the ends m and M alike, as the paper does,
so that c is a mean of the points' own signals; signs agree between the points before.
On the Grassmann manifold Z is the mean of subspaces instead.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.interpolate import LinearNDInterpolator, RBFInterpolator
from scipy.spatial.distance import cdist
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from interpolation.grassmann import mean_subspace

__all__ = ["CONVEX", "LINEAR", "PAPER", "SCHEMES", "THROUGH", "Known", "Local"]

Array = np.ndarray
#: From points (P, 3) and values (P, K) to a function of places (N, 3) with (N, K).
Between = Callable[[Array, Array], Callable[[Array], Array]]


@dataclass(frozen=True)
class Local:
    """Values at N places.

    Parameters
    ----------
    directions : (N, d, n) array
        Z.
    lower, upper : (N, d) array
        m and M, rad.
    """

    directions: Array
    lower: Array
    upper: Array

    def signal(self, q: Array) -> Array:
        """Control signal of joint vectors (N, n), one a place, (N, d)."""
        along = np.einsum("pdk,pk->pd", self.directions, q)
        return (along - self.lower) / (self.upper - self.lower)


@dataclass(frozen=True)
class Known(Local):
    """What was learned at P points.

    Parameters
    ----------
    centers : (P, 3) array
        Where, m.
    postures : (P, n) array
        Mean joint vectors there, rad.
    """

    centers: Array
    postures: Array

    def without(self, point: int) -> "Known":
        """Return the same without one point."""
        rows = np.delete(np.arange(len(self.centers)), point)
        return Known(
            **{name: getattr(self, name)[rows] for name in self.__dataclass_fields__}
        )


def mean_of_all(points: Array, values: Array) -> Callable[[Array], Array]:
    """No interpolation: one mean for every place."""
    return lambda x: np.repeat(values.mean(axis=0)[None], len(x), axis=0)


def nearest_point(points: Array, values: Array) -> Callable[[Array], Array]:
    """Return values of the nearest point."""
    return lambda x: values[cdist(x, points).argmin(axis=1)]


def inverse_distance(points: Array, values: Array) -> Callable[[Array], Array]:
    """Shepard's mean (1968): weights fall with the squared distance."""

    def weights(x: Array) -> Array:
        square = cdist(x, points, "sqeuclidean")
        at = square <= 1e-24  # a picometer: at the point itself
        near = np.where(at.any(axis=1)[:, None], at, 1 / np.where(at, 1.0, square))
        return near / near.sum(axis=1, keepdims=True)

    return lambda x: weights(x) @ values


def tetrahedra(points: Array, values: Array) -> Callable[[Array], Array]:
    """Linear in each Delaunay tetrahedron; outside the hull the nearest point."""
    inside, outside = (
        LinearNDInterpolator(points, values),
        nearest_point(points, values),
    )

    def between(x: Array) -> Array:
        found = inside(x)
        return np.where(np.isnan(found), outside(x), found)

    return between


def natural(
    points: Array, values: Array, *, method: str = "sibson", outside: str = "project"
) -> Callable[[Array], Array]:
    """Natural neighbors."""
    return NaturalNeighborInterpolator(points, values, method=method, outside=outside)


def thin_plate(points: Array, values: Array) -> Callable[[Array], Array]:
    """Thin-plate spline, through the points."""
    return RBFInterpolator(points, values, kernel="thin_plate_spline")


def gaussian_process(points: Array, values: Array) -> Callable[[Array], Array]:
    """Gaussian process whose length and noise are fitted; not through the points.

    Every value is scaled to unit variance; all share one kernel.
    """
    kernel = ConstantKernel(1.0, (1e-2, 1e3)) * RBF(0.3, (0.05, 10.0))
    kernel += WhiteKernel(0.1, (1e-4, 1e1))
    model = GaussianProcessRegressor(kernel, normalize_y=True)
    with warnings.catch_warnings():
        # A length or a noise at its bound is an answer too.
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(points, values)
    return lambda x: model.predict(x).reshape(len(x), -1)


def affine(points: Array, values: Array) -> Callable[[Array], Array]:
    """One linear function of the place for all, by least squares."""
    origin = points.mean(axis=0)
    terms = np.column_stack([np.ones(len(points)), points - origin])
    slopes = np.linalg.lstsq(terms, values, rcond=None)[0]
    return lambda x: np.column_stack([np.ones(len(x)), x - origin]) @ slopes


def componentwise(between: Between, known: Known) -> Callable[[Array], Local]:
    """Interpolate the entries of Z, and m and M."""
    p, d, n = known.directions.shape
    flat = known.directions.reshape(p, d * n)
    inner = between(known.centers, np.hstack([flat, known.lower, known.upper]))

    def at(x: Array) -> Local:
        z, lower, upper = np.split(inner(x), [d * n, d * n + d], axis=1)
        return Local(z.reshape(-1, d, n), lower, upper)

    return at


def grassmann(known: Known) -> Callable[[Array], Local]:
    """Mean subspaces with natural-neighbor weights; m and M are those of their middle.

    A unit direction has no share in the identity that makes c a mean of the points'
    signals, so a range is placed about the interpolated middle of the self-motion:
    ``m, M = Z q - (Z_i q_i - m_i), Z q + (M_i - Z_i q_i)`` with the mean postures q_i.
    """
    net = NaturalNeighborInterpolator(known.centers, outside="project")
    middle = np.einsum("pdk,pk->pd", known.directions, known.postures)
    below, above = middle - known.lower, known.upper - middle

    def at(x: Array) -> Local:
        weights = net.weights(x)
        z = mean_subspace(known.directions, weights)
        # A basis, and for lines a sign, that agrees with the points'.
        u, _, vt = np.linalg.svd(
            np.tensordot(weights, known.directions, axes=1) @ np.swapaxes(z, 1, 2)
        )
        z = (u @ vt) @ z
        center = np.einsum("pdk,pk->pd", z, weights @ known.postures)
        return Local(z, center - weights @ below, center + weights @ above)

    return at


def centered(known: Known) -> Callable[[Array], Local]:
    """Natural neighbors of Z, of the mean posture, and of the range about it."""
    net = NaturalNeighborInterpolator(known.centers, outside="project")
    middle = np.einsum("pdk,pk->pd", known.directions, known.postures)
    below, above = middle - known.lower, known.upper - middle

    def at(x: Array) -> Local:
        weights = net.weights(x)
        z = np.tensordot(weights, known.directions, axes=1)
        center = np.einsum("pdk,pk->pd", z, weights @ known.postures)
        return Local(z, center - weights @ below, center + weights @ above)

    return at


#: What the paper does.
PAPER = "natural neighbor (paper)"
SCHEMES: dict[str, Callable[[Known], Callable[[Array], Local]]] = {
    "mean of all points": partial(componentwise, mean_of_all),
    "nearest point": partial(componentwise, nearest_point),
    "inverse distance": partial(componentwise, inverse_distance),
    "linear in tetrahedra": partial(componentwise, tetrahedra),
    PAPER: partial(componentwise, partial(natural, outside="nearest")),
    "natural neighbor, projected": partial(componentwise, natural),
    "Laplace, projected": partial(componentwise, partial(natural, method="laplace")),
    "smooth (C1), projected": partial(
        componentwise, partial(natural, method="sibson_c1")
    ),
    "Grassmann, projected": grassmann,
    "centered, projected": centered,
    "thin-plate spline": partial(componentwise, thin_plate),
    "Gaussian process": partial(componentwise, gaussian_process),
    "affine least squares": partial(componentwise, affine),
}
#: Those that give back what was learned at a point.
THROUGH = tuple(
    name
    for name in SCHEMES
    if name not in ("mean of all points", "Gaussian process", "affine least squares")
)
#: Those whose values are means with weights from 0 to 1, in or on the hull.
CONVEX = (
    "mean of all points",
    "nearest point",
    "inverse distance",
    "linear in tetrahedra",
    PAPER,
    "natural neighbor, projected",
    "Laplace, projected",
)
#: Those that are exact for values that are linear in space, inside the hull.
LINEAR = (
    "linear in tetrahedra",
    PAPER,
    "natural neighbor, projected",
    "Laplace, projected",
    "smooth (C1), projected",
    "thin-plate spline",
    "affine least squares",
)
