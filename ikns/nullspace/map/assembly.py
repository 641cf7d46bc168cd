"""From each point's components to directions with consistent signs and ranges."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.nullspace.map.alignment import align
from ikns.nullspace.map.checks import MapSettings, MapWarning, format_point, listed

# Directions more than 60 degrees apart say little about each other's sign.
_WEAK = 0.5
# The sign of a reference within 6 degrees of orthogonal changes with a little noise.
_INDIFFERENT = 0.1


def assemble(
    centers: Array,
    components: Sequence[Array],
    weights: Sequence[Array],
    samples: Sequence[Array],
    *,
    settings: MapSettings,
    edges: Indices,
) -> tuple[Array, Array, Array]:
    """Directions and ranges of all points, with a MapWarning where these are uncertain.

    Parameters
    ----------
    centers : (P, 3) array
        Where the points are, m.
    components : sequence of P (k_i, n) arrays
        Orthonormal rows, leading one first, at least d; none where no joint moves.
    weights : sequence of P (k_i,) arrays
        Weight of each component in the sum, for one degree of freedom.
    samples : sequence of P (N_i, n) arrays
        Joint vectors at each point, rad.
    settings : MapSettings
    edges : (E, 2) integer array
        Which points are neighbors, as a connected graph.

    Returns
    -------
    directions : (P, d, n) array
    lower, upper : (P, d) arrays
        Quantiles of the projections of the uncentered samples, rad.
    """
    sizes = [
        len(q) * (len(rows) > 0) for q, rows in zip(samples, components, strict=True)
    ]
    directions, tree = align(
        components,
        weights,
        n_dof=settings.n_dof,
        edges=edges,
        root=int(np.argmax(sizes)),
        reference=settings.reference,
    )
    _warn_of_disagreement(centers, directions, tree, edges)
    if settings.reference is not None:
        _warn_of_indifference(directions, settings.reference)
    ends = [
        np.quantile(q @ z.T, settings.quantiles, axis=0)
        for q, z in zip(samples, directions, strict=True)
    ]
    return directions, *np.swapaxes(ends, 0, 1)


def _warn_of_disagreement(
    centers: Array, directions: Array, tree: Sequence[tuple[int, int]], edges: Indices
) -> None:
    """Name neighbors that are almost orthogonal, or opposed in spite of the tree."""
    weak = []
    both = np.abs(directions[edges]).max(axis=(2, 3)).all(axis=1)
    for i, j in edges[both].tolist():
        cosine = float((directions[i] * directions[j]).sum(axis=1).min())
        least = _WEAK if (i, j) in tree or (j, i) in tree else 0.0
        if cosine < least:
            both_ends = f"{format_point(centers, i)} and {format_point(centers, j)}"
            weak.append((cosine, f"{both_ends} (cosine {cosine:.2f})"))
    if weak:
        named = listed([name for _, name in sorted(weak)])
        warnings.warn(
            "the directions of neighboring points differ so much that their signs, and "
            f"c between them, are uncertain: {named}.",
            MapWarning,
            stacklevel=4,
        )


def _warn_of_indifference(directions: Array, reference: Array) -> None:
    """Warn when the reference is almost orthogonal to the sum of the directions."""
    total = directions.sum(axis=0)
    size = np.linalg.norm(total, axis=1) * np.linalg.norm(reference, axis=1)
    cosine = float(((total * reference).sum(axis=1) / np.maximum(size, 1e-300)).min())
    if cosine < _INDIFFERENT:
        warnings.warn(
            "the reference is almost orthogonal to the directions (cosine "
            f"{cosine:.2f}), so which way c rises is uncertain.",
            MapWarning,
            stacklevel=4,
        )
