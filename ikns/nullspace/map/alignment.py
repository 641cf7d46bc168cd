"""Consistent signs of directions, which principal components do not have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.numerics.subspace import largest_entry_positive


def spanning_tree(strength: Array, edges: Indices, root: int) -> list[tuple[int, int]]:
    """Maximum spanning tree of a connected graph, grown from its root (Prim 1957).

    Edges (E, 2) between nodes have strengths (E,). Returns (parent, child) in the order
    in which they are added; a parent is the root or an earlier child.
    """
    tree: list[tuple[int, int]] = []
    reached = np.zeros(edges.max(initial=root) + 1, dtype=bool)
    reached[root] = True
    while True:
        crossing = reached[edges[:, 0]] != reached[edges[:, 1]]
        if not crossing.any():
            return tree
        a, b = edges[np.where(crossing, strength, -np.inf).argmax()]
        parent, child = (a, b) if reached[a] else (b, a)
        tree.append((int(parent), int(child)))
        reached[child] = True


def align(
    components: Sequence[Array],
    weights: Sequence[Array],
    *,
    n_dof: int,
    edges: Indices,
    root: int,
    reference: Array | None = None,
) -> tuple[Array, list[tuple[int, int]]]:
    """Directions of all points with consistent signs.

    For one degree of freedom a direction is the normalized sum of the point's
    components, each times its weight and the sign that agrees with the point's parent
    in the tree; for d degrees of freedom it is the point's d components, rotated within
    their span to agree best with the parent (orthogonal Procrustes, Schoenemann 1966).
    The tree grows from `root`, which follows the reference, along the edges with the
    best agreement: the smallest cosine between the spans of the `n_dof` leading
    components at both ends.

    Components and weights (the latter for one degree of freedom) are those of
    :func:`ikns.nullspace.map.assembly.assemble`, `edges` (E, 2) pairs of neighbors. The
    sum of all directions has a positive dot product with the reference (d, n), row by
    row; without it the entry of largest magnitude of that sum is positive.

    Returns
    -------
    directions : (P, d, n) array
        Orthonormal rows for each point, zeros where it has no components.
    tree : list of (parent, child)
    """
    known = np.array([len(rows) > 0 for rows in components])
    components = [largest_entry_positive(rows) for rows in components]
    leading = np.zeros((len(components), n_dof, components[root].shape[1]))
    for k in np.flatnonzero(known):
        leading[k] = components[k][:n_dof]
    overlap = leading[edges[:, 0]] @ np.swapaxes(leading[edges[:, 1]], 1, 2)
    strength = np.linalg.svd(overlap, compute_uv=False).min(axis=1, initial=1.0)
    tree = spanning_tree(strength, edges, root)

    def toward(k: int, target: Array) -> Array:
        if not known[k]:
            return target  # pass the sign on to the children
        if n_dof > 1:
            return _turn(leading[k], target) @ leading[k]
        sign = np.where(components[k] @ target[0] < 0, -1.0, 1.0)
        direction = (sign * weights[k]) @ components[k]
        return (direction / np.linalg.norm(direction))[None]

    directions = np.zeros_like(leading)
    # Without a reference every component of the root keeps its largest entry positive.
    first = components[root].sum(axis=0)[None] if n_dof == 1 else leading[root]
    directions[root] = toward(root, first if reference is None else reference)
    for parent, child in tree:
        directions[child] = toward(child, directions[parent])
    directions[~known] = 0.0
    total = directions.sum(axis=0)
    if reference is None:
        flip = np.where((largest_entry_positive(total) == total).all(axis=1), 1.0, -1.0)
        return directions * flip[:, None], tree
    return _turn(total, reference) @ directions, tree


def _turn(rows: Array, target: Array) -> Array:
    """Orthogonal (d, d) matrix that rotates rows (d, n) to best match the target."""
    u, _, vt = np.linalg.svd(target @ rows.T)
    return u @ vt
