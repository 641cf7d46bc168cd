"""Double-double arithmetic on arrays: a float, and what it rounds off.

The same as ikns._kernels.voronoi.double_double, where the sources are.
"""

from __future__ import annotations

from ikns.arrays import Array


def difference(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a - b as a float, and what that float rounds off."""
    value = a - b
    back = value - a
    return value, (a - (value - back)) - (b + back)


def product(a: Array, b: Array) -> tuple[Array, Array]:
    """Return a * b as a float, and what that float rounds off."""
    value = a * b
    high = []
    for factor in (a, b):
        moved = 134217729.0 * factor  # 2**27 + 1: splits 53 digits into 26 and 27
        high.append(moved - (moved - factor))
    (p, r) = high
    q, s = a - p, b - r
    return value, ((p * r - value) + p * s + q * r) + q * s


def double_double_dot(a: Array, a_rest: Array, b: Array, b_rest: Array) -> Array:
    """Scalar products of rows of three, (K,), to about 1e-30 of their largest term."""
    value, rest = product(a, b)
    rest = rest + a * b_rest + a_rest * b
    total, low = value[:, 0], rest.sum(axis=1)
    for k in (1, 2):
        total, lost = difference(total, -value[:, k])
        low = low + lost
    return total + low
