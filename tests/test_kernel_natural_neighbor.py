"""Compiled queries against the NumPy oracle, and what surrounds them.

Against exact arithmetic they stand in test_interpolation. Kernel and oracle take the
same lengths and angles and add up the same products, in other orders. So they differ by
the rounding of sums: about 50 terms, of a few times the weights, 1.1e-16 each: 1e-14.
(Measured: 2e-15.) The area of a Laplace face is a difference of such sums, divided by a
squared distance, so its weights are held to the 1e-12 of exact arithmetic.
"""

import pickle
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from interpolation_layouts import (
    BOX,
    CUBE,
    JITTERS,
    LAYOUTS,
    hull_queries,
    inside_queries,
    jittered,
    lead_astray,
    make_weights_negative,
)
from natural_neighbor_oracle import weights as oracle_weights

from ikns._kernels.voronoi.diagram import (
    INSIDE_HULL,
    MARK,
    NOT_FINITE,
    OUTSIDE_HULL,
    POWER,
    TETRAHEDRA,
    UNKNOWN,
    UNSURE,
    VOLUME,
    new_work,
)
from ikns._kernels.voronoi.query import natural_weights
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.interpolation.packed import BRUTE_FORCE_LIMIT, morton_order

TOLERANCE = {"sibson": 1e-14, "laplace": 1e-12}
BAD = [[np.nan, 0.5, 0.5], [np.inf, 0, 0], [0.5, -np.inf, np.nan], [1e308, 0, 0]]
CLOUDS = {
    "10 at random": np.random.default_rng(1).random((10, 3)),
    "60 at random": np.random.default_rng(2).random((60, 3)),
    "on a sphere": (lambda x: x / np.linalg.norm(x, axis=1, keepdims=True))(
        np.random.default_rng(3).normal(size=(40, 3))
    ),
}


def one_by_one(net, queries):
    """Weights and what became of each query, as a compiled frame asks for them."""
    numbers, indices = net.packed
    work, weights = new_work(indices), np.empty(len(net.points))
    found, status = [], []
    for x in queries:
        status.append(natural_weights(numbers, indices, x, work, weights))
        found.append(weights.copy())
    return np.array(found), np.array(status)


def all_kinds(net, rng):
    """Queries inside, on and under the hull, at and by sites, and outside."""
    p = net.points
    queries = [inside_queries(p, 40, rng), p, p + 1e-12 * (p.mean(axis=0) - p)]
    queries += [
        hull_queries(net, depth, 6, rng)
        for depth in (0, 1e-14, 1e-12, 1e-11, 1e-10, 1e-8, 1e-5, 1e-3)
    ]
    return np.vstack([*queries, p.mean(axis=0) + 3 * (p - p.mean(axis=0)), BAD])


@pytest.mark.parametrize("method", TOLERANCE)
@pytest.mark.parametrize("jitter", JITTERS)
@pytest.mark.parametrize("name", LAYOUTS)
def test_kernels_equal_the_oracle(name, jitter, method):
    rng = np.random.default_rng(5)
    net = NaturalNeighborInterpolator(jittered(name, jitter), method=method)
    queries = all_kinds(net, rng)
    expected = oracle_weights(net, queries)
    one, status = one_by_one(net, queries)
    np.testing.assert_allclose(one, expected, atol=TOLERANCE[method], rtol=0)
    np.testing.assert_allclose(
        net.weights(queries), expected, atol=TOLERANCE[method], rtol=0
    )
    assert (status != UNSURE).all()
    assert ((status == INSIDE_HULL) == net.inside(queries)).all()
    assert ((status == NOT_FINITE) == np.isnan(expected).any(axis=1)).all()


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("outside", ["nearest", "project", "nan"])
def test_outside_kernels_do_what_the_oracle_does(name, outside):
    rng = np.random.default_rng(6)
    points = CLOUDS[name]
    net = NaturalNeighborInterpolator(points, outside=outside)
    reach = np.repeat([0.8, 3.0, 1e9], 20)[:, None]
    away = points.mean(axis=0) + rng.normal(size=(60, 3)) * reach
    queries = np.vstack([away[~net.inside(away)], BAD])
    expected = oracle_weights(net, queries)
    # A projection is rounded by 1e-16 of the distance, at most by that of 1e9 sizes:
    # 2e-7; weights under the hull change by at most a few per size in these clouds.
    near = np.abs(queries - points.mean(axis=0)).max(axis=1) < 1e3
    for found in (one_by_one(net, queries)[0], net.weights(queries)):
        np.testing.assert_allclose(found[near], expected[near], atol=1e-11)
        np.testing.assert_allclose(found, expected, atol=1e-5)
    status = one_by_one(net, queries)[1]
    assert set(status) <= {OUTSIDE_HULL, NOT_FINITE}


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(4, 30),
    steps=st.sampled_from([1, 2, 3, 1000]),
    jitter=st.sampled_from([0, 1e-16, 1e-12, 1e-8, 1e-3]),
    queries=st.lists(
        st.tuples(*[st.floats(width=64) | st.sampled_from([0, 0.5, 1 / 3, 1])] * 3),
        min_size=1,
        max_size=12,
    ),
    method=st.sampled_from(["sibson", "laplace"]),
    outside=st.sampled_from(["nearest", "nan"]),
)
@settings(max_examples=100, deadline=None)
def test_any_query_of_any_lattice_points_is_answered_alike(
    seed, n, steps, jitter, queries, method, outside
):
    rng = np.random.default_rng(seed)
    points = np.unique(rng.integers(steps + 1, size=(n, 3)) / steps, axis=0)
    points = points + jitter * rng.normal(size=points.shape)
    try:
        net = NaturalNeighborInterpolator(points, method=method, outside=outside)
    except NotEnoughData:
        return
    queries = np.array([*queries, *points[:2], points[:4].mean(axis=0)])
    expected = oracle_weights(net, queries)
    one, _ = one_by_one(net, queries)
    np.testing.assert_allclose(one, expected, atol=TOLERANCE[method])
    np.testing.assert_allclose(net.weights(queries), expected, atol=TOLERANCE[method])


@pytest.mark.parametrize("name", CLOUDS)
def test_scratch_memory_is_left_as_it_was_found(name):
    rng = np.random.default_rng(7)
    net = NaturalNeighborInterpolator(CLOUDS[name])
    numbers, indices = net.packed
    work, weights = new_work(indices), np.empty(len(net.points))
    before = numbers.copy().view(np.int64)
    for x in all_kinds(net, rng):
        natural_weights(numbers, indices, x, work, weights)
    for block, size in ((VOLUME, len(net.points)), (MARK, len(net.points))):
        assert not work[indices[block] : indices[block] + size].any()
    if indices[TETRAHEDRA] > BRUTE_FORCE_LIMIT:
        assert (work[indices[POWER] :][: indices[TETRAHEDRA] + 1] == UNKNOWN).all()
    # Nor is the diagram touched when other memory is brought along.
    assert (numbers.view(np.int64) == before).all()


def test_earlier_queries_do_not_change_later_ones():
    rng = np.random.default_rng(8)
    for points in CLOUDS.values():
        net = NaturalNeighborInterpolator(points, points)
        queries = all_kinds(net, rng)
        fresh = np.array([NaturalNeighborInterpolator(points).weights(queries[5])])
        net(queries)
        np.testing.assert_array_equal(net.weights(queries[5]), fresh[0])


@pytest.mark.parametrize("method", ["sibson", "laplace", "sibson_c1"])
def test_a_walk_that_fails_gives_nan_and_leaves_other_queries_alone(method):
    points = CLOUDS["60 at random"]
    net, whole = (
        NaturalNeighborInterpolator(points, points, method=method) for _ in range(2)
    )
    lead_astray(net)
    queries = inside_queries(points, 200, np.random.default_rng(9))
    _, status = one_by_one(net, queries)
    lost = status == UNSURE
    # Those whose sphere the walk starts in need none.
    assert 0 < lost.sum() < len(queries)
    one = np.array([net(x) for x in queries])
    assert np.isnan(one[lost]).all()
    np.testing.assert_array_equal(one[~lost], [whole(x) for x in queries[~lost]])
    # Of many queries each starts where the one before was.
    asked = [net] if method == "sibson_c1" else [net, net.weights]
    for ask in asked:
        many = ask(queries)
        lost = np.isnan(many).any(axis=1)
        assert 0 < lost.sum() < len(queries)
        assert np.isnan(many[lost]).all()
    many = net(queries)
    kept = ~np.isnan(many).any(axis=1)
    np.testing.assert_allclose(many[kept], whole(queries[kept]), atol=1e-12)
    assert (net.inside(queries) == whole.inside(queries)).all()


def test_a_negative_weight_gives_nan():
    net = NaturalNeighborInterpolator(BOX, BOX)
    assert net.packed[1][TETRAHEDRA] <= BRUTE_FORCE_LIMIT  # so many are a batch
    make_weights_negative(net)
    queries = inside_queries(BOX, 20, np.random.default_rng(9))
    assert (one_by_one(net, queries)[1] == UNSURE).all()
    assert np.isnan(net.weights(queries)).all()
    assert np.isnan(net(queries)).all()
    assert np.isnan(net(queries[0])).all()


def test_sites_found_by_walking_have_all_the_weight():
    points = CLOUDS["60 at random"]
    net = NaturalNeighborInterpolator(points)
    assert net.packed[1][TETRAHEDRA] > BRUTE_FORCE_LIMIT
    assert (net.weights(points) == np.eye(len(points))).all()
    assert (one_by_one(net, points)[0] == np.eye(len(points))).all()


@pytest.mark.parametrize("name", CLOUDS)
def test_threads_do_not_meet(name):
    points = CLOUDS[name]
    rng = np.random.default_rng(10)
    net = NaturalNeighborInterpolator(points, points)
    queries = [inside_queries(points, 400, rng) for _ in range(4)]
    # Linear values come back: a torn answer would be off by the size of the set.
    wrong = []

    def ask(x):
        for _ in range(5):
            found = [net(x), np.array([net(row) for row in x])]
            wrong.append(max(np.abs(f - x).max() for f in found))

    threads = [threading.Thread(target=ask, args=(x,)) for x in queries]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(wrong) == 20
    assert max(wrong) < 1e-12


def test_an_interpolator_survives_pickling():
    net = NaturalNeighborInterpolator(BOX, BOX**2, outside="project")
    again = pickle.loads(pickle.dumps(net))
    x = np.random.default_rng(11).random((50, 3)) * 0.6
    assert (again(x) == net(x)).all()
    assert (again(x[0]) == net(x[0])).all()


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3)])
def test_answers_are_the_same_however_a_query_is_written(shape):
    values = np.random.default_rng(12).random((8, *shape))
    net = NaturalNeighborInterpolator(CUBE, values)
    x = np.array([0.25, 0.5, 0.125])
    frozen = x.copy()
    frozen.flags.writeable = False
    forms = [x, frozen, x.tolist(), tuple(x), x.astype(np.float32)]
    forms += [np.repeat(x, 2)[::2], x.astype(">f8"), x.astype(object)]
    first = net(x)
    assert first.shape == shape
    for form in forms:
        np.testing.assert_array_equal(net(form), first)
        np.testing.assert_array_equal(net.weights(form), net.weights(x))
    assert (net([0, 0, 1]) == net(np.array([0, 0, 1]))).all()
    np.testing.assert_array_equal(net([0, 0, 1]), net(np.array([0.0, 0, 1])))


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
@pytest.mark.parametrize("many", [(), (1,), (3, 5)])
def test_answers_are_written_where_asked(shape, many):
    rng = np.random.default_rng(13)
    net = NaturalNeighborInterpolator(CUBE, rng.random((8, *shape)))
    x = rng.random((*many, 3))
    out, weights = np.empty((*many, *shape)), np.empty((*many, 8))
    assert net(x, out=out) is out
    assert net.weights(x, out=weights) is weights
    np.testing.assert_array_equal(out, net(x))
    np.testing.assert_array_equal(weights, net.weights(x))


@pytest.mark.parametrize(
    "out",
    [
        np.empty(5),
        np.empty(4, dtype=np.float32),
        np.empty(8)[::2],
        [0.0] * 4,
        np.frombuffer(bytes(32)),
    ],
)
def test_nothing_is_written_to_arrays_that_do_not_fit(out):
    net = NaturalNeighborInterpolator(CUBE, np.ones((8, 4)))
    with pytest.raises(InvalidInput, match=r"float64 array of shape \(4,\)"):
        net(np.full(3, 0.5), out=out)


@pytest.mark.parametrize("x", [np.ones(2), np.ones(4), 0.5, np.ones((5, 2)), [1, 2]])
def test_queries_that_are_not_in_space_are_refused(x):
    net = NaturalNeighborInterpolator(CUBE, np.ones((8, 4)))
    for ask in (net, net.weights, net.inside):
        with pytest.raises(InvalidInput, match=r"queries of shape \(\.\.\., 3\)"):
            ask(x)


def test_close_places_follow_each_other_in_morton_order():
    rng = np.random.default_rng(14)
    x = rng.random((2000, 3))
    x[:4] = BAD
    order = morton_order(x, np.zeros(3), np.ones(3))
    assert sorted(order) == list(range(2000))
    path = x[order][np.isfinite(x[order]).all(axis=1)].clip(0, 1)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    # Strangers in a cube are 0.66 apart in the mean; of 2000 the nearest is at 0.04.
    assert steps.mean() < 0.2
