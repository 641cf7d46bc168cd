"""Null spaces and principal angles by other means: exact, planted, or LAPACK's."""

from fractions import Fraction

import numpy as np
from scipy.stats import ortho_group

#: Principal angles of every size in one pair of subspaces, rad.
MIXED = np.array([1e-14, 1e-10, 1e-5, 1.0, np.pi / 2 - 1e-10, np.pi / 2])


def exact_projector(J):
    """``1 - J' (J J')^-1 J`` in rational arithmetic, for independent rows."""
    rows = [[Fraction(x) for x in row] for row in J.tolist()]
    k, n = J.shape
    gram = [[sum(a * b for a, b in zip(r, s, strict=True)) for s in rows] for r in rows]
    table = [g + row for g, row in zip(gram, rows, strict=True)]
    for i in range(k):  # Gauss and Jordan; a Gram matrix needs no pivots
        table[i] = [x / table[i][i] for x in table[i]]
        for j in range(k):
            if j != i:
                factor = table[j][i]
                table[j] = [
                    x - factor * y for x, y in zip(table[j], table[i], strict=True)
                ]
    solved = [row[k:] for row in table]
    projector = np.eye(n)
    for a in range(n):
        for b in range(n):
            seen = sum(rows[i][a] * solved[i][b] for i in range(k))
            projector[a, b] = (a == b) - seen
    return projector


def svd_projector(J, rtol=1e-9):
    """Projectors by LAPACK's singular vectors, and ranks."""
    _, s, vt = np.linalg.svd(J, full_matrices=False)
    seen = s > rtol * s[..., :1]
    rows = vt * seen[..., None]
    return np.eye(J.shape[-1]) - np.swapaxes(rows, -2, -1) @ rows, seen.sum(axis=-1)


def svd_angles(A, B):
    """Principal angles by LAPACK's singular values, p >= r."""
    a, b = (np.linalg.svd(x, full_matrices=False)[2] for x in (A, B))
    overlap = b @ np.swapaxes(a, -2, -1)
    cosine = np.linalg.svd(overlap, compute_uv=False)
    sine = np.linalg.svd(b - overlap @ a, compute_uv=False)[..., ::-1]
    return np.arctan2(sine, cosine)


def mixed_pair(rng):
    """Bases at the angles MIXED in 12 dimensions, in mixtures of their rows."""
    frame = ortho_group.rvs(12, random_state=rng)
    # The cosine of pi / 2 - x as a double loses digits that the sine of x has.
    cosine = np.cos(MIXED)
    cosine[4:] = [1e-10, 0.0]
    b = cosine[:, None] * frame[:6] + np.sin(MIXED)[:, None] * frame[6:]
    mix = ortho_group.rvs(6, 2, random_state=rng) * rng.uniform(0.1, 1, (2, 6, 1))
    return mix[0] @ frame[:6], mix[1] @ b


def of_singular_values(rng, k, n, values):
    """A random (k, n) matrix with these singular values, and zeros."""
    u = ortho_group.rvs(k, random_state=rng) if k > 1 else np.eye(1)
    v = ortho_group.rvs(n, random_state=rng) if n > 1 else np.eye(1)
    return u[:, : len(values)] * values @ v[: len(values)]
