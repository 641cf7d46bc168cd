"""Sibson's weights by cutting polyhedra in integers: slow, exact, and nothing shared.

The query's own Voronoi cell is cut out of a huge box, then shared out by cutting it
along the bisectors of the sites. Points are homogeneous integer vectors (x, y, z, w),
so that nothing is ever rounded and ties need no tolerance.
"""

from fractions import Fraction
from math import gcd

Point = tuple[int, int, int, int]
Plane = tuple[int, int, int, int]
Polyhedron = list[list[Point]]  # faces, each a loop seen counterclockwise from outside


def _integers(points):
    """Floats as integers of one common step, exactly."""
    exact = [[Fraction(float(value)) for value in point] for point in points]
    step = max(value.denominator for point in exact for value in point)
    return [tuple(int(value * step) for value in point) for point in exact]


def _closer(a, b) -> Plane:
    """Half-space of the points closer to a than to b: plane . point >= 0."""
    normal = (2 * (p - q) for p, q in zip(a, b, strict=True))
    return (*normal, sum(q * q - p * p for p, q in zip(a, b, strict=True)))


def _value(plane: Plane, point: Point) -> int:
    (a, b, c, d), (x, y, z, w) = plane, point
    return a * x + b * y + c * z + d * w


def _box(half: int) -> Polyhedron:
    corners = {
        (i, j, k): (half * i, half * j, half * k, 1)
        for i in (-1, 1)
        for j in (-1, 1)
        for k in (-1, 1)
    }
    faces = []
    for axis in range(3):
        for side in (-1, 1):
            loop = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::side]
            keys = [(*pair[:axis], side, *pair[axis:]) for pair in loop]
            # Inserting the middle axis swaps the order of the other two.
            faces.append([corners[key] for key in (keys[::-1] if axis == 1 else keys)])
    return faces


def _between(a: Point, b: Point, at_a: int, at_b: int) -> Point:
    point = [abs(at_b) * p + abs(at_a) * q for p, q in zip(a, b, strict=True)]
    common = gcd(*point)
    return tuple(value // common for value in point)


def _cut(body: Polyhedron, plane: Plane) -> Polyhedron:
    """Part of a convex body where plane . point >= 0."""
    at = {point: _value(plane, point) for face in body for point in face}
    if all(value >= 0 for value in at.values()):
        return body
    if all(value <= 0 for value in at.values()):
        return []
    kept, following = [], {}
    for face in body:
        if all(at[point] <= 0 for point in face):
            continue
        loop = []
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            if at[a] >= 0:
                loop.append(a)
            if at[a] * at[b] < 0:
                loop.append(_between(a, b, at[a], at[b]))
        kept.append(loop)
        for a, b in zip(loop, loop[1:] + loop[:1], strict=True):
            if at.get(a, 0) == 0 and at.get(b, 0) == 0:
                following[b] = a
    start = next(iter(following))
    cap = [start]
    while following[cap[-1]] != start:
        cap.append(following[cap[-1]])
    return [*kept, cap]


def _volume(body: Polyhedron) -> Fraction:
    """Six times the volume."""
    total = Fraction(0)
    for first, *rest in body:
        for second, third in zip(rest, rest[1:], strict=False):
            (a, b, c, u), (d, e, f, v), (g, h, i, w) = first, second, third
            det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
            total += Fraction(det, u * v * w)
    return total


def _distance(a, b) -> int:
    """Squared distance."""
    return sum((i - j) ** 2 for i, j in zip(a, b, strict=True))


def _cell(points, q) -> Polyhedron:
    """The query's own Voronoi cell."""
    far = 2**300 * max(abs(value) for point in (*points, q) for value in point)
    cell = _box(far)
    for site in sorted(points, key=lambda site: _distance(site, q)):
        cell = _cut(cell, _closer(q, site))
    corners = {point for face in cell for point in face}
    if any(abs(value) == far * w for *place, w in corners for value in place):
        raise ValueError("the query is not inside the hull")
    return cell


def sibson_weights(sites, query) -> list[Fraction]:
    """Exact weights of the given floats; the query strictly inside, not at a site."""
    *points, q = _integers([*sites, query])
    cell = _cell(points, q)
    corners = {point for face in cell for point in face}
    # Only sites with a face on the cell can be nearest to a place in it; the last line
    # checks that nothing is missed.
    near = [
        site
        for site in points
        if sum(_value(_closer(q, site), corner) == 0 for corner in corners) >= 3
    ]
    whole = _volume(cell)
    weights = dict.fromkeys(points, Fraction(0))
    for mine in near:
        part = cell
        for other in sorted(near, key=lambda site: _distance(site, mine)):
            if part and other is not mine:
                part = _cut(part, _closer(mine, other))
        weights[mine] = _volume(part) / whole
    if sum(weights.values()) != 1:
        raise AssertionError("the parts do not add up to the whole cell")
    return list(weights.values())


def laplace_weights(sites, query) -> list[Fraction]:
    """Exact areas of the cell's faces over distances, of a sum of one.

    A face's area vector points along the way to its site, so that area over distance is
    the scalar product of the two over the distance squared: no roots.
    """
    *points, q = _integers([*sites, query])
    cell = _cell(points, q)
    shares = []
    for site in points:
        bisector = _closer(q, site)
        way = [a - b for a, b in zip(site, q, strict=True)]
        twice = Fraction(0)
        for face in cell:
            if any(_value(bisector, corner) for corner in face):
                continue
            first, *rest = [[Fraction(v, w) for v in place] for *place, w in face]
            for second, third in zip(rest, rest[1:], strict=False):
                u, v = (
                    [a - b for a, b in zip(corner, first, strict=True)]
                    for corner in (second, third)
                )
                across = (
                    u[1] * v[2] - u[2] * v[1],
                    u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0],
                )
                twice += sum(a * b for a, b in zip(across, way, strict=True))
        shares.append(twice / _distance(site, q))
    whole = sum(shares)
    return [share / whole for share in shares]
