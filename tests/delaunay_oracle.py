"""Delaunay triangulation by its definition, in integers: no sphere holds a site.

All sets of four sites are tried. Where others are on their sphere, lifts decide, as in
`predicate_oracle`: those of earlier sites are larger.
"""

from itertools import combinations

import numpy as np
from predicate_oracle import above_sphere, on_lattice, volume


def delaunay(points):
    """All tetrahedra of the triangulation, as a set of increasing tuples of four."""
    sites = on_lattice(points)
    fours = np.array(list(combinations(range(len(sites)), 4)))
    return {
        simplex
        for simplex in map(tuple, fours[~_surely_not_empty(points, fours)].tolist())
        if _is_empty(sites, simplex)
    }


def _surely_not_empty(points, fours):
    """Whether floats are enough to tell that a site is in the sphere of four others."""
    w = points - points[fours[:, :1]]
    u, v, t = (points[fours[:, k]] - points[fours[:, 0]] for k in (1, 2, 3))
    normals = np.cross(v, t), np.cross(t, u), np.cross(u, v)
    side = (u * normals[0]).sum(axis=1)
    center = sum(
        (edge**2).sum(axis=1)[:, None] * n
        for edge, n in zip((u, v, t), normals, strict=True)
    )
    power = (w**2).sum(axis=2) * side[:, None] - np.einsum("tk,tnk->tn", center, w)
    sizes = [np.linalg.norm(edge, axis=1) for edge in (u, v, t)]
    reach = np.linalg.norm(w, axis=2)
    # At most 20 operations of half a unit in the last place, and room to spare.
    doubt = 1e-14 * np.prod(sizes, axis=0)
    inside = power * np.sign(side)[:, None]
    inside = inside < -doubt[:, None] * reach * (reach + sum(sizes)[:, None])
    return inside.any(axis=1) & (np.abs(side) > doubt)


def _is_empty(sites, simplex):
    """Whether a tetrahedron is not flat and its lifted sphere holds no other site."""
    side = volume(sites, *simplex)
    others = set(range(len(sites))) - set(simplex)
    return side != 0 and not any(_holds(sites, simplex, side, e) for e in others)


def _holds(sites, simplex, side, e):
    five = sorted((*simplex, e))  # of the lifts only the order counts
    places = [five.index(i) for i in (*simplex, e)]
    return above_sphere([sites[i] for i in five], *places) * side < 0
