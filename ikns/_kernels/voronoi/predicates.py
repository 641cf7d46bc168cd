"""Exact orientation and in-sphere predicates.

What rounding surely cannot change is decided in floats, with the bounds of
J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric
predicates, Discrete & Computational Geometry 18 (1997), section 4; the rest in
integers. A bound is a few units in the last place of the determinant's permanent, here
replaced by lengths: with all factors positive, Cauchy and Schwarz give

    a_x (b_y c_z + b_z c_y) + a_y (...) + a_z (...) <= (a_x + a_y + a_z) |b| |c|
                                                    <= sqrt(3) |a| |b| |c|
"""

from __future__ import annotations

from math import sqrt

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.exact import (
    DETERMINANT,
    POWER,
    TO_SPHERE,
    VOLUME,
    Sites,
    determinants,
    sign_of,
)
from ikns.arrays import Indices

_ULP = 2.0**-53
# Shewchuk's o3derrboundA and isperrboundA times sqrt(3), 1.74 with its own rounding.
_PLANE_BOUND = 1.74 * (7 + 56 * _ULP) * _ULP
_SPHERE_BOUND = 1.74 * (16 + 224 * _ULP) * _ULP


@compiled
def orientation(sites: Sites, R: Indices, a: int, b: int, c: int, d: int) -> int:
    """Sign of a tetrahedron's volume: 1 if a, b, c turn left, seen from d."""
    x = sites.x
    ax, ay, az = x[a, 0] - x[d, 0], x[a, 1] - x[d, 1], x[a, 2] - x[d, 2]
    bx, by, bz = x[b, 0] - x[d, 0], x[b, 1] - x[d, 1], x[b, 2] - x[d, 2]
    cx, cy, cz = x[c, 0] - x[d, 0], x[c, 1] - x[d, 1], x[c, 2] - x[d, 2]
    volume = (
        az * (cx * by - bx * cy) + bz * (ax * cy - cx * ay) + cz * (bx * ay - ax * by)
    )
    aa = ax * ax + ay * ay + az * az
    bb = bx * bx + by * by + bz * bz
    cc = cx * cx + cy * cy + cz * cz
    if abs(volume) > _PLANE_BOUND * (sqrt(aa) * sqrt(bb) * sqrt(cc)):
        return 1 if volume > 0 else -1
    _, n = determinants(sites, R, a, b, c, d, d, VOLUME)
    return sign_of(R, DETERMINANT, n)


@compiled
def in_sphere(sites: Sites, R: Indices, a: int, b: int, c: int, d: int, e: int) -> bool:
    """Whether site e lies inside the sphere of a positive tetrahedron; never a tie.

    On the sphere itself a symbolic perturbation decides: vanishing lifts of the sites'
    squared norms, those of earlier sites larger. There e is above the lifted
    tetrahedron by lift_e - sum_v mu_v lift_v, where mu are its barycentric coordinates;
    the first lift with a nonzero coefficient outweighs all later ones.
    """
    x = sites.x
    ax, ay, az = x[a, 0] - x[e, 0], x[a, 1] - x[e, 1], x[a, 2] - x[e, 2]
    bx, by, bz = x[b, 0] - x[e, 0], x[b, 1] - x[e, 1], x[b, 2] - x[e, 2]
    cx, cy, cz = x[c, 0] - x[e, 0], x[c, 1] - x[e, 1], x[c, 2] - x[e, 2]
    dx, dy, dz = x[d, 0] - x[e, 0], x[d, 1] - x[e, 1], x[d, 2] - x[e, 2]
    ab, bc, cd = ax * by - bx * ay, bx * cy - cx * by, cx * dy - dx * cy
    da, ac, bd = dx * ay - ax * dy, ax * cy - cx * ay, bx * dy - dx * by
    aa = ax * ax + ay * ay + az * az
    bb = bx * bx + by * by + bz * bz
    cc = cx * cx + cy * cy + cz * cz
    dd = dx * dx + dy * dy + dz * dz
    outside = (
        dd * (az * bc - bz * ac + cz * ab) - cc * (dz * ab + az * bd + bz * da)
    ) + (bb * (cz * da + dz * ac + az * cd) - aa * (bz * cd - cz * bd + dz * bc))
    ra, rb, rc, rd = sqrt(aa), sqrt(bb), sqrt(cc), sqrt(dd)
    if abs(outside) > _SPHERE_BOUND * (ra * rb * rc * rd * (ra + rb + rc + rd)):
        return outside < 0
    _, n = determinants(sites, R, a, b, c, d, e, TO_SPHERE)
    sign = sign_of(R, POWER, n)
    if sign != 0:
        return sign < 0
    return _perturbed_in_sphere(sites, R, (a, b, c, d), e)


@compiled
def _perturbed_in_sphere(
    sites: Sites, R: Indices, simplex: tuple[int, int, int, int], e: int
) -> bool:
    a, b, c, d = simplex
    before = -1
    while True:
        first = e
        for v in simplex:
            if before < v < first:
                first = v
        if first == e:
            return False
        mu = orientation(
            sites,
            R,
            e if a == first else a,
            e if b == first else b,
            e if c == first else c,
            e if d == first else d,
        )
        if mu != 0:
            return mu > 0
        before = first
