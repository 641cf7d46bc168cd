"""Directions that each read one known motion and leave the others alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.map.checks import format_point

#: From a joint vector (n,), rad, to d motions (d, n) of the joints there.
Motions = Callable[[Array], Array]

#: So many of the joint vectors at a place, at least, say how its motions go.
_VISITED = 20
#: A motion was not explored if less than this share (cosine) is within what was.
_EXPLORED = 0.2


def dual_rows(components: Array, motions: Array) -> Array:
    """Rows in a span that are dual to motions: ``rows @ motions.T`` is the identity.

    Each row gives 1 for its own motion and 0 for the others; of all such rows in the
    span these are the shortest.

    Parameters
    ----------
    components : (k, n) array
        Orthonormal rows, the span; k of at least d.
    motions : (d, n) array
        Independent motions, rad.

    Returns
    -------
    (d, n) array
        NaN where the span does not show every motion by itself.

    Examples
    --------
    >>> motions = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    >>> rows = dual_rows(np.eye(3)[:2], motions)
    >>> np.allclose(rows @ motions.T, np.eye(2), atol=1e-15)
    True
    """
    inside = components @ motions.T
    unit = inside / np.linalg.norm(motions, axis=1)
    if len(components) < len(motions) or (
        np.linalg.svd(unit, compute_uv=False).min() < _EXPLORED
    ):
        return np.full(motions.shape, np.nan)
    return np.asarray(np.linalg.pinv(inside) @ components)


def mean_motions(motions: Motions, q: Array) -> Array:
    """Motions (d, n), averaged over joint vectors (N, n): a self-motion is bent.

    Signs are those at the mean: beyond its highest place an elbow sinks.
    """
    middle = np.asarray(motions(q.mean(axis=0)), dtype=np.float64)
    found = np.array([motions(row) for row in q[:: max(1, len(q) // _VISITED)]])
    if found.shape[1:] != middle.shape or middle.ndim != 2:
        return middle
    along = np.where((found * middle).sum(axis=2) < 0, -1.0, 1.0)
    return np.asarray((along[:, :, None] * found).mean(axis=0))


def assemble_dual(
    centers: Array,
    components: Sequence[Array],
    samples: Sequence[Array],
    motions: Motions,
    *,
    n_dof: int,
    quantiles: tuple[float, float],
) -> tuple[Array, Array, Array]:
    """Directions (P, d, n) dual to the motions at each point, and ranges (P, d), rad.

    As :func:`ikns.nullspace.map.assembly.assemble`, but a row is orthogonal to the
    other motions and not to the other rows, and its output rises with its own motion.
    Rows have unit length.

    Raises
    ------
    InvalidInput
        When `motions` gives another shape.
    NotEnoughData
        When a point does not show every motion.
    """
    directions, ends = [], []
    for k, (rows, q) in enumerate(zip(components, samples, strict=True)):
        wanted = mean_motions(motions, q)
        if wanted.shape != (n_dof, q.shape[1]):
            raise InvalidInput(
                f"expected motions ({n_dof}, {q.shape[1]}), found {wanted.shape}."
            )
        z = dual_rows(rows, wanted) if len(rows) else np.full(wanted.shape, np.nan)
        if not np.isfinite(z).all():
            raise NotEnoughData(
                f"expected {n_dof} freedoms at every place, found less at "
                f"{format_point(centers, k)}: explore each of them there (lift the "
                "elbow, turn the hand), or ask for fewer with --n-dof (n_dof)."
            )
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        directions.append(z)
        ends.append(np.quantile(q @ z.T, quantiles, axis=0))
    return np.array(directions), *np.swapaxes(ends, 0, 1)
