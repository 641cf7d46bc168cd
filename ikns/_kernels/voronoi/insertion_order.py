"""The order in which sites are inserted into a triangulation, for speed."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices

__all__ = ["insertion_order"]


def insertion_order(points: Array) -> Indices:
    """Biased randomized insertion order: most sites are close to the one before.

    First four far apart. Then random rounds, each of half of what is left, so that no
    layout makes large cavities (N. Amenta, S. Choi and G. Rote, Incremental
    constructions con BRIO, 2003); within a round along a space-filling curve
    (G. M. Morton, 1966).
    """
    rounds = np.floor(np.log2(1 - np.random.default_rng(0).random(len(points))))
    for rank, site in enumerate(_far_apart(points)):
        rounds[site] = rank - 100.0  # 2**-53 is the least random number
    fine = 1023 / np.ptp(points, axis=0).max()
    place = ((points - points.min(axis=0)) * fine).astype(np.int64)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3)):
        place = (place | place << shift) & mask
    curve = ((place | place << 2) & 0x09249249) @ [4, 2, 1]  # bits of x, y, z in turn
    return np.lexsort([curve, rounds])


def _far_apart(points: Array) -> list[int]:
    """Four sites that span space, as far as rounding can tell."""
    u = points - points[0]
    found = [0, int((u * u).sum(axis=1).argmax())]
    across = np.cross(u[found[1]], u)
    found.append(int((across * across).sum(axis=1).argmax()))
    return [*found, int(np.abs(u @ across[found[2]]).argmax())]
