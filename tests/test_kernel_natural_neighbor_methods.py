"""Laplace's weights against exact arithmetic; laws of Sibson's smooth interpolant."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interpolation_layouts import (
    BOX,
    CUBE,
    JITTERS,
    LAYOUTS,
    deep,
    hull_queries,
    inside_queries,
    jittered,
)
from natural_neighbor_oracle import values as oracle_values
from voronoi_oracle import laplace_weights

from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.interpolation import NaturalNeighborInterpolator

#: As of Sibson's weights: each length and angle is known to 4e-13.
WEIGHT = 1e-12


def exact(points, queries):
    return np.array([[float(w) for w in laplace_weights(points, q)] for q in queries])


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_laplace_weights_are_exact_areas_over_distances(name, jitter):
    rng = np.random.default_rng(7)
    net = NaturalNeighborInterpolator(jittered(name, jitter), method="laplace")
    queries = [inside_queries(net.points, 2, rng)]
    queries += [hull_queries(net, depth, 1, rng) for depth in (1e-3, 1e-6, 1e-10)]
    queries = deep(net, np.vstack(queries))
    truth = exact(net.points, queries)
    np.testing.assert_allclose(net.weights(queries), truth, atol=WEIGHT, rtol=0)
    one = np.array([net.weights(x) for x in queries])
    np.testing.assert_allclose(one, truth, atol=WEIGHT, rtol=0)


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(4, 12),
    steps=st.sampled_from([1, 2, 4, 1000]),
    jitter=st.sampled_from([0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-4]),
)
@settings(max_examples=50, deadline=None)
def test_any_lattice_points_get_exact_laplace_weights(seed, n, steps, jitter):
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(steps + 1, size=(n, 3)) / steps, axis=0)
    points = points + jitter * rng.normal(size=points.shape)
    try:
        net = NaturalNeighborInterpolator(points, method="laplace")
    except NotEnoughData:
        return
    query = deep(net, inside_queries(points, 1, rng))
    np.testing.assert_allclose(
        net.weights(query), exact(points, query).reshape(-1, len(points)), atol=WEIGHT
    )


@pytest.mark.parametrize("name", LAYOUTS)
def test_laplace_weights_are_positive_and_reproduce_the_query(name):
    rng = np.random.default_rng(11)
    net = NaturalNeighborInterpolator(LAYOUTS[name], method="laplace")
    queries = inside_queries(net.points, 200, rng)
    weights = net.weights(queries)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=4e-15)
    size = np.ptp(net.points, axis=0).max()
    np.testing.assert_allclose(weights @ net.points, queries, atol=1e-10 * size)
    assert (net.weights(net.points) == np.eye(len(net.points))).all()


def test_four_sites_have_one_kind_of_weights():
    points = np.array([[0.1, 0, 0], [1, 0.2, 0], [0, 1, 0.3], [0.2, 0.1, 1]])
    shares = np.random.default_rng(0).dirichlet(np.ones(4), 100)
    laplace = NaturalNeighborInterpolator(points, method="laplace")
    # Barycentric coordinates; see test_interpolation.
    np.testing.assert_allclose(laplace.weights(shares @ points), shares, atol=1e-13)


def away_from_hull(points, n, rng):
    return 0.1 * points.mean(axis=0) + 0.9 * inside_queries(points, n, rng)


def rounding(net, values):
    """Of sums of at most 30 products with weights of 1e-12 or, here, 1e-15."""
    reach = np.abs(net.points).max() / np.ptp(net.points, axis=0).max()
    return 1e-13 * np.abs(values).max() * max(1.0, reach)


@pytest.mark.parametrize("jitter", [0, 1e-12, 0.03])
@pytest.mark.parametrize("name", LAYOUTS)
def test_smooth_values_of_linear_functions_are_linear(name, jitter):
    rng = np.random.default_rng(12)
    points = jittered(name, jitter)
    slope = rng.normal(size=(3, 2, 2))
    values = np.tensordot(points, slope, axes=1) + 1
    net = NaturalNeighborInterpolator(points, values, method="sibson_c1")
    assert net.gradients.shape == (len(points), 2, 2, 3)
    # The least squares see the thickness of the set squared over its width: 1e-5 there.
    width = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    thin = 1e-13 * width[0] / width[2] * np.abs(values).max() / width[2]
    np.testing.assert_allclose(
        net.gradients, np.broadcast_to(np.moveaxis(slope, 0, -1), net.gradients.shape),
        atol=10 * thin,
    )  # fmt: skip
    x = away_from_hull(points, 50, rng)
    expected = np.tensordot(x, slope, axes=1) + 1
    np.testing.assert_allclose(net(x), expected, atol=rounding(net, values))


@pytest.mark.parametrize("name", LAYOUTS)
def test_smooth_values_of_spherical_quadratics_are_exact(name):
    rng = np.random.default_rng(13)
    points = LAYOUTS[name]
    slope = rng.normal(size=3)

    def quadratic(x):
        return 2 + x @ slope + 1.5 * (x**2).sum(axis=-1)

    net = NaturalNeighborInterpolator(
        points, quadratic(points), method="sibson_c1", gradients=slope + 3 * points
    )
    x = away_from_hull(points, 50, rng)
    expected = quadratic(x)
    tolerance = rounding(net, quadratic(points))
    np.testing.assert_allclose(net(x), expected, atol=tolerance)
    one = [net(row) for row in x]
    np.testing.assert_allclose(one, expected, atol=tolerance)
    assert np.abs(net(points) - quadratic(points)).max() == 0
    # Not of Sibson's own: those would be off by the spread of the sites squared.
    plain = NaturalNeighborInterpolator(points, quadratic(points))
    assert np.abs(plain(x) - expected).max() > 1e-3


def some_function(seed):
    rng = np.random.default_rng(seed)
    points = np.vstack([rng.random((12, 3)), np.full(3, 0.5)])
    return NaturalNeighborInterpolator(
        points,
        rng.normal(size=13),
        method="sibson_c1",
        gradients=rng.normal(size=(13, 3)),
    )


def slopes(net, x, h):
    steps = h * np.eye(3)
    return np.array([(net(x + step) - net(x - step)) / (2 * h) for step in steps])


@pytest.mark.parametrize("seed", range(3))
def test_smooth_values_have_the_given_gradients_at_sites(seed):
    net = some_function(seed)
    errors = [
        np.abs(slopes(net, net.points[-1], h) - net.gradients[-1]).max()
        for h in (1e-3, 1e-5)
    ]
    # Third terms of the interpolant go with h; a peak at the site would not.
    assert errors[1] < 0.02 * errors[0] < 0.02


def steps_of_slope(net, a, b):
    """Largest step of the slope from a to b, over that of steps four times as long.

    A quarter where the slope is continuous; more where it jumps, up to 1.
    """
    along = np.linspace(0, 1, 2002)[:, None]
    rise = np.gradient(net(a + along * (b - a)), along[:, 0])
    return np.abs(np.diff(rise)).max() / np.abs(np.diff(rise[::4])).max()


@pytest.mark.parametrize("seed", range(3))
def test_only_the_smooth_interpolant_has_no_peaks_at_sites(seed):
    net = some_function(seed)
    site = net.points[-1]
    u = 0.1 * np.random.default_rng(seed).normal(size=3)
    assert steps_of_slope(net, site - u, site + u) < 0.35
    for method in ("sibson", "laplace"):
        other = NaturalNeighborInterpolator(net.points, net.values, method=method)
        assert steps_of_slope(other, site - u, site + u) > 0.5


@pytest.mark.parametrize("method", ["sibson", "laplace", "sibson_c1"])
@pytest.mark.parametrize("seed", range(3))
def test_between_sites_there_are_no_creases(seed, method):
    net = some_function(seed)
    other = NaturalNeighborInterpolator(net.points, net.values, method=method)
    a, b = away_from_hull(net.points, 2, np.random.default_rng(seed))
    assert steps_of_slope(other, a, b) < 0.35


def test_smooth_kernels_equal_the_oracle():
    for seed in range(3):
        net = some_function(seed)
        rng = np.random.default_rng(seed)
        x = np.vstack([inside_queries(net.points, 50, rng), net.points])
        x = np.vstack([x, hull_queries(net, 1e-12, 5, rng), rng.random((20, 3)) * 3])
        x = np.vstack([x, [[np.nan, 0, 0], [np.inf, 1, 1]]])
        for outside in ("nearest", "project", "nan"):
            other = NaturalNeighborInterpolator(
                net.points,
                net.values,
                method="sibson_c1",
                gradients=net.gradients,
                outside=outside,
            )
            expected = oracle_values(other, x)[:, 0]
            # Weights to 1e-14, projections to 1e-15 of a distance of 3, slopes of 30.
            np.testing.assert_allclose(other(x), expected, atol=1e-11)
            one = [other(row) for row in x]
            np.testing.assert_allclose(one, expected, atol=1e-11)


def test_smooth_values_follow_the_scale_of_the_sites():
    net = some_function(0)
    x = away_from_hull(net.points, 20, np.random.default_rng(0))
    for scale in (2.0**-30, 2.0**30):
        moved = NaturalNeighborInterpolator(
            net.points * scale,
            net.values,
            method="sibson_c1",
            gradients=net.gradients / scale,
        )
        np.testing.assert_array_equal(moved(x * scale), net(x))


def test_options_that_do_not_fit_are_refused():
    with pytest.raises(InvalidInput, match="unknown method 'linear'"):
        NaturalNeighborInterpolator(CUBE, method="linear")
    with pytest.raises(InvalidInput, match="'sibson_c1' needs values"):
        NaturalNeighborInterpolator(CUBE, method="sibson_c1")
    with pytest.raises(InvalidInput, match="only for method='sibson_c1'"):
        NaturalNeighborInterpolator(CUBE, CUBE, gradients=np.ones((8, 3, 3)))
    for gradients, says in (
        (np.ones((8, 3)), r"gradients of shape \(8, 2, 3\)"),
        (np.full((8, 2, 3), np.nan), "gradients must be finite"),
    ):
        with pytest.raises(InvalidInput, match=says):
            NaturalNeighborInterpolator(
                CUBE, CUBE[:, :2], method="sibson_c1", gradients=gradients
            )
    net = NaturalNeighborInterpolator(BOX, BOX, method="sibson_c1")
    with pytest.raises(InvalidInput, match="method='sibson' has weights"):
        net.weights([0.2, 0.2, 0.2])
