"""The compiled triangulation: against its definition, and against Delaunay's lemma."""

import numpy as np
import pytest
from delaunay_oracle import delaunay
from hypothesis import given, settings
from hypothesis import strategies as st
from interpolation_layouts import JITTERS, LAYOUTS, jittered, turned

from ikns._kernels.voronoi.delaunay import triangulate
from ikns._kernels.voronoi.exact import on_lattice
from ikns.nullspace.interpolation.diagram import insertion_order


def as_set(simplices):
    return set(map(tuple, np.sort(simplices, axis=1).tolist()))


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_it_has_all_tetrahedra_whose_spheres_hold_no_site(name, jitter):
    points = jittered(name, jitter)
    simplices, _ = triangulate(on_lattice(points), insertion_order(points))
    assert len(simplices) == len(as_set(simplices))
    assert as_set(simplices) == delaunay(points)


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(5, 40),
    steps=st.sampled_from([1, 2, 3, 6]),
    jitter=st.sampled_from([0, 1e-16, 1e-12]),
)
@settings(max_examples=100, deadline=None)
def test_the_order_of_insertion_changes_nothing(seed, n, steps, jitter):
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(steps + 1, size=(n, 3)) / steps, axis=0)
    points = points + jitter * rng.normal(size=points.shape)
    if len(points) < 4:
        return
    sites = on_lattice(points)
    order = insertion_order(points)
    simplices, neighbors = triangulate(sites, order)
    for _ in range(3):
        rng.shuffle(order[3:])
        again, _ = triangulate(sites, order)
        assert as_set(again) == as_set(simplices)
    if len(simplices):
        hold_delaunays_law(points, simplices, neighbors)


def grid(n):
    return np.array(list(np.ndindex(n, n, n))) / (n - 1)


def on_sphere(directions):
    return directions / np.linalg.norm(directions, axis=1)[:, None] / 2


RNG = np.random.default_rng(0)
SETS = {
    "1000 at random": RNG.random((1000, 3)),
    "3000 at random": RNG.random((3000, 3)),
    "grid 8": grid(8),
    "grid 8 turned": turned(grid(8)),
    "grid 9 jittered": grid(9) + 1e-11 * RNG.normal(size=(729, 3)),
    "300 near a sphere": on_sphere(RNG.normal(size=(300, 3))),
    "nearly flat": RNG.random((300, 3)) * [1, 1, 1e-8],
    "clusters": np.vstack([c + 1e-8 * RNG.random((60, 3)) for c in RNG.random((4, 3))]),
    "far away": grid(5) + [3000.1, -200.2, 0.3],
}


@pytest.mark.parametrize("name", SETS)
def test_no_sphere_holds_a_site(name):
    points = SETS[name]
    simplices, neighbors = triangulate(on_lattice(points), insertion_order(points))
    hold_delaunays_law(points, simplices, neighbors)


def hold_delaunays_law(points, simplices, neighbors):
    """Check what makes a Delaunay triangulation, in integers.

    Tetrahedra are positive, no sphere holds the site across a facet, the hull is a
    sphere without a dent: then no sphere holds any site (Delaunay's lemma).
    """
    x = np.array(
        [[int(v) for v in row] for row in np.trunc(points * 2.0**100)], dtype=object
    )
    assert set(simplices.ravel()) == set(range(len(points)))
    u, v, w = (x[simplices[:, k]] - x[simplices[:, 0]] for k in (1, 2, 3))
    volume = dot(cross(u, v), w)
    assert (volume > 0).all()
    center = sum(
        dot(a, a)[:, None] * cross(b, c)
        for a, b, c in ((u, v, w), (v, w, u), (w, u, v))
    )
    here, place = np.nonzero(neighbors >= 0)
    there = neighbors[here, place]
    back = (neighbors[there] == here[:, None]).argmax(axis=1)
    assert (neighbors[there, back] == here).all()
    shared = np.sort(np.where(np.arange(4) == place[:, None], -1, simplices[here]))
    again = np.sort(np.where(np.arange(4) == back[:, None], -1, simplices[there]))
    assert (shared == again).all()
    t = x[simplices[there, back]] - x[simplices[here, 0]]
    assert (dot(t, t) * volume[here] >= dot(t, center[here])).all()

    outward = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    here, place = np.nonzero(neighbors < 0)
    facets = simplices[here[:, None], outward[place]]
    opposite = {}
    for facet in facets.tolist():
        for k in range(3):
            opposite[facet[k], facet[k - 2]] = facet[k - 1], facet
    assert len(opposite) == 3 * len(facets)
    beyond = [opposite[j, i][0] for i, j in opposite]
    a, b, c = (x[[facet[k] for _, facet in opposite.values()]] for k in range(3))
    assert (dot(cross(b - a, c - a), x[beyond] - a) <= 0).all()
    assert len(set(facets.ravel())) - len(opposite) // 2 + len(facets) == 2


def cross(a, b):
    return np.roll(a, -1, axis=1) * np.roll(b, -2, axis=1) - (
        np.roll(a, -2, axis=1) * np.roll(b, -1, axis=1)
    )


def dot(a, b):
    return (a * b).sum(axis=1)


def test_sites_on_two_skew_lines_have_as_many_tetrahedra_as_pairs_of_gaps():
    along = np.linspace(0, 1, 40)
    zero, one = np.zeros(40), np.ones(40)
    points = np.vstack(
        [np.column_stack([along, zero, zero]), np.column_stack([zero, along, one])]
    )
    simplices, neighbors = triangulate(on_lattice(points), insertion_order(points))
    assert len(simplices) == 39 * 39
    hold_delaunays_law(points, simplices, neighbors)


@pytest.mark.parametrize(
    "points",
    [
        LAYOUTS["cube"] * [1, 1, 0] + [0, 0, 0.5],
        grid(3)[:9],
        np.outer(np.arange(6), [0.1, 0.2, 0.3]),
    ],
)
def test_sites_in_a_plane_have_no_tetrahedra(points):
    simplices, neighbors = triangulate(on_lattice(points), np.arange(len(points)))
    assert simplices.shape == neighbors.shape == (0, 4)
