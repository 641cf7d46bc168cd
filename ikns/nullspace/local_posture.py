"""What a person's elbow does at a particular place, beyond any smooth rule.

People come back to the same places (the lap, the mouth, the end of a reach) and hold
the arm there as before, some 4 deg off what a quadratic of the wrist center says. This
is remembered as a sum of bumps around places where the wrist was,

    sum_j a_j k(|w - w_j| / R),   k(r) = (1 - r)^4 (1 + 4 r) for r < 1, else 0

(Wendland 1995: smooth, and exactly zero beyond R). It says nothing of places that were
not visited.
"""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array

#: Reach R of a bump, m. Between 0.12 and 0.21 m real people's reaches change c alike.
REACH = 0.15
#: Bumps are at least so far apart, m, and at most so many: a live frame adds them all.
_APART, _MOST = 0.04, 64
#: Samples that are looked at when bumps are laid out and fitted.
_SAMPLES = 4000


def nearness(wrist_in_thorax: Array, places_in_thorax: Array) -> Array:
    """Bumps k around places (M, D) m at wrist centers (..., D) m: (..., M)."""
    way = wrist_in_thorax[..., None, :] - places_in_thorax
    r = np.minimum(np.sqrt((way**2).sum(axis=-1)) / REACH, 1.0)
    return np.asarray((1 - r) ** 4 * (1 + 4 * r))


def local_swivel(
    wrist_in_thorax: Array, places_in_thorax: Array, heights: Array
) -> Array:
    """Sum of the bumps at wrist centers (..., D) m, (...) rad.

    Place by place, as all distances of a long recording at once would fill the memory.
    """
    total = np.zeros(wrist_in_thorax.shape[:-1])
    for place, height in zip(places_in_thorax, heights, strict=True):
        total += height * nearness(wrist_in_thorax, place[None])[..., 0]
    return total


def fit_local(
    wrist_in_thorax: Array, left_rad: Array, penalty: float
) -> tuple[Array, Array]:
    """Learn the bumps from what a smooth rule leaves.

    ``a = argmin mean_t (left_t - sum_j a_j k_j(w_t))^2 + penalty a' K a`` with K the
    bumps at each other's places: kernel ridge regression on a subset of the samples.

    Parameters
    ----------
    wrist_in_thorax : (N, D) array
        m.
    left_rad : (N,) array
        Swivel less the smooth rule.
    penalty : float
        Above 0.

    Returns
    -------
    places : (M, D) array
        m.
    heights : (M,) array
        a, rad.
    """
    keep = np.linspace(0, len(left_rad) - 1, min(len(left_rad), _SAMPLES)).astype(int)
    w, left = wrist_in_thorax[keep], left_rad[keep]
    places = _spread(w)
    near = nearness(w, places)
    matrix = near.T @ near / len(w) + penalty * nearness(places, places)
    return places, np.linalg.solve(matrix, near.T @ left / len(w))


def _spread(w: Array) -> Array:
    """Return samples far from each other: each the farthest from all before."""
    chosen = [int(((w - w.mean(axis=0)) ** 2).sum(axis=1).argmin())]
    far = np.full(len(w), np.inf)
    while len(chosen) < _MOST:
        far = np.minimum(far, ((w - w[chosen[-1]]) ** 2).sum(axis=1))
        farthest = int(far.argmax())
        if far[farthest] < _APART**2:
            break
        chosen.append(farthest)
    return w[chosen]
