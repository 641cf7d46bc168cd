"""Signs and values of determinants of sites, without rounding.

Floats are dyadic fractions, so determinants of them are integers in steps of some power
of two. Here an integer is a row of digits, lowest first,

    sum_i digit_i 2**(30 i),    -2**29 <= digit_i < 2**29,

whose highest digit other than zero tells the sign. A product of digits takes 58 bits,
and no sum below has more than 24 of them at one place before digits are carried. The
rows lie in one array of scratch memory, and functions name them by number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns._kernels.compiled import compiled

__all__ = [
    "CENTER",
    "DETERMINANT",
    "NORMAL",
    "POWER",
    "SCRATCH",
    "SPHERE",
    "TO_SPHERE",
    "UV",
    "VOLUME",
    "VW",
    "WU",
    "Sites",
    "T",
    "U",
    "V",
    "W",
    "compute",
    "lattice",
    "load",
    "on_lattice",
    "reach",
    "sign_of",
    "turn",
    "value_of",
]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Sites are cut off to steps of this size.
_FINEST = 2.0**-100
_BITS = 30
_HALF = 1 << (_BITS - 1)
#: What the i-th digit counts; the numbers of most digits are those of `POWER`.
_COUNTS = 2.0 ** (_BITS * np.arange(20))
_SHARES = 1 / _COUNTS

# Rows of the scratch array; a vector takes three. Numba would compile anew for each
# plain int that a function takes, but not for each int64.
U, V, W, T = np.arange(0, 12, 3)  # from a tetrahedron's first site to others
VW, WU, UV = np.arange(12, 21, 3)  # vector products
_UU, _VV, _WW, _TT = np.arange(21, 25)  # squares
DETERMINANT, CENTER, POWER = np.array([25, 26, 29])
#: Of how many coordinates a row is a product.
_DEGREE = np.repeat([1, 2, 3, 4, 5], [12, 13, 1, 3, 1])
#: Shape of the scratch array.
SCRATCH = (len(_DEGREE), len(_COUNTS))

Row = int | np.signedinteger
Terms = list[tuple[int, Row, Row]]  # plus or minus one row times another
Sums = list[tuple[Row, Terms]]  # what a row becomes


def _cross(row: Row, a: Row, b: Row) -> Sums:
    return [
        (row + k, [(i, a + (k + i) % 3, b + (k - i) % 3) for i in (1, -1)])
        for k in range(3)
    ]


def _dot(a: Row, b: Row, sign: int = 1) -> Terms:
    return [(sign, a + k, b + k) for k in range(3)]


def _weighted(row: Row, pairs: list[tuple[Row, Row]]) -> Sums:
    return [(row + k, [(1, a, b + k) for a, b in pairs]) for k in range(3)]


# What is computed in one go.
VOLUME, SPHERE, TO_SPHERE, NORMAL = np.arange(4)
_STAGES: list[Sums] = [
    [*_cross(VW, V, W), (DETERMINANT, _dot(U, VW))],
    [
        *_cross(WU, W, U),
        *_cross(UV, U, V),
        *[(_UU, _dot(U, U)), (_VV, _dot(V, V)), (_WW, _dot(W, W))],
        *_weighted(CENTER, [(_UU, VW), (_VV, WU), (_WW, UV)]),
    ],
    [
        (_TT, _dot(T, T)),
        (POWER, [(1, _TT, DETERMINANT), *_dot(T, CENTER, -1)]),
    ],
    _cross(UV, U, V),
]
_STAGE_BEGIN = np.cumsum([0, *map(len, _STAGES)])
_ROW = np.array([row for stage in _STAGES for row, _ in stage])
_ROW_BEGIN = np.cumsum([0, *(len(terms) for stage in _STAGES for _, terms in stage)])
_TERM = np.array([term for stage in _STAGES for _, terms in stage for term in terms])


class Sites(NamedTuple):
    """N sites, as the predicates want them.

    Parameters
    ----------
    x : (N, 3) array
    grain : (N,) array
        Powers of two: all three coordinates of a site are multiples of its grain.
    """

    x: Floats
    grain: Floats


def on_lattice(points: Floats) -> Sites:
    """Sites cut off to steps of 2**-100.

    Parameters
    ----------
    points : (N, 3) array
        At most 2**10 wide.
    """
    x = np.trunc(points / _FINEST) * _FINEST
    fraction, exponent = np.frexp(x)
    digits = (fraction * 2.0**53).astype(np.int64)
    lowest = np.where(digits == 0, 2.0**53, digits & -digits)
    grain = np.ldexp(lowest, exponent - 53).min(axis=1)
    return Sites(x, np.minimum(grain, 1.0))


@compiled
def reach(sites: Sites, a: int, b: int) -> float:
    """How far two sites are apart, the largest difference of their coordinates."""
    x = sites.x
    return max(
        abs(x[a, 0] - x[b, 0]), max(abs(x[a, 1] - x[b, 1]), abs(x[a, 2] - x[b, 2]))
    )


@compiled
def lattice(grain: float, reach: float) -> tuple[float, int]:
    """Return steps and a number of digits for vectors of that grain and length.

    Two digits if they hold the vectors with a bit to spare. Four hold all.
    """
    if reach <= grain * 2.0**58:
        return grain, 2
    return _FINEST, 4


@compiled
def load(
    sites: Sites, R: Integers, row: int, a: int, b: int, step: float, n: int
) -> None:
    """Write the vector from site a to site b in n digits."""
    for k in range(3):
        high = sites.x[b, k] - sites.x[a, k]
        back = high - sites.x[b, k]
        rest = (sites.x[b, k] - (high - back)) - (sites.x[a, k] + back)
        high, rest = high / step, rest / step
        for i in range(n - 1, 0, -1):
            digit = np.floor(high * _SHARES[i] + 0.5)
            high -= digit * _COUNTS[i]
            R[row + k, i] = np.int64(digit)
        R[row + k, 0] = np.int64(high) + np.int64(rest)  # below 2**49
        _carry(R, row + k, n)


@compiled
def _carry(R: Integers, row: int, n: int) -> None:
    """Bring the digits of a row back into their range."""
    carry = 0
    for i in range(n - 1):
        digit = R[row, i] + carry
        carry = (digit + _HALF) >> _BITS
        R[row, i] = digit - (carry << _BITS)
    R[row, n - 1] += carry


@compiled
def _add_product(
    R: Integers, row: int, sign: int, a: int, n: int, b: int, m: int
) -> None:
    """Add plus or minus a product of n by m digits, both even."""
    for i in range(0, n, 2):
        low, high = sign * R[a, i], sign * R[a, i + 1]
        for j in range(0, m, 2):
            R[row, i + j] += low * R[b, j]
            R[row, i + j + 1] += low * R[b, j + 1] + high * R[b, j]
            R[row, i + j + 2] += high * R[b, j + 1]


@compiled
def compute(R: Integers, first: int, last: int, n: int) -> None:
    """Compute the rows of some stages from vectors of n digits."""
    for r in range(_STAGE_BEGIN[first], _STAGE_BEGIN[last + 1]):
        row = _ROW[r]
        for i in range(_DEGREE[row] * n):
            R[row, i] = 0
        for t in range(_ROW_BEGIN[r], _ROW_BEGIN[r + 1]):
            sign, a, b = _TERM[t, 0], _TERM[t, 1], _TERM[t, 2]
            _add_product(R, row, sign, a, _DEGREE[a] * n, b, _DEGREE[b] * n)
        _carry(R, row, _DEGREE[row] * n)


@compiled
def turn(R: Integers, vector: int, n: int) -> None:
    """Compute DETERMINANT as the product of UV with a vector in any rows."""
    for i in range(3 * n):
        R[DETERMINANT, i] = 0
    for k in range(3):
        _add_product(R, DETERMINANT, np.int64(1), vector + k, n, UV + k, 2 * n)
    _carry(R, DETERMINANT, 3 * n)


@compiled
def sign_of(R: Integers, row: int, n: int) -> int:
    """Sign of a row computed for vectors of n digits."""
    for i in range(_DEGREE[row] * n - 1, -1, -1):
        if R[row, i] != 0:
            return 1 if R[row, i] > 0 else -1
    return 0


@compiled
def value_of(R: Integers, row: int, step: float, n: int) -> tuple[float, float]:
    """Value of a row: a float, and what it rounds off, to 2**-100 of the value."""
    top = _DEGREE[row] * n - 1
    while top > 0 and R[row, top] == 0:
        top -= 1
    total, rest = 0.0, 0.0
    for i in range(top, max(top - 5, -1), -1):  # 5 digits hold at least 120 bits
        term = R[row, i] * _COUNTS[i]
        larger = total + term
        rest += term - (larger - total)
        total = larger
    larger = total + rest
    rest -= larger - total
    for _ in range(_DEGREE[row]):
        larger *= step
        rest *= step
    return larger, rest
