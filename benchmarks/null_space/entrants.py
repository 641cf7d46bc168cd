"""Entrants: estimators from held places to c. Enter your own with ``--method``.

An entrant is a class without required arguments, like those of scikit-learn:

    class Mine:
        reads = "joints"  # or "swivel"; default "joints"

        def fit(self, X, y, *, groups, natural_X, natural_y):
            ...
            return self

        def control_signal(self, y, X):
            return c

``X`` (N, 3) are hand positions in m and ``y`` (N, 7) joint angles in rad of samples
whose hand is still; with ``reads = "swivel"`` they are wrist centers and hinge swivels
(N, 1). ``groups`` (N,) says which of the held places each sample is of; ``natural_X``
and ``natural_y`` are of 20 s of ordinary movement. ``c`` (T,) is 0 at one end of what
was explored and 1 at the other; where it falls as the swivel rises, the bench turns it
round. ``needs_body = True`` asks for a constructor
that takes ``skeleton`` and ``chain`` (an :class:`ikns.Skeleton`).
"""

import importlib
import warnings
from functools import partial
from typing import Any

import numpy as np
from interpolation.schemes import (
    Known,
    componentwise,
    gaussian_process,
    grassmann,
    natural,
    thin_plate,
)
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.numerics.subspace import mean_null_direction

Array = np.ndarray


def directions(y: Array, groups: Array) -> Array:
    """First principal component at each place (P, n), signs alike."""
    rows = np.array(
        [
            np.linalg.svd(y[groups == k] - y[groups == k].mean(axis=0))[2][0]
            for k in range(groups.max() + 1)
        ]
    )
    return alike(rows)


def alike(rows: Array) -> Array:
    """Rows (P, n) with the signs of their leading common direction."""
    common = np.linalg.eigh(rows.T @ rows)[1][:, -1]
    return rows * np.where(rows @ common < 0, -1.0, 1.0)[:, None]


def known(X: Array, y: Array, groups: Array, Z: Array) -> Known:
    """Directions, their ranges and mean postures at the places."""
    each = [groups == k for k in range(len(Z))]
    along = [y[rows] @ z for rows, z in zip(each, Z, strict=True)]
    return Known(
        Z[:, None],
        np.array([[a.min()] for a in along]),
        np.array([[a.max()] for a in along]),
        np.array([X[rows].mean(axis=0) for rows in each]),
        np.array([y[rows].mean(axis=0) for rows in each]),
    )


class _Between:
    """Directions and ranges at the places, and a scheme between them."""

    reads, scheme = "joints", staticmethod(partial(componentwise, natural))

    def fit(self, X: Array, y: Array, *, groups: Array, **_: Any) -> "_Between":
        """Learn from held places."""
        self.at_ = self.scheme(known(X, y, groups, directions(y, groups)))
        return self

    def control_signal(self, y: Array, X: Array) -> Array:
        """Return c (T,)."""
        c, seen = np.full(len(y), np.nan), np.isfinite(y).all(axis=1)
        if seen.any():
            c[seen] = self.at_(X[seen]).signal(y[seen])[:, 0]
        return c


class ThinPlates(_Between):
    """Thin plates through Z, m and M."""

    scheme = staticmethod(partial(componentwise, thin_plate))


class Grassmann(_Between):
    """Mean subspaces between natural neighbors."""

    scheme = staticmethod(grassmann)


class GaussianProcess(_Between):
    """Gaussian process of Z, m and M, with noise fitted."""

    scheme = staticmethod(partial(componentwise, gaussian_process))


class Jacobian(_Between):
    """Null directions of the fitted body's Jacobian at the places, nothing learned."""

    needs_body = True

    def __init__(self, skeleton: Skeleton, chain: str) -> None:
        names = skeleton.joint_names
        self._columns = [names.index(joint) for joint in chain_joints(chain)]
        self._skeleton, self._chain = skeleton, chain

    def fit(self, X: Array, y: Array, *, groups: Array, **_: Any) -> "Jacobian":
        """Learn from held places."""
        rows = []
        for k in range(groups.max() + 1):
            here = y[groups == k][::10]
            angles = np.zeros((len(here), len(self._skeleton.joint_names)))
            angles[:, self._columns] = here
            J = [self._skeleton.chain_jacobian(a, self._chain) for a in angles]
            rows.append(mean_null_direction(np.array(J))[0][0])
        self.at_ = self.scheme(known(X, y, groups, alike(np.array(rows))))
        return self


class Swivel:
    """Hinge swivel between its mean ends over the places."""

    reads = "swivel"

    def fit(self, X: Array, y: Array, *, groups: Array, **_: Any) -> "Swivel":
        """Learn from held places."""
        parts = [y[groups == k] for k in range(groups.max() + 1)]
        self.low_ = np.mean([part.min() for part in parts])
        self.high_ = np.mean([part.max() for part in parts])
        return self

    def control_signal(self, y: Array, X: Array) -> Array:
        """Return c (T,)."""
        return (y[:, 0] - self.low_) / (self.high_ - self.low_)


class Autoencoder:
    """Two latents of a multilayer perceptron that gives back the joint angles.

    c is the affine function of hand, latents and their products that is nearest to 0 at
    one end and 1 at the other of each place.
    """

    reads = "joints"

    def fit(
        self, X: Array, y: Array, *, groups: Array, natural_y: Array, **_: Any
    ) -> "Autoencoder":
        """Learn from held places."""
        rows = np.vstack([y[::4], natural_y[::4]])
        self.mean_, self.scale_ = rows.mean(axis=0), rows.std(axis=0) + 1e-9
        self.net_ = MLPRegressor(
            hidden_layer_sizes=(24, 2, 24),
            activation="tanh",
            max_iter=400,
            alpha=1e-3,
            random_state=0,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            z = (rows - self.mean_) / self.scale_
            self.net_.fit(z, z)
        share = np.empty(len(y))
        for k, z in enumerate(directions(y, groups)):
            along = y[groups == k] @ z
            share[groups == k] = (along - along.min()) / np.ptp(along)
        self.middle_ = X.mean(axis=0)
        self.slopes_ = np.linalg.lstsq(self._terms(y, X), share, rcond=None)[0]
        return self

    def _terms(self, y: Array, X: Array) -> Array:
        hidden = (y - self.mean_) / self.scale_
        for W, b in zip(self.net_.coefs_[:2], self.net_.intercepts_[:2], strict=True):
            hidden = np.tanh(hidden @ W + b)
        x = X - self.middle_
        both = (hidden[:, :, None] * x[:, None]).reshape(len(x), -1)
        return np.hstack([np.ones((len(x), 1)), hidden, x, both])

    def control_signal(self, y: Array, X: Array) -> Array:
        """Return c (T,)."""
        return self._terms(y, X) @ self.slopes_


#: Methods of the package, by what calibrates them; the others by their class.
PACKAGE = ("paper", "proximal", "intent")
SHIPPED: dict[str, type] = {
    "swivel": Swivel,
    "Jacobian": Jacobian,
    "thin plates": ThinPlates,
    "Grassmann": Grassmann,
    "Gaussian process": GaussianProcess,
    "autoencoder": Autoencoder,
}


def entrant(name: str) -> type | str:
    """Return the class of ``module:Class``, a shipped one, or a package's method.

    Raises
    ------
    SystemExit
        When there is none of that name.
    """
    if name in PACKAGE:
        return name
    if name in SHIPPED:
        return SHIPPED[name]
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise SystemExit(
            f"no entrant '{name}' ({error}): give module:Class, or one of "
            f"{', '.join([*PACKAGE, *SHIPPED])}"
        ) from None
