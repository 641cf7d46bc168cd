"""The compiled diagram against the one of exact fractions, field by field."""

from dataclasses import fields
from fractions import Fraction

import numpy as np
import pytest
from diagram_oracle import voronoi
from hypothesis import given, settings
from hypothesis import strategies as st
from interpolation_layouts import CUBE, JITTERS, LAYOUTS, jittered, turned

from ikns.errors import NotEnoughData
from ikns.nullspace.interpolation.diagram import diagram
from ikns.nullspace.interpolation.inputs import checked_points
from ikns.nullspace.interpolation.voronoi import Voronoi

GRID = np.array(list(np.ndindex(4, 4, 4))) / 3.0
RNG = np.random.default_rng(0)
LARGER = {
    "300 at random": RNG.random((300, 3)),
    "grid 4": GRID,
    "grid 4 turned": turned(GRID),
    "grid 4 jittered": GRID + 1e-11 * RNG.normal(size=GRID.shape),
    "nearly flat": RNG.random((40, 3)) * [1, 1, 1e-8],
    "clusters": np.vstack([c + 1e-8 * RNG.random((20, 3)) for c in RNG.random((3, 3))]),
    "far away": CUBE + [3000.1, -200.2, 0.3],
    "a long ring": np.vstack(
        [
            *([0.0, 0.0, 0.0], [0.0, 0.0, 0.3]),
            [[np.cos(t), np.sin(t), 0.15 + 0.01 * np.cos(9 * t)] for t in range(60)],
        ]
    )
    / 2,
}


def compare(points):
    found = diagram(points)
    simplices = [tuple(map(int, row)) for row in found.simplices]
    true = voronoi(points, simplices, found.neighbors.tolist())
    for field in fields(Voronoi):
        a, b = getattr(found, field.name), getattr(true, field.name)
        assert a.flags.c_contiguous
        assert a.dtype == b.dtype
        assert a.shape == b.shape
        if a.dtype == np.int64:
            assert (a == b).all(), field.name
    # A length is the ratio of three determinants times a square root: with their
    # roundings, 13 of half a unit in the last place, 3 more of the exact one; of a
    # sine and a unit vector, fewer. (Measured: 3 units.)
    for name in ("length", "sine", "axis", "normal"):
        np.testing.assert_allclose(
            getattr(found, name), getattr(true, name), rtol=16 * 1.1e-16, atol=0
        )
    # A circumcenter is off by 2**-100 (numerator) + 2**-100 (denominator) + a few times
    # 2**-106 (their ratio), a normal's direction by as much. (Measured: 6e-32.)
    for name in ("circumcenter", "normal"):
        a, b = double_double(found, name), double_double(true, name)
        for x, y in zip(a, b, strict=True):
            k = max(range(3), key=lambda i: abs(y[i]))
            scale = x[k] / y[k] if name == "normal" else 1
            for p, q in zip(x, y, strict=True):
                assert abs(p - q * scale) <= abs(q) * 2**-97
    for name in ("circumcenter", "normal"):
        high, rest = getattr(found, name), getattr(found, name + "_rest")
        assert (np.abs(rest) <= np.abs(high) * 2.0**-53).all()


def double_double(d, name):
    high, rest = getattr(d, name).tolist(), getattr(d, name + "_rest").tolist()
    return [
        [Fraction(a) + Fraction(b) for a, b in zip(*rows, strict=True)]
        for rows in zip(high, rest, strict=True)
    ]


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_every_number_is_exact_to_its_last_digits(name, jitter):
    compare(jittered(name, jitter))


@pytest.mark.parametrize("name", LARGER)
def test_every_number_of_a_larger_set_is_exact_to_its_last_digits(name):
    compare(LARGER[name])


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(4, 14),
    steps=st.sampled_from([1, 2, 4, 1000]),
    jitter=st.sampled_from([0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-4]),
    turn=st.booleans(),
)
@settings(max_examples=80, deadline=None)
def test_every_number_is_exact_on_any_lattice_points(seed, n, steps, jitter, turn):
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(steps + 1, size=(n, 3)) / steps, axis=0)
    points = turned(points, seed) if turn else points
    points = points + jitter * rng.normal(size=points.shape)
    try:
        checked_points(points)
    except NotEnoughData:
        return
    compare(points)


def test_lines_between_co_spherical_sites_have_no_length_at_all():
    d = diagram(np.array(list(np.ndindex(3, 3, 3)), dtype=float))
    within, across = d.length[d.length == 0], d.length[d.length == 1]
    # Eight cubes in 5 or 6 tetrahedra each, with 4 or 6 facets in between; between two
    # cubes, 12 times, a square in 2 triangles; outside, 24 squares.
    assert len(across) == 2 * 12
    assert 4 * 8 <= len(within) <= 6 * 8
    assert np.isinf(d.length).sum() == 2 * 24
    assert len(d.length) == len(within) + len(across) + 2 * 24


def test_faces_of_an_inner_site_fill_its_whole_view():
    points = RNG.random((60, 3))
    d = diagram(points)
    angle = d.solid_angles(points)
    whole = np.bincount(d.edges.ravel(), np.repeat(angle, 2), len(points))
    inner = np.setdiff1d(np.arange(60), d.hull_facets)
    assert len(inner) > 5
    # Seen from both sites a face is as large; about 20 of them, each of 5 triangles
    # rounded by a few 1e-16 times 1 / |cosine| of its slant.
    np.testing.assert_allclose(whole[inner], 4 * np.pi, atol=1e-12)
    cube = diagram(GRID)
    angle = cube.solid_angles(GRID)
    seen = angle[angle > 1e-9]
    inner = np.isin(cube.edges[angle > 1e-9], [21, 22, 25, 26, 37, 38, 41, 42])
    np.testing.assert_allclose(seen[inner.any(axis=1)], 4 * np.pi / 6, atol=1e-14)


@given(seed=st.integers(0, 2**32 - 1), near=st.sampled_from([0, 0.7e-10, 1.3e-10]))
@settings(max_examples=60, deadline=None)
def test_the_first_site_that_is_not_alone_is_named(seed, near):
    rng = np.random.default_rng(seed)
    points = np.vstack([CUBE, rng.integers(2, size=(6, 3)) + 0.5])
    points += near * rng.integers(3, size=points.shape)
    size = np.ptp(points, axis=0).max()
    distance = np.abs(points[:, None] - points).max(axis=2)
    distance[np.tril_indices(len(points))] = 9
    pairs = np.argwhere(distance <= 1e-10 * size)
    if not len(pairs):
        checked_points(points)
        return
    first = pairs[0, 0]
    with pytest.raises(
        NotEnoughData, match=f"points {first} and {distance[first].argmin()} "
    ):
        checked_points(points)
