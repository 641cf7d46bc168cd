"""Exact arithmetic: signs and values of determinants of sites, without rounding.

Floats are dyadic fractions, so their determinants are integers in steps of some power
of two. Here an integer is a row of digits, lowest first,

    sum_i digit_i 2**(30 i),    -2**29 <= digit_i < 2**29,

whose highest nonzero digit has its sign. A product of digits takes 58 bits,
and no sum below has more than 24 of them at one place before digits are carried. The
rows lie in one array of scratch memory, and functions name them by number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.compiled import compiled
from ikns._kernels.voronoi.double_double import difference
from ikns.arrays import Array, Indices

#: Sites are cut off to steps of this size.
_FINEST = 2.0**-100
_BITS = 30
_HALF = 1 << (_BITS - 1)
#: What the i-th digit counts; the numbers of most digits are those of `POWER`.
_COUNTS = 2.0 ** (_BITS * np.arange(20))
_SHARES = 1 / _COUNTS

# Rows of the scratch array; a vector takes three. Numba would compile anew for each
# plain int that a function takes, but not for each int64.
_U, _V, _W, _T = np.arange(0, 12, 3)  # from a first site to others
VW, _WU, _UV = np.arange(12, 21, 3)  # vector products
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


# What is computed, stage by stage, from sites a, b, c, d, e: a normal of the facet
# a, c, d; six times the volume of a, b, c, d; their circumcenter seen from a, times
# twice that; the power of e to their sphere, times that.
NORMAL, VOLUME, SPHERE, TO_SPHERE = np.arange(4)
_STAGES: list[Sums] = [
    _cross(VW, _V, _W),
    [(DETERMINANT, _dot(_U, VW))],
    [
        *_cross(_WU, _W, _U),
        *_cross(_UV, _U, _V),
        *[(_UU, _dot(_U, _U)), (_VV, _dot(_V, _V)), (_WW, _dot(_W, _W))],
        *_weighted(CENTER, [(_UU, VW), (_VV, _WU), (_WW, _UV)]),
    ],
    [
        (_TT, _dot(_T, _T)),
        (POWER, [(1, _TT, DETERMINANT), *_dot(_T, CENTER, -1)]),
    ],
]
_STAGE_BEGIN = np.cumsum([0, *map(len, _STAGES)])
_ROW = np.array([row for stage in _STAGES for row, _ in stage])
_ROW_BEGIN = np.cumsum([0, *(len(terms) for stage in _STAGES for _, terms in stage)])
_TERM = np.array([term for stage in _STAGES for _, terms in stage for term in terms])


class Sites(NamedTuple):
    """N sites, as the predicates want them."""

    x: Array  # (N, 3)
    grain: Array  # (N,) powers of two that a site's coordinates are multiples of


def on_lattice(points: Array) -> Sites:
    """Sites (N, 3), at most 2**10 wide, cut off to steps of 2**-100."""
    x = np.trunc(points / _FINEST) * _FINEST
    fraction, exponent = np.frexp(x)
    digits = (fraction * 2.0**53).astype(np.int64)
    lowest = np.where(digits == 0, 2.0**53, digits & -digits)
    grain = np.ldexp(lowest, exponent - 53).min(axis=1)
    return Sites(x, np.minimum(grain, 1.0))


@compiled
def determinants(
    sites: Sites, R: Indices, a: int, b: int, c: int, d: int, e: int, last: int
) -> tuple[float, int]:
    """Compute the rows of all stages up to the last one, for five sites.

    Sites that the stages do not use should repeat some of the others. Returns what the
    lowest digits of vectors count, and their number of digits: two if two hold them,
    four hold all.
    """
    x, others = sites.x, (b, c, d, e)
    step, far = sites.grain[a], 0.0
    for i in others:
        step = min(step, sites.grain[i])
        for k in range(3):
            far = max(far, abs(x[i, k] - x[a, k]))
    n = 2
    if far > step * 2.0**58:
        step, n = _FINEST, 4
    for i in range(last == NORMAL, 4 if last == TO_SPHERE else 3):
        for k in range(3):
            _load(R, 3 * i + k, x[a, k], x[others[i], k], step, n)
    _compute(R, last, n)
    return step, n


@compiled
def _load(R: Indices, row: int, a: float, b: float, step: float, n: int) -> None:
    """Write b - a in n digits."""
    high, rest = difference(b, a)
    high, rest = high / step, rest / step
    for i in range(n - 1, 0, -1):
        digit = np.floor(high * _SHARES[i] + 0.5)
        high -= digit * _COUNTS[i]
        R[row, i] = np.int64(digit)
    R[row, 0] = np.int64(high) + np.int64(rest)  # below 2**58
    _carry(R, row, n)


@compiled
def _carry(R: Indices, row: int, n: int) -> None:
    """Bring the digits of a row back into their range."""
    carry = 0
    for i in range(n - 1):
        digit = R[row, i] + carry
        carry = (digit + _HALF) >> _BITS
        R[row, i] = digit - (carry << _BITS)
    R[row, n - 1] += carry


@compiled
def _compute(R: Indices, last: int, n: int) -> None:
    """Compute the rows of all stages up to the last from vectors of n digits."""
    for r in range(_STAGE_BEGIN[last + 1]):
        row = _ROW[r]
        for i in range(_DEGREE[row] * n):
            R[row, i] = 0
        for t in range(_ROW_BEGIN[r], _ROW_BEGIN[r + 1]):
            sign, a, b = _TERM[t, 0], _TERM[t, 1], _TERM[t, 2]
            for i in range(0, _DEGREE[a] * n, 2):  # by twos, as n is even
                low, high = sign * R[a, i], sign * R[a, i + 1]
                for j in range(0, _DEGREE[b] * n, 2):
                    R[row, i + j] += low * R[b, j]
                    R[row, i + j + 1] += low * R[b, j + 1] + high * R[b, j]
                    R[row, i + j + 2] += high * R[b, j + 1]
        _carry(R, row, _DEGREE[row] * n)


@compiled
def sign_of(R: Indices, row: int, n: int) -> int:
    """Sign of a row computed for vectors of n digits."""
    for i in range(_DEGREE[row] * n - 1, -1, -1):
        if R[row, i] != 0:
            return 1 if R[row, i] > 0 else -1
    return 0


@compiled
def values(
    sites: Sites, fives: Indices, last: int, row: int, value: Array, rest: Array
) -> None:
    """Write M rows, from `row` on, of K sets of five sites, by the stages up to `last`.

    `value` and `rest` (K, M) are floats, and what they round off; together they are off
    by less than 2**-100 of the value.
    """
    R = np.empty(SCRATCH, dtype=np.int64)
    for i in range(len(fives)):
        a, b, c, d = fives[i, 0], fives[i, 1], fives[i, 2], fives[i, 3]
        step, n = determinants(sites, R, a, b, c, d, fives[i, 4], last)
        for k in range(value.shape[1]):
            value[i, k], rest[i, k] = _value(R, row + k, step, n)


@compiled
def _value(R: Indices, row: int, step: float, n: int) -> tuple[float, float]:
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
