"""Means of subspaces: geodesics on the Grassmann manifold, blind to signs and bases.

A subspace is (d, n) orthonormal rows. Between X and Y lie principal angles t with
principal vectors x, y; the geodesic from X to Y turns each x to its y at a constant
rate, and the distance is the root of the sum of squared angles (Edelman, Arias and
Smith 1998, SIAM J Matrix Anal Appl 20:303). Lines (d = 1) are projective space.
"""

import numpy as np

__all__ = ["exponential", "logarithm", "mean_subspace"]

Array = np.ndarray


def logarithm(X: Array, Y: Array) -> Array:
    """Tangents at X of the geodesics that reach Y at time 1.

    Parameters
    ----------
    X, Y : (..., d, n) array
        Orthonormal rows; leading axes are broadcast.

    Returns
    -------
    (..., d, n) array
        Rows orthogonal to X; their norm is the distance. Where a principal angle is a
        right angle there are two shortest ways, and this is one of them.
    """
    U, cosine, Vt = np.linalg.svd(X @ np.swapaxes(Y, -2, -1))
    x, y = np.swapaxes(U, -2, -1) @ X, Vt @ Y
    off = y - cosine[..., None] * x
    sine = np.linalg.norm(off, axis=-1)
    angle = np.arctan2(sine, cosine)
    rate = np.divide(angle, sine, out=np.ones_like(sine), where=sine > 0)
    return U @ (rate[..., None] * off)


def exponential(X: Array, tangent: Array) -> Array:
    """Where geodesics from X with these tangents are at time 1, (..., d, n)."""
    U, angle, W = np.linalg.svd(tangent, full_matrices=False)
    turned = np.cos(angle)[..., None] * (np.swapaxes(U, -2, -1) @ X)
    return U @ (turned + np.sin(angle)[..., None] * W)


def mean_subspace(
    subspaces: Array, weights: Array, *, tolerance: float = 1e-12, max_iter: int = 50
) -> Array:
    """Karcher means: where weighted squared distances to some subspaces are least.

    Unique where the subspaces are within 45 deg of each other; the iteration starts at
    the leading eigenvectors of the mean projector, which is the mean to second order.

    Parameters
    ----------
    subspaces : (P, d, n) array
        Orthonormal rows.
    weights : (N, P) array
        Each row at least 0 with sum 1.
    tolerance : float
        Ends the iteration: length of the last step, rad.
    max_iter : int
        Most iterations.

    Returns
    -------
    (N, d, n) array
        Orthonormal rows.
    """
    d = subspaces.shape[1]
    projectors = np.swapaxes(subspaces, 1, 2) @ subspaces
    mean = np.tensordot(weights, projectors, axes=1)
    X = np.swapaxes(np.linalg.eigh(mean)[1][..., ::-1], 1, 2)[:, :d]
    for _ in range(max_iter):
        ways = logarithm(X[:, None], subspaces[None])
        step = np.einsum("np,npdk->ndk", weights, ways)
        X = exponential(X, step)
        if np.abs(step).max(initial=0.0) < tolerance:
            break
    return X
