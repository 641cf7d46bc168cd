"""The Voronoi diagram of some sites, every number exact to its last digits.

With the edges u, v, w of a tetrahedron and six times its volume, d = u . (v x w), its
circumcenter, seen from its first site, is

    c = (|u|^2 v x w + |v|^2 w x u + |w|^2 u x v) / (2 d)

Across a facet with normal n, |n| twice its area, to a tetrahedron with d', the Voronoi
edge has the length

    L = p |n| / (2 d')

where p is the power, to the sphere here, of the site e that the tetrahedron there adds:
the powers to both spheres differ by 2 L times the height above the facet, and that of e
is d' / |n|. All of n, d, 2 d c and p d are determinants of sites. They are formed
without rounding wherever twice a float's digits might not do, so that what nearly
cancels keeps its digits and ties are 0.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.voronoi import exact
from ikns._kernels.voronoi.delaunay import triangulate
from ikns._kernels.voronoi.exact import Sites, on_lattice
from ikns._kernels.voronoi.rings import list_facets, list_sides
from ikns._kernels.voronoi.sines import sines
from ikns.arrays import Array, Indices
from ikns.nullspace.interpolation.double_double import (
    difference,
    double_double_dot,
    product,
)
from ikns.nullspace.interpolation.voronoi import Voronoi

Stage = np.signedinteger

#: Where a sum known to 2**-97 of the size of its terms is below this part of that, it
#: is formed again without rounding; above, it is off by less than 2**-57 of itself.
_CANCELED = 2.0**-40


def diagram(points: Array) -> Voronoi:
    """Build the diagram of sites (N, 3) that span space and are all different.

    They are scaled so that the set is about 1 wide.
    """
    sites = on_lattice(points)
    simplices, neighbors = triangulate(sites, insertion_order(points))
    outside = len(simplices)
    facets, behind, ahead = list_facets(simplices, neighbors)
    edges, begin, side_facet, side_edge, entering, leaving = list_sides(
        facets, behind, ahead, outside
    )
    center, center_rest, volume = _circumcenters(sites, simplices)
    normal, normal_rest, area = _normals(sites, facets)

    inner = np.flatnonzero(ahead < outside)
    here, there = behind[inner], ahead[inner]
    place = (neighbors[there] == here[:, None]).argmax(axis=1)
    fives = np.column_stack([simplices[here], simplices[there, place]])
    power = _powers(sites, fives, center[here], center_rest[here], volume[here])
    length = np.full(len(facets), np.inf)
    length[inner] = power / 2 * area[inner] / volume[there]

    first, second, sine = _sines(
        *(sites, facets, behind, normal, normal_rest, area),
        *(edges, begin, side_facet, side_edge, entering),
    )
    hull = np.flatnonzero(ahead == outside)
    axis = sites.x[edges[:, 1]] - sites.x[edges[:, 0]]
    return Voronoi(
        simplices=simplices,
        neighbors=neighbors,
        circumcenter=center,
        circumcenter_rest=center_rest,
        behind=behind,
        ahead=ahead,
        length=length,
        normal=normal,
        normal_rest=normal_rest,
        hull=hull,
        hull_facets=facets[hull],
        edges=edges,
        axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        side_facet=side_facet,
        side_edge=side_edge,
        entering=entering,
        leaving=leaving,
        first=first,
        second=second,
        sine=sine,
        pairs=_pairs_before(begin)[:-1],
    )


def insertion_order(points: Array) -> Indices:
    """Biased randomized insertion order: most sites are close to the one before.

    First four far apart. Then random rounds, each of half of what is left, so that no
    layout makes large cavities (N. Amenta, S. Choi and G. Rote, Incremental
    constructions con BRIO, 2003); within a round along a space-filling curve
    (G. M. Morton, 1966).
    """
    rounds = np.floor(np.log2(1 - np.random.default_rng(0).random(len(points))))
    for rank, site in enumerate(_far_apart(points)):
        rounds[site] = rank - 100.0  # 2**-53 is the least random number
    fine = 1023 / np.ptp(points, axis=0).max()
    place = ((points - points.min(axis=0)) * fine).astype(np.int64)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3)):
        place = (place | place << shift) & mask
    curve = ((place | place << 2) & 0x09249249) @ [4, 2, 1]  # bits of x, y, z in turn
    return np.lexsort([curve, rounds])


def _far_apart(points: Array) -> list[int]:
    """Four sites that span space, as far as rounding can tell."""
    u = points - points[0]
    found = [0, int((u * u).sum(axis=1).argmax())]
    across = np.cross(u[found[1]], u)
    found.append(int((across * across).sum(axis=1).argmax()))
    return [*found, int(np.abs(u @ across[found[2]]).argmax())]


def _determinants(
    sites: Sites, fives: Indices, last: Stage, row: Stage, width: int
) -> tuple[Array, Array]:
    """Rows of determinants of sets of five sites, and what these round off."""
    value, rest = np.empty((2, len(fives), width))
    exact.values(sites, fives, last, row, value, rest)
    return value, rest


def _ratio(a: Array, a_rest: Array, b: Array, b_rest: Array) -> tuple[Array, Array]:
    """Return a / b as a float, and what that float rounds off."""
    value = a / b
    back, lost = product(value, b)
    rest = ((((a - back) - lost) + a_rest) - value * b_rest) / b
    total = value + rest
    return total, rest - (total - value)


def _circumcenters(sites: Sites, simplices: Indices) -> tuple[Array, Array, Array]:
    """Return circumcenters, what these round off, and six times the volumes."""
    fives = simplices.take([0, 1, 2, 3, 3], axis=1)
    value, rest = _determinants(sites, fives, exact.SPHERE, exact.DETERMINANT, 4)
    below, below_rest = 2 * value[:, :1], 2 * rest[:, :1]
    return *_ratio(value[:, 1:], rest[:, 1:], below, below_rest), value[:, 0]


def _normals(sites: Sites, facets: Indices) -> tuple[Array, Array, Array]:
    """Return unit normals, what these round off, and twice the areas."""
    fives = facets.take([0, 0, 1, 2, 0], axis=1)
    value, rest = _determinants(sites, fives, exact.NORMAL, exact.VW, 3)
    area = np.sqrt((value * value).sum(axis=1, keepdims=True))
    return *_ratio(value, rest, area, np.zeros_like(area)), area[:, 0]


def _powers(
    sites: Sites, fives: Indices, c: Array, c_rest: Array, volume: Array
) -> Array:
    """Power of the last of five sites to the sphere of the others, about c."""
    p, p_rest = difference(sites.x[fives[:, 4]], sites.x[fives[:, 0]])
    reach, reach_rest = difference(p, 2 * c)
    power = double_double_dot(reach, reach_rest + p_rest - 2 * c_rest, p, p_rest)
    size = (np.abs(p) * (np.abs(p) + np.abs(2 * c))).sum(axis=1)
    few = np.flatnonzero(np.abs(power) < _CANCELED * size)
    value, _ = _determinants(sites, fives[few], exact.TO_SPHERE, exact.POWER, 1)
    power[few] = value[:, 0] / volume[few]
    return power


def _pairs_before(begin: Indices) -> Indices:
    """Count pairs of sides of one face, before each face and in total."""
    sides = np.diff(begin)
    return np.append(0, (sides * (sides - 1) // 2).cumsum())


def _sines(
    sites: Sites,
    facets: Indices,
    behind: Indices,
    normal: Array,
    normal_rest: Array,
    area: Array,
    edges: Indices,
    begin: Indices,
    side_facet: Indices,
    side_edge: Indices,
    entering: Indices,
) -> tuple[Indices, Indices, Array]:
    """Pairs of sides of one face, and the sines of the angles between them."""
    count = _pairs_before(begin)[-1]
    first, second = np.empty((2, count), dtype=np.int64)
    sine = np.empty(count)
    sines(
        *(sites.x, facets, behind, normal, normal_rest, area),
        *(edges, begin, side_facet, entering, _CANCELED, first, second, sine),
    )
    few = np.flatnonzero(np.isnan(sine))
    edge, f, g = side_edge[first[few]], side_facet[first[few]], side_facet[second[few]]
    i, j = edges[edge].T
    third, fourth = (facets[k].sum(axis=1) - i - j for k in (f, g))
    fives = np.column_stack([i, j, third, fourth, i])
    volume, _ = _determinants(sites, fives, exact.VOLUME, exact.DETERMINANT, 1)
    along = np.linalg.norm(sites.x[j] - sites.x[i], axis=1)
    sine[few] = volume[:, 0] / area[f] / area[g] * along
    return first, second, sine
