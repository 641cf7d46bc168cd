"""Where to put PCA points in a box, and how long visiting them takes."""

import itertools
from collections.abc import Callable

import numpy as np
from scipy.spatial.distance import cdist
from scipy.stats import qmc

from ikns.nullspace.clustering import BoundingBox, box_surface_points

__all__ = ["GRIDS", "LAYOUTS", "SIZES", "minutes"]

Array = np.ndarray

#: How many points are tried.
SIZES = (5, 8, 10, 12, 18, 27, 36, 60)
#: Points along each side of regular grids.
GRIDS = {
    8: (2, 2, 2),
    12: (2, 2, 3),
    18: (2, 3, 3),
    27: (3, 3, 3),
    36: (3, 3, 4),
    60: (3, 4, 5),
}
#: Time at a point, and of a reach: at least, and per meter, s (the simulated person's).
_AT_POINT, _REACH, _REACH_PER_M = 5.0, 0.6, 1.2


def box_surface(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """Vertices, upper and lower face, other faces, edges, and on: the paper's rule."""
    half = (high - low) / 2
    order = np.argsort(-half)
    box = BoundingBox((low + high) / 2, np.eye(3)[order], half[order])
    return box_surface_points(box, n, up=(0.0, 1.0, 0.0))


def filled(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """Vertices, the middle, then always what is farthest from all before.

    Distances are those in the unit cube, so that every side is halved in turn.
    """
    line = np.linspace(0.0, 1.0, 9)
    grid = np.array(list(itertools.product(line, repeat=3)))
    start = box_surface(np.zeros(3), np.ones(3), min(n, 8), rng)
    return low + _farthest(grid, start, n) * (high - low)


def random_inside(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """Anywhere in the box."""
    return rng.uniform(low, high, (n, 3))


def halton(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """Halton's sequence, scrambled: random, but evenly spread."""
    return low + qmc.Halton(3, seed=rng).random(n) * (high - low)


def shell(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """On the ellipsoid that touches the box from inside, evenly spread."""
    k = np.arange(400) + 0.5
    y, turn = 1 - 2 * k / 400, np.pi * (1 + np.sqrt(5)) * k
    radius = np.sqrt(1 - y**2)
    sphere = np.column_stack([radius * np.cos(turn), y, radius * np.sin(turn)])
    places = _farthest(sphere, sphere[[0]], n)
    return (low + high) / 2 + places * (high - low) / 2


def grid(low: Array, high: Array, n: int, rng: np.random.Generator) -> Array:
    """Regular grid, the longest side with most points."""
    counts = np.empty(3, dtype=int)
    counts[np.argsort(high - low, kind="stable")] = GRIDS[n]
    lines = [np.linspace(0.0, 1.0, count) for count in counts]
    return low + np.array(list(itertools.product(*lines))) * (high - low)


#: The first points of the larger layouts are the smaller ones, but for grids.
LAYOUTS: dict[str, Callable[[Array, Array, int, np.random.Generator], Array]] = {
    "box surface (paper)": box_surface,
    "vertices, then inside": filled,
    "grid": grid,
    "Halton": halton,
    "random": random_inside,
    "ellipsoid": shell,
}


def minutes(points: Array) -> float:
    """Time to visit points, 5 s each, always going on to the nearest, min."""
    apart = cdist(points, points)
    left, here, way = set(range(1, len(points))), 0, 0.0
    while left:
        after = min(left, key=lambda k: apart[here, k])
        way += _REACH + _REACH_PER_M * apart[here, after]
        left.remove(after)
        here = after
    return (_AT_POINT * len(points) + way) / 60


def _farthest(candidates: Array, start: Array, n: int) -> Array:
    """Add candidates, each the farthest from all before, until there are `n`."""
    chosen = list(start[:n])
    gap = cdist(candidates, start).min(axis=1)
    while len(chosen) < n:
        chosen.append(candidates[gap.argmax()])
        gap = np.minimum(gap, cdist(candidates, chosen[-1][None])[:, 0])
    return np.array(chosen)
