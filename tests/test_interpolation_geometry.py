"""The triangulation, the hull and the neighbors behind natural-neighbor weights."""

import itertools

import numpy as np
import pytest
from interpolation_layouts import JITTERS, LAYOUTS, built
from natural_neighbor_oracle import nearest_on_hull
from scipy.spatial import ConvexHull, Delaunay

from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.interpolation.diagram import diagram


def test_far_outside_the_projection_is_the_nearest_point_of_the_hull():
    rng = np.random.default_rng(8)
    for points in LAYOUTS.values():
        net = NaturalNeighborInterpolator(points, outside="project")
        center, size = points.mean(axis=0), np.ptp(points, axis=0).max()
        direction = rng.normal(size=(100, 3))
        x = center + direction * size * rng.uniform(0.5, 30, (100, 1))
        x = x[~net.inside(x)]
        y = nearest_on_hull(points, net.hull_facets, x)
        # All sites lie behind the plane through y at a right angle to x - y.
        normal = (x - y) / np.linalg.norm(x - y, axis=1, keepdims=True)
        beyond = np.einsum("qk,qnk->qn", normal, points - y[:, None])
        rounding = 1e-15 * (np.abs(points).max() + 30 * size)
        assert beyond.max() < 10 * rounding
        np.testing.assert_allclose(net.weights(x) @ points, y, atol=1e-10 * size)


def connected(edges, n):
    reached = {0}
    for _ in range(n):
        reached |= {j for i, j in edges if i in reached}
        reached |= {i for i, j in edges if j in reached}
    return len(reached) == n


def pairs(net):
    return {(int(i), int(j)) for i, j in net.edges}


@pytest.mark.parametrize("jitter", [0, 1e-15, 1e-12])
def test_edges_of_a_cube_have_no_diagonals_whatever_the_rounding(jitter):
    grid = {
        (i, j)
        for i, j in itertools.combinations(range(27), 2)
        if np.isclose(np.abs(LAYOUTS["grid 3"][i] - LAYOUTS["grid 3"][j]).sum(), 0.5)
    }
    assert len(grid) == 54
    for name in ("grid 3", "grid 3 turned"):
        net = built(name, jitter)
        assert pairs(net) == grid


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_edges_connect_all_sites(name, jitter):
    net = built(name, jitter)
    assert connected(pairs(net), len(net.points))


def test_edges_of_sites_in_general_position_are_delaunays():
    points = np.random.default_rng(9).random((40, 3))
    known = {
        tuple(sorted((int(i), int(j))))
        for simplex in Delaunay(points).simplices
        for i, j in itertools.combinations(simplex, 2)
    }
    assert pairs(NaturalNeighborInterpolator(points)) == known


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_tetrahedra_fill_the_hull_and_their_spheres_hold_no_site(name, jitter):
    net = built(name, jitter)
    points = net.points
    centered = points - points.mean(axis=0)
    edges = centered[net.simplices[:, 1:]] - centered[net.simplices[:, :1]]
    volume = np.linalg.det(edges) / 6
    hull = ConvexHull(centered, qhull_options="QJ1e-12").volume
    # Determinants of 3 rows are rounded by 1e-15 of the rows' product, at most 5.
    np.testing.assert_allclose(volume.sum(), hull, atol=1e-14 * len(points))
    assert volume.min() > -1e-14
    facets = centered[net.hull_facets]
    outward = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])
    above = np.einsum("hk,hnk->hn", outward, centered - facets[:, :1])
    assert above.max() < 1e-14
    np.testing.assert_allclose(np.linalg.det(facets).sum() / 6, hull, atol=1e-13)
    # In-sphere determinants, relative to the tetrahedron: negative = inside.
    w = centered - centered[net.simplices[:, :1]]
    square = (edges**2).sum(axis=2)
    u, v, t = edges.transpose(1, 0, 2)
    gradient = (
        square[:, :1] * np.cross(v, t)
        + square[:, 1:2] * np.cross(t, u)
        + square[:, 2:] * np.cross(u, v)
    )
    lifted = (w**2).sum(axis=2) * 6 * volume[:, None]
    assert (lifted - np.einsum("tk,tnk->tn", gradient, w)).min() > -1e-13


def test_neighbors_of_a_tetrahedron_share_three_of_its_sites():
    d = diagram(LAYOUTS["grid 3"])
    simplices = d.simplices.tolist()
    for simplex, row in zip(simplices, d.neighbors.tolist(), strict=True):
        for vertex, other in zip(simplex, row, strict=True):
            if other >= 0:
                assert set(simplex) - {vertex} < set(simplices[other])
