"""Sums and products with twice a float's digits: a float, and what it rounds off.

D. E. Knuth, The Art of Computer Programming 2 (1969), theorem B of 4.2.2; T. J. Dekker,
A floating-point technique for extending the available precision (1971).
"""

from __future__ import annotations

from ikns._kernels.compiled import inner

Triple = tuple[float, float, float]


@inner
def difference(a: float, b: float) -> tuple[float, float]:
    """Return a - b as a float, and what that float rounds off."""
    value = a - b
    back = value - a
    return value, (a - (value - back)) - (b + back)


@inner
def product(a: float, b: float) -> tuple[float, float]:
    """Return a * b as a float, and what that float rounds off."""
    value = a * b
    moved = 134217729.0 * a  # 2**27 + 1: splits 53 digits into 26 and 27
    p = moved - (moved - a)
    moved = 134217729.0 * b
    r = moved - (moved - b)
    q, s = a - p, b - r
    return value, ((p * r - value) + p * s + q * r) + q * s


@inner
def double_double_dot(a: Triple, a_rest: Triple, b: Triple, b_rest: Triple) -> float:
    """Scalar product, to about 1e-30 of its largest term."""
    total, low = 0.0, 0.0
    for k in range(3):
        value, rest = product(a[k], b[k])
        total, lost = difference(total, -value)
        low += rest + a[k] * b_rest[k] + a_rest[k] * b[k] + lost
    return total + low
