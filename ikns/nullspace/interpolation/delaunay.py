"""Delaunay triangulation in space, decided exactly however degenerate the sites are.

Boxes and grids put eight sites on one sphere and four in one plane of the hull. There
rounding decides at random which sites are neighbors, and different places decide
differently. Here every question that floats cannot settle is settled in integers
(floats are dyadic fractions), and a true tie as if the sites were lifted by vanishing
amounts e_0 >> e_1 >> ... > 0: their squared norms grow by e_i. A lifted set has exactly
one triangulation, without flat tetrahedra in exactly flat places.

The triangulation grows by gift wrapping: behind each open facet stands the one site
whose sphere through the facet holds no other. That is O(sites) a facet: milliseconds
for ten sites, seconds for a thousand. It is the reference for
ikns._kernels.voronoi.delaunay, which triangulates ten thousand in a tenth of a second.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "OUTWARD",
    "Facet",
    "Simplex",
    "Vector",
    "circumcenter",
    "cross",
    "delaunay",
    "dot",
    "lift_order",
    "minus",
    "on_lattice",
]

Vector = tuple[int, int, int]
Simplex = tuple[int, int, int, int]
Facet = tuple[int, int, int]

#: Vertex positions of the facets of (a, b, c, d), each turned away from the vertex it
#: leaves out, in that vertex's place.
OUTWARD = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))

#: Bound on the relative rounding of the two determinants below: at most 20 operations
#: of half a unit in the last place, 20 * 1.1e-16, with room to spare.
_ROUNDING = 1e-14


def on_lattice(points: NDArray[np.float64]) -> list[Vector]:
    """Sites as integers in steps of 2**-100, the first site at the origin.

    Parameters
    ----------
    points : (N, 3) array
        Sites, scaled so that the set is about 1 wide. Floats down to 2**-47 are
        represented exactly, what is finer than 2**-100 is cut off.
    """
    steps = [[int(value) for value in site] for site in points * 2.0**100]
    origin = steps[0]
    return [
        (x - origin[0], y - origin[1], z - origin[2]) for x, y, z in steps
    ]  # exact, unlike a difference of floats


def minus(a: Vector, b: Vector) -> Vector:
    """Return a - b, exactly."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vector, b: Vector) -> int:
    """Return the scalar product, exactly."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product, exactly."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def circumcenter(sites: list[Vector], simplex: Simplex) -> tuple[Vector, int]:
    """Center of the sphere through four sites, seen from the first, as a fraction.

    Returns
    -------
    numerator : tuple of 3 int
    denominator : int
        Twelve times the signed volume, so that center = numerator / denominator.
    """
    a, b, c, d = (sites[i] for i in simplex)
    u, v, w = minus(b, a), minus(c, a), minus(d, a)
    vw, wu, uv = cross(v, w), cross(w, u), cross(u, v)
    uu, vv, ww = dot(u, u), dot(v, v), dot(w, w)
    numerator = (
        uu * vw[0] + vv * wu[0] + ww * uv[0],
        uu * vw[1] + vv * wu[1] + ww * uv[1],
        uu * vw[2] + vv * wu[2] + ww * uv[2],
    )
    return numerator, 2 * dot(u, vw)


def _volume(sites: list[Vector], simplex: tuple[int, ...]) -> int:
    """Six times the signed volume of a tetrahedron, exactly."""
    a, b, c, d = (sites[i] for i in simplex)
    return dot(cross(minus(b, a), minus(c, a)), minus(d, a))


def _in_sphere(sites: list[Vector], simplex: Simplex, site: int) -> bool:
    """Whether a site lies inside the sphere of a positive simplex; never a tie.

    On the sphere itself the lifts decide. There the site stands above the lifted
    simplex by e_site - sum_v mu_v e_v, where mu are the site's barycentric coordinates;
    the first lift with a coefficient other than zero outweighs all later ones.
    """
    numerator, denominator = circumcenter(sites, simplex)
    w = minus(sites[site], sites[simplex[0]])
    power = dot(w, w) * denominator - 2 * dot(w, numerator)
    if power:
        return power < 0
    for vertex in sorted((*simplex, site)):
        if vertex == site:
            break
        mu = _volume(sites, tuple(site if i == vertex else i for i in simplex))
        if mu:
            return mu > 0
    return False


def _first_facet(sites: list[Vector]) -> Facet:
    """Three sites whose smallest common sphere holds no other site inside.

    The first site, its nearest, and the third that makes the smallest circle: a site
    inside that circle's ball would make a smaller one.
    """
    origin = sites[0]
    others = range(1, len(sites))
    nearest = min(others, key=lambda i: dot(sites[i], sites[i]))
    u = minus(sites[nearest], origin)

    def squared_radius(i: int) -> Fraction:
        v = minus(sites[i], origin)
        normal, opposite = cross(u, v), minus(u, v)
        return Fraction(dot(v, v) * dot(opposite, opposite), dot(normal, normal))

    spanning = [i for i in others if any(cross(u, minus(sites[i], origin)))]
    return 0, nearest, min(spanning, key=squared_radius)


def lift_order(points: NDArray[np.float64]) -> list[int]:
    """Sites from the most to the least lifted.

    The first facet is certain only if no lift pulls another site under it, so its sites
    are lifted least: they come last.
    """
    seed = _first_facet(on_lattice(points))
    return [i for i in range(len(points)) if i not in seed] + list(seed)


def _apex(x: NDArray[np.float64], sites: list[Vector], facet: Facet) -> int | None:
    """Site that completes a facet on its positive side; None on the hull."""
    a, b, c = facet
    w = x - x[a]
    size = np.sqrt((w * w).sum(axis=1))
    normal = np.cross(w[b], w[c])
    height = w @ normal
    slack = _ROUNDING * size[b] * size[c] * size
    unsure = np.flatnonzero(np.abs(height) <= slack)
    above = height > slack
    for i in unsure:
        above[i] = i not in facet and _volume(sites, (*facet, int(i))) > 0
    candidates = np.flatnonzero(above)
    if not candidates.size:
        return None

    best = int(candidates[0])
    while True:  # each round is surely a smaller sphere, so this ends; mostly at once
        power, doubt = _power_of_all(w, size, facet, best)
        power, doubt = power[candidates], doubt[candidates]
        inside = np.flatnonzero(power < -doubt)
        if not inside.size:
            break
        depth = power[inside] / np.abs(height[candidates[inside]]).clip(1e-300)
        best = int(candidates[inside[np.argmin(depth)]])
    for i in candidates[np.abs(power) <= doubt]:
        if i != best and _in_sphere(sites, (*facet, best), int(i)):
            best = int(i)
    return best


def _power_of_all(
    w: NDArray[np.float64], size: NDArray[np.float64], facet: Facet, apex: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power of every site to one sphere (negative inside), and how far it may be off.

    `w` are the sites seen from the facet's first vertex, `size` their distances.
    """
    _, b, c = facet
    edges = w[[b, c, apex]]
    turned = np.cross(np.roll(edges, -1, axis=0), np.roll(edges, -2, axis=0))
    gradient = (edges * edges).sum(axis=1) @ turned
    power = size**2 * (edges[0] @ turned[0]) - w @ gradient
    spans = size[[b, c, apex]]
    return power, _ROUNDING * spans.prod() * size * (size + spans.sum())


def delaunay(points: NDArray[np.float64]) -> tuple[list[Simplex], list[list[int]]]:
    """Triangulate sites that span space and are all different.

    Parameters
    ----------
    points : (N, 3) array
        Sites, scaled so that the set is about 1 wide.

    Returns
    -------
    simplices : list of T tuples of 4 int
        Tetrahedra of positive volume: seen from the last, the others turn left.
    neighbors : list of T lists of 4 int
        The tetrahedron across the facet that leaves out each vertex; -1 on the hull.

    Examples
    --------
    >>> import numpy as np
    >>> cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> simplices, neighbors = delaunay(cube)
    >>> volumes = np.linalg.det([cube[list(s)[1:]] - cube[s[0]] for s in simplices]) / 6
    >>> float(volumes.sum().round(12)), sum(n == -1 for row in neighbors for n in row)
    (1.0, 12)
    """
    order = lift_order(points)
    x = points[order]
    sites = on_lattice(x)

    simplices: list[Simplex] = []
    neighbors: list[list[int]] = []
    waiting: dict[frozenset[int], tuple[int, int, Facet]] = {}

    def add(simplex: Simplex) -> None:
        here = len(simplices)
        simplices.append(simplex)
        neighbors.append([-1] * 4)
        for k, places in enumerate(OUTWARD):
            facet = (simplex[places[0]], simplex[places[1]], simplex[places[2]])
            other = waiting.pop(frozenset(facet), None)
            if other is None:
                waiting[frozenset(facet)] = here, k, facet
            else:
                there, m, _ = other
                neighbors[here][k], neighbors[there][m] = there, here

    a, b, c = range(len(points) - 3, len(points))
    for facet in ((a, b, c), (a, c, b)):
        apex = _apex(x, sites, facet)
        if apex is not None:
            add((*facet, apex))
            break
    while waiting:
        key, (_, _, facet) = next(reversed(waiting.items()))
        apex = _apex(x, sites, facet)
        if apex is None:
            del waiting[key]
        else:
            add((*facet, apex))
    return [
        (order[i], order[j], order[k], order[m]) for i, j, k, m in simplices
    ], neighbors
