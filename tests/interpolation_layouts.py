"""Sites and queries that interpolation is tried on."""

import functools

import numpy as np

from ikns._kernels.voronoi.diagram import ANGLE, EDGE, EDGES, FACETS, HULL, PLANE
from ikns.nullspace.interpolation import NaturalNeighborInterpolator

CUBE = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
#: The paper's layout: the vertices of a box, the middles of its lower and upper face.
BOX = np.vstack([CUBE * [0.5, 0.4, 0.3], [[0.25, 0.2, 0.0], [0.25, 0.2, 0.3]]])


def turned(points, seed=5):
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return points @ rotation


LAYOUTS = {
    "cube": CUBE,
    "box": BOX,
    "box turned": turned(BOX),
    "box far away": turned(BOX) + [30.0, -20.0, 50.0],
    "grid 3": np.array(list(np.ndindex(3, 3, 3))) / 2.0,
    "grid 3 turned": turned(np.array(list(np.ndindex(3, 3, 3))) / 2.0),
    "random": np.random.default_rng(1).random((10, 3)),
    "nearly flat": np.random.default_rng(2).random((10, 3)) * [1, 1, 1e-5],
    "sphere": turned(np.vstack([np.eye(3), -np.eye(3), CUBE * 2 - 1])) / 2,
}
JITTERS = (0.0, 1e-15, 1e-12, 1e-9, 1e-5, 0.03)


def jittered(name, jitter, seed=0):
    """A layout with every site moved by Gaussian noise, m."""
    points = LAYOUTS[name]
    noise = np.random.default_rng(seed).normal(scale=jitter or 1, size=points.shape)
    scale = np.ptp(points, axis=0).clip(None, 1) if name == "nearly flat" else 1
    return points + noise * scale * (jitter > 0)


@functools.lru_cache
def built(name, jitter, outside="nearest"):
    return NaturalNeighborInterpolator(jittered(name, jitter), outside=outside)


def deep(net, queries):
    """Queries that are surely at least 2e-11 of the way from the hull to the middle."""
    middle = net.points.mean(axis=0)
    axes = np.linalg.svd(net.points - middle, full_matrices=False)[2]
    thickness = np.ptp((net.points - middle) @ axes[2])
    # Inside means within 8 roundings of the coordinates, of 2.2e-16 each; the middle of
    # N points is at least a part 1 / N of the set's thickness below the hull.
    rounding = 4e-15 * max(np.abs(net.points).max(), np.ptp(net.points, axis=0).max())
    share = 2e-11 + len(net.points) * rounding / thickness
    return queries[net.inside(queries + share * (queries - middle))]


def inside_queries(points, n, rng):
    """Places all over the hull, many of them near its rim."""
    return rng.dirichlet(np.full(len(points), 0.3), n) @ points


def hull_queries(net, depth, n, rng):
    """Places on the hull, every other almost on an edge, moved toward the middle."""
    facets = net.points[net.hull_facets[rng.integers(len(net.hull_facets), size=n)]]
    share = rng.dirichlet(np.ones(3), n)
    share[::2, 0] *= 1e-9
    share /= share.sum(axis=1, keepdims=True)
    on = np.einsum("qk,qkd->qd", share, facets)
    return on + depth * (net.points.mean(axis=0) - on)


def make_weights_negative(net):
    """Damage a diagram: the axes of all edges are turned around. Twice repairs it."""
    numbers, indices = net.packed
    edge = indices[EDGE]
    for _ in range(indices[EDGES]):
        axis = indices[ANGLE] + indices[edge + 3]
        numbers[axis : axis + 3] *= -1
        edge += 4 + 2 * indices[edge + 2]
    net._idle.clear()  # copies of what it was


def lead_astray(net):
    """Damage a diagram: no facet leads on, so that every walk fails that is needed."""
    numbers, indices = net.packed
    inner = indices[FACETS] - indices[HULL]
    numbers[indices[PLANE] :][: 10 * inner] = 0
    net._idle.clear()
