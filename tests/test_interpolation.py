"""Natural-neighbor weights against exact arithmetic, and the laws they must obey.

Tolerance of the weights, unless a test says otherwise: products that cancel to below
1e-3 of their terms are formed again with twice the digits, so every length and angle is
known to about 4 * 1.1e-16 / 1e-3 = 4e-13 and a weight, a ratio of sums of their
products with at most as much cancellation again, to 1e-12. (Measured: 5e-15.)
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interpolation_layouts import (
    BOX,
    CUBE,
    JITTERS,
    LAYOUTS,
    built,
    deep,
    hull_queries,
    inside_queries,
    jittered,
    turned,
)
from voronoi_oracle import sibson_weights

from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.interpolation import NaturalNeighborInterpolator

WEIGHT = 1e-12


def exact(points, queries):
    return np.array([[float(w) for w in sibson_weights(points, q)] for q in queries])


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_weights_are_the_exact_shares_of_the_voronoi_cell(name, jitter):
    rng = np.random.default_rng(7)
    net = built(name, jitter)
    queries = [inside_queries(net.points, 2, rng)]
    queries += [hull_queries(net, depth, 1, rng) for depth in (1e-3, 1e-5, 1e-8, 1e-10)]
    queries = deep(net, np.vstack(queries))
    np.testing.assert_allclose(
        net.weights(queries), exact(net.points, queries), atol=WEIGHT, rtol=0
    )


@pytest.mark.parametrize("jitter", [0, 1e-12])
def test_weights_are_exact_on_a_grid_of_125(jitter):
    rng = np.random.default_rng(3)
    grid = np.array(list(np.ndindex(5, 5, 5))) / 4.0
    net = NaturalNeighborInterpolator(grid + jitter * rng.normal(size=grid.shape))
    queries = np.vstack([rng.random((2, 3)), hull_queries(net, 1e-4, 1, rng)])
    np.testing.assert_allclose(
        net.weights(queries), exact(net.points, queries), atol=WEIGHT, rtol=0
    )


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(4, 12),
    steps=st.sampled_from([1, 2, 4, 1000]),
    jitter=st.sampled_from([0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-4]),
    turn=st.booleans(),
    depth=st.sampled_from([None, 1e-2, 1e-5, 1e-8, 1e-10]),
)
@settings(max_examples=150, deadline=None)
def test_any_lattice_points_get_exact_weights(seed, n, steps, jitter, turn, depth):
    """Few steps make layouts full of common planes, lines and spheres."""
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(steps + 1, size=(n, 3)) / steps, axis=0)
    points = turned(points, seed) if turn else points
    points = points + jitter * rng.normal(size=points.shape)
    try:
        net = NaturalNeighborInterpolator(points)
    except NotEnoughData:
        return
    if depth is None:
        query = inside_queries(points, 1, rng)
    else:
        query = hull_queries(net, depth, 1, rng)
    query = deep(net, query)
    np.testing.assert_allclose(
        net.weights(query), exact(points, query).reshape(-1, len(points)), atol=WEIGHT
    )


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_weights_are_positive_sum_to_one_and_reproduce_the_query(name, jitter):
    rng = np.random.default_rng(11)
    net = built(name, jitter)
    queries = [inside_queries(net.points, 150, rng)]
    queries += [hull_queries(net, depth, 20, rng) for depth in (0, 1e-14, 1e-7, 1e-2)]
    queries += [net.points[0] + 1e-9 * (net.points[1:] - net.points[0])]
    queries = np.vstack(queries)
    queries = queries[net.inside(queries)]
    weights = net.weights(queries)
    assert weights.min() >= 0
    # N terms of at most 1, each rounded to half a unit: 27 * 1.1e-16.
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=4e-15)
    size = np.ptp(net.points, axis=0).max()
    np.testing.assert_allclose(weights @ net.points, queries, atol=1e-10 * size)


def test_four_sites_give_barycentric_coordinates():
    points = np.array([[0.1, 0, 0], [1, 0.2, 0], [0, 1, 0.3], [0.2, 0.1, 1]])
    shares = np.random.default_rng(0).dirichlet(np.ones(4), 100)
    # Four weights that sum to 1 and reproduce the query are these; the queries are
    # rounded by 1e-16, and the matrix of the points has a condition of about 3.
    weights = NaturalNeighborInterpolator(points).weights(shares @ points)
    np.testing.assert_allclose(weights, shares, atol=1e-14)


@pytest.mark.parametrize("jitter", [0, 1e-15, 1e-12])
def test_on_the_axis_of_a_cube_weights_follow_from_symmetry(jitter):
    x = np.linspace(0.01, 0.99, 50)
    net = NaturalNeighborInterpolator(jittered("cube", jitter))
    weights = net.weights(np.column_stack([x, np.full((50, 2), 0.5)]))
    expected = np.where(net.points[:, 0] > 0.5, x[:, None], 1 - x[:, None]) / 4
    # Far from the hull weights follow the sites smoothly: off by a few jitters.
    np.testing.assert_allclose(weights, expected, atol=WEIGHT + 20 * jitter)


def test_in_the_middle_of_the_box_the_faces_weigh_as_symmetry_says():
    center = [0.25, 0.2, 0.15]
    weights = NaturalNeighborInterpolator(BOX).weights(center)
    np.testing.assert_allclose(weights[:8], weights[0], atol=WEIGHT)
    np.testing.assert_allclose(weights[8], weights[9], atol=WEIGHT)
    np.testing.assert_allclose(weights, exact(BOX, [center])[0], atol=WEIGHT)


@pytest.mark.parametrize("name", ["box", "random"])
def test_weights_agree_with_counting_random_points(name):
    rng = np.random.default_rng(3)
    points = LAYOUTS[name]
    query = points.mean(axis=0) + [0.03, -0.02, 0.01]
    spread = 3 * np.ptp(points, axis=0)
    places = query + (rng.random((200_000, 3)) - 0.5) * spread
    distance = np.linalg.norm(places[:, None] - points, axis=2)
    taken = np.linalg.norm(places - query, axis=1) < distance.min(axis=1)
    assert np.abs((places[taken] - query) / spread).max() < 0.49  # the cell fits
    counts = np.bincount(distance[taken].argmin(axis=1), minlength=len(points))
    weights = NaturalNeighborInterpolator(points).weights(query)
    sigma = np.sqrt(weights * (1 - weights) / taken.sum())  # binomial
    assert (np.abs(counts / taken.sum() - weights) <= 5 * sigma + 1e-12).all()


@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_a_site_has_all_the_weight_at_itself(name, jitter):
    net = built(name, jitter)
    assert (net.weights(net.points) == np.eye(len(net.points))).all()
    # Close by, linear precision with its nearest neighbor s away takes h / s from it;
    # other neighbors as much again. Sites are at least 1e-6 apart.
    toward = net.points.mean(axis=0) - net.points
    near = net.weights(net.points + 1e-12 * toward)
    assert np.diag(near).min() > 1 - 1e-5


@pytest.mark.parametrize("jitter", [0, 1e-12, 1e-3])
@pytest.mark.parametrize("name", ["box", "grid 3 turned", "random"])
def test_weights_are_continuous_inside(name, jitter):
    rng = np.random.default_rng(2)
    net = built(name, jitter)
    a, b = inside_queries(net.points, 20, rng), inside_queries(net.points, 20, rng)
    along = np.linspace(0.01, 0.99, 100)[:, None, None]
    h = 1e-7
    step = net.weights(a + (along + h) * (b - a)) - net.weights(a + along * (b - a))
    # The steepest slope seen is 30 per length; a jump would be of order 0.1.
    assert np.abs(step).max() < 300 * h


@pytest.mark.parametrize("name", LAYOUTS)
def test_weights_follow_the_sites(name):
    rng = np.random.default_rng(4)
    points = LAYOUTS[name]
    queries = inside_queries(points, 50, rng)
    queries = 0.9 * queries + 0.1 * points.mean(axis=0)
    weights = NaturalNeighborInterpolator(points).weights(queries)
    order = rng.permutation(len(points))
    permuted = NaturalNeighborInterpolator(points[order]).weights(queries)
    np.testing.assert_allclose(permuted, weights[:, order], atol=WEIGHT)
    doubled = NaturalNeighborInterpolator(points * 2.0**-70).weights(queries * 2.0**-70)
    assert (doubled == weights).all()
    # Moving rounds sites by 1e-16 of their distance to the origin; a tenth of the way
    # inside, weights answer by that over the sites' thickness, times 10.
    extent = np.ptp(np.vstack([points, queries]), axis=0)
    rounding = 1e-15 * (np.abs(points).max() + 1) / extent.min()
    moved = NaturalNeighborInterpolator(turned(points * 3.7) + 0.3)
    np.testing.assert_allclose(
        moved.weights(turned(queries * 3.7) + 0.3),
        weights,
        atol=WEIGHT + 100 * rounding,
    )


@pytest.mark.parametrize(
    ("name", "jitter"), [("box", 0), ("box turned", 0), ("box", 1e-3), ("box", 0.03)]
)
def test_projected_values_are_continuous_at_the_hull_and_nearest_ones_jump(
    name, jitter
):
    rng = np.random.default_rng(6)
    project, nearest = built(name, jitter, "project"), built(name, jitter)
    on = hull_queries(project, 0.0, 400, rng)
    outward = on - project.points.mean(axis=0)
    inner, outer = on - 1e-9 * outward, on + 1e-9 * outward
    step = project.weights(outer) - project.weights(inner)
    # A jitter j leaves tetrahedra about as flat as j under the hull, where weights
    # change over a depth of about j: by 2e-9 / j, a few times. On the turned box j is
    # rounding, 1e-16, but the least depth that is looked at is 2e-12: 5e-5.
    assert np.abs(step).max() < 1e-4
    jump = np.abs(nearest.weights(outer) - nearest.weights(inner)).sum(axis=1) / 2
    assert 0.3 < jump.mean() < 0.7
    assert (nearest.weights(outer).max(axis=1) == 1).all()


def test_outside_is_what_was_asked_for():
    x = [[0.2, 0.1, -3.0], [0.5, 0.5, 0.5], [1e300, 2.0, 1e300], [0.25, 0.5, 9.0]]
    height = 2 * CUBE[:, 2] + CUBE[:, 0]
    values = {
        outside: NaturalNeighborInterpolator(CUBE, height, outside=outside)(x)
        for outside in ("nearest", "project", "nan")
    }
    np.testing.assert_allclose(values["nearest"], [0, 1.5, 3, 2], atol=WEIGHT)
    np.testing.assert_allclose(values["project"], [0.2, 1.5, 3, 2.25], atol=1e-8)
    assert np.isnan(values["nan"]).tolist() == [True, False, True, True]


@pytest.mark.parametrize("outside", ["nearest", "project", "nan"])
def test_a_query_that_is_not_finite_gives_nan(outside):
    net = NaturalNeighborInterpolator(CUBE, CUBE, outside=outside)
    bad = [[np.nan, 0.5, 0.5], [np.inf, 0.5, 0.5], [0.5, -np.inf, np.nan]]
    assert np.isnan(net.weights(bad)).all()
    assert np.isnan(net(bad)).all()
    assert not net.inside(bad).any()
    assert np.isfinite(net.weights([*bad, [0.5, 0.5, 0.5]])[-1]).all()


def test_leading_shapes_of_queries_and_trailing_shapes_of_values_are_kept():
    values = np.arange(8 * 2 * 5.0).reshape(8, 2, 5)
    net = NaturalNeighborInterpolator(CUBE, values)
    x = np.random.default_rng(0).random((3, 4, 3))
    assert net.weights(x).shape == (3, 4, 8)
    assert net(x).shape == (3, 4, 2, 5)
    assert net.inside(x).shape == (3, 4)
    assert net.inside(x).all()
    assert net.weights(x[0, 0]).shape == (8,)
    assert net(x[0, 0]).shape == (2, 5)
    assert net.weights(np.empty((0, 3))).shape == (0, 8)
    np.testing.assert_allclose(net(x)[1, 2], net(x[1, 2]), atol=WEIGHT * values.max())


@pytest.mark.parametrize(
    ("points", "error", "says"),
    [
        (CUBE[:3], NotEnoughData, "at least 4 points, found 3"),
        (np.empty((0, 3)), NotEnoughData, "at least 4 points, found 0"),
        (CUBE[:, :2], InvalidInput, r"\(8, 2\)"),
        (CUBE[[0, 1, 2, 3]], NotEnoughData, "4 points .* one plane"),
        (turned(BOX * [1, 1, 0] + [0, 0, 1e-3])[:4], NotEnoughData, "plane|apart"),
        (np.outer(np.arange(5), [1.0, 2, 3]), NotEnoughData, "one line"),
        (np.ones((6, 3)), NotEnoughData, "points 0 and 1 are 0 m apart"),
        (np.vstack([CUBE, CUBE[3] + 1e-12]), NotEnoughData, "points 3 and 8"),
        (np.vstack([CUBE, [np.nan, 0, 0]]), InvalidInput, "finite.* at 8"),
        (np.vstack([CUBE, [0, -np.inf, 0]]), InvalidInput, "finite.* at 8"),
    ],
)
def test_points_that_span_no_volume_are_refused(points, error, says):
    with pytest.raises(error, match=says):
        NaturalNeighborInterpolator(points)


def test_values_and_options_that_do_not_fit_are_refused():
    with pytest.raises(InvalidInput, match="8 points, found values of shape \\(7,\\)"):
        NaturalNeighborInterpolator(CUBE, np.ones(7))
    with pytest.raises(InvalidInput, match="values must be finite"):
        NaturalNeighborInterpolator(CUBE, np.full(8, np.nan))
    with pytest.raises(InvalidInput, match="unknown outside 'zero'"):
        NaturalNeighborInterpolator(CUBE, np.ones(8), outside="zero")
    with pytest.raises(InvalidInput, match="given no values"):
        NaturalNeighborInterpolator(CUBE)([0.5, 0.5, 0.5])
    with pytest.raises(InvalidInput, match=r"shape \(\.\.\., 3\), found \(4, 2\)"):
        NaturalNeighborInterpolator(CUBE).weights(np.ones((4, 2)))


def test_its_arrays_cannot_be_changed_from_outside():
    points = CUBE.copy()
    net = NaturalNeighborInterpolator(points, points)
    points[0] = 7
    assert (net.points == CUBE).all()
    for array in (net.points, net.values, net.edges, net.simplices, net.hull_facets):
        assert not array.flags.writeable


@pytest.mark.parametrize("x", [np.full(3, 0.3), [0.3, 0.3, 0.3], [[0.3, 0.3, 0.3]]])
def test_one_value_comes_in_the_shape_of_the_query(x):
    cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    height = NaturalNeighborInterpolator(cube, cube[:, 2])
    assert height(x).shape == np.shape(x)[:-1]
    # Linear values come back but for the rounding of eight products.
    np.testing.assert_allclose(height(x), np.asarray(x)[..., 2], atol=1e-15)
