"""Orthonormal bases of null spaces and row spaces, by Householder reflections.

The reflections H_0 H_1 ... bring the rows, longest remaining one first, to triangular
form (QR of the transpose with column pivoting; Businger and Golub 1965, Numer Math
7:269). Axes 0 to rank - 1, reflected back, span the row space; the other axes span the
null space. The smallest of m singular values is at least ``|r_mm| / 2^(m - 1)``, r_mm
being the last length on the triangle's diagonal (Faddeev, Kublanovskaya and Faddeeva
1968; Lawson and Hanson 1974, Solving Least Squares Problems, ch. 6). Where this bound
does not separate it from zero, plane rotations make the rows orthogonal, so that their
lengths are the singular values (one-sided Jacobi; Hestenes 1958, J SIAM 6:51), and rows
that count as zero are left out.
"""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.compiled import compiled, inner
from ikns.arrays import Array, Indices

#: Rounding of a double.
_EPS = 2.0**-52
#: Squares stay far from overflow and underflow while their sum is in this range.
_SMALL, _LARGE = 1e-200, 1e200
#: Jacobi rotations converge quadratically: matrices up to (14, 14) took 11 at most.
_SWEEPS = 30


@compiled
def write_bases(
    matrices: Array, rtol: float, of_rows: bool, basis: Array, rank: Indices
) -> None:
    """Write bases of (N, k, n) matrices to rows (N, d, n), and their ranks (N,).

    Of the row spaces if `of_rows`, else of the null spaces; cut to d rows, or filled
    with zeros. NaN and -1 where a matrix is not finite.
    """
    count, k, n = matrices.shape
    work, factors = np.empty((k, n)), np.empty(k)
    for i in range(count):
        r = _certain_rank(matrices[i], rtol, work, factors)
        if r < 0:
            r = _careful_rank(matrices[i], rtol, work, factors)
        rank[i] = r
        first, last = (0, r) if of_rows else (r, n)
        for row in range(basis.shape[1]):
            if r >= 0 and first + row < last:
                _reflected_axis(work, factors, r, first + row, basis[i, row])
            else:
                for j in range(n):
                    basis[i, row, j] = np.nan if r < 0 else 0.0


@compiled
def _certain_rank(rows: Array, rtol: float, work: Array, factors: Array) -> int:
    """Write the reflections of a (k, n) matrix and return its rank; -1 if uncertain.

    Singular values up to ``rtol * largest`` count as zero; `rtol` is 1e-16 or more.
    `work` (k, n) and `factors` (k,) get ``H_s = 1 - f_s w_s' w_s`` in their first rows,
    as many as the rank.
    """
    k, n = rows.shape
    total = _copy(rows, 1.0, work, factors)
    if not _SMALL < total < _LARGE:
        return -1
    steps = min(k, n)
    least = _reflect(work, steps, factors)
    # The Frobenius norm is at least the largest singular value.
    return steps if least > (rtol + k * n * _EPS) * math.sqrt(total) else -1


@compiled
def _careful_rank(rows: Array, rtol: float, work: Array, factors: Array) -> int:
    """Do the same by the singular values; -1 when the matrix is not finite."""
    largest = 0.0
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            if not math.isfinite(rows[i, j]):
                return -1
            if abs(rows[i, j]) > largest:
                largest = abs(rows[i, j])
    # Scaling by a power of two is exact. For a subnormal entry it would overflow.
    scale = math.ldexp(1.0, min(-math.frexp(largest)[1], 1000))
    _copy(rows, scale, work, factors)
    rank = orthogonalize(work, rtol, factors)
    _reflect(work, rank, factors)
    return rank


@compiled
def _reflected_axis(
    work: Array, factors: Array, rank: int, axis: int, row: Array
) -> None:
    """Write axis number `axis` after the first `rank` reflections, (n,)."""
    n = work.shape[1]
    for j in range(n):
        row[j] = 0.0
    row[axis] = 1.0
    for s in range(rank - 1, -1, -1):
        dot = 0.0
        for j in range(s, n):
            dot += work[s, j] * row[j]
        dot *= factors[s]
        for j in range(s, n):
            row[j] -= dot * work[s, j]


@inner
def orthogonalize(rows: Array, rtol: float, squares: Array) -> int:
    """Rotate the rows (k, n) of a matrix until orthogonal; return its rank.

    `squares` (k,) gets the squared singular values, unsorted; singular values up to
    ``rtol * largest`` count as zero.
    """
    k, n = rows.shape
    noise, orthogonal = 0.0, (n * _EPS) ** 2
    for i in range(k):
        for m in range(n):
            noise += (_EPS * rows[i, m]) ** 2
    for _ in range(_SWEEPS):
        rotated = False
        for i in range(k - 1):
            for j in range(i + 1, k):
                ii, jj, ij = 0.0, 0.0, 0.0
                for m in range(n):
                    ii += rows[i, m] * rows[i, m]
                    jj += rows[j, m] * rows[j, m]
                    ij += rows[i, m] * rows[j, m]
                # Rows that are only rounding errors would be rotated endlessly.
                if ii <= noise or jj <= noise or ij * ij <= orthogonal * ii * jj:
                    continue
                rotated = True
                zeta = (jj - ii) / (2.0 * ij)
                t = 1.0 / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                if zeta < 0.0:
                    t = -t
                c = 1.0 / math.sqrt(1.0 + t * t)
                for m in range(n):
                    x, y = rows[i, m], rows[j, m]
                    rows[i, m] = c * (x - t * y)
                    rows[j, m] = c * (y + t * x)
        if not rotated:
            break
    largest = 0.0
    for i in range(k):
        squares[i] = 0.0
        for m in range(n):
            squares[i] += rows[i, m] * rows[i, m]
        if squares[i] > largest:
            largest = squares[i]
    rank = 0
    for i in range(k):
        if math.sqrt(squares[i]) > rtol * math.sqrt(largest):
            rank += 1
    return rank


@compiled
def _copy(rows: Array, scale: float, work: Array, squares: Array) -> float:
    """Copy a matrix, write the squares of its rows and return their sum."""
    total = 0.0
    for i in range(rows.shape[0]):
        square = 0.0
        for j in range(rows.shape[1]):
            x = rows[i, j] * scale
            work[i, j] = x
            square += x * x
        squares[i] = square
        total += square
    return total


@compiled
def _reflect(work: Array, steps: int, squares: Array) -> float:
    """Reflect, longest row first; return a bound below the last singular value.

    `squares` holds the squared lengths of the rows, then of their remainders; those of
    finished rows are replaced by the factors of :func:`_certain_rank`.
    """
    k, n = work.shape
    length, share = 0.0, 2.0
    for s in range(steps):
        longest = s
        for i in range(s + 1, k):
            if squares[i] > squares[longest]:
                longest = i
        length = math.sqrt(squares[longest])
        share *= 0.5
        if length == 0.0:
            break
        if longest != s:
            squares[longest] = squares[s]
            for j in range(n):
                work[s, j], work[longest, j] = work[longest, j], work[s, j]
        head = work[s, s] + math.copysign(length, work[s, s])
        squares[s] = 1.0 / (length * abs(head))
        work[s, s] = head
        for i in range(s + 1, k):
            dot = 0.0
            for j in range(s, n):
                dot += work[s, j] * work[i, j]
            dot *= squares[s]
            work[i, s] -= dot * head
            squares[i] = 0.0
            for j in range(s + 1, n):
                work[i, j] -= dot * work[s, j]
                squares[i] += work[i, j] * work[i, j]
    return length * share
