"""Predicates of sites in fractions, ties decided by lifts that are truly there.

Determinants of sites on a lattice of 2**-100 are multiples of 2**-500. The squared norm
of site i is lifted by 2**(-2000 (i + 1)), so that a tie is decided by the first lift
that counts, and nothing else is.
"""

from fractions import Fraction

LATTICE = 100


def on_lattice(points):
    """Sites as integers in steps of the lattice, cut off to it."""
    step = 2**LATTICE
    return [[int(Fraction(float(v)) * step) for v in point] for point in points]


def exactly(points):
    """Sites as fractions, cut off to the lattice."""
    step = 2**LATTICE
    return [[Fraction(v, step) for v in point] for point in on_lattice(points)]


def determinant(rows):
    """Determinant by the first column."""
    if len(rows) == 1:
        return rows[0][0]
    return sum(
        (-1) ** i * row[0] * determinant([r[1:] for r in rows[:i] + rows[i + 1 :]])
        for i, row in enumerate(rows)
        if row[0]
    )


def cross(a, b):
    """Vector product."""
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def dot(a, b):
    """Scalar product."""
    return sum(p * q for p, q in zip(a, b, strict=True))


def between(a, b):
    """Vector from a to b."""
    return [q - p for p, q in zip(a, b, strict=True)]


def volume(sites, a, b, c, d):
    """Six times the signed volume of a tetrahedron."""
    return determinant([between(sites[a], sites[i]) for i in (b, c, d)])


def above_sphere(sites, a, b, c, d, e):
    """Power of e to the sphere of a, b, c, d, times six volumes; lifted if 0."""

    def row(i, lifted):
        edge = between(sites[a], sites[i])
        square = dot(edge, edge)
        if lifted:
            square += Fraction(1, 2 ** (2000 * (i + 1)))
            square -= Fraction(1, 2 ** (2000 * (a + 1)))
        return [*edge, square]

    power = determinant([row(i, False) for i in (b, c, d, e)])
    return power or determinant([row(i, True) for i in (b, c, d, e)])


def sign(value):
    """Return -1, 0 or 1."""
    return (value > 0) - (value < 0)
