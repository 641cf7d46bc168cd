"""Integers in rows of digits, and the predicates on them, against fractions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from interpolation_layouts import LAYOUTS, turned
from predicate_oracle import (
    above_sphere,
    between,
    cross,
    determinant,
    dot,
    exactly,
    sign,
    volume,
)

from ikns._kernels.voronoi import exact
from ikns._kernels.voronoi.predicates import in_sphere, orientation


@st.composite
def near_degenerate(draw):
    """Five sites full of common planes and spheres, hit or missed by up to 1e-30."""
    steps = draw(st.sampled_from([1, 2, 3, 20]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = rng.integers(steps + 1, size=(5, 3)) / steps
    if draw(st.booleans()):
        points = turned(points, draw(st.integers(0, 9)))
    points = points * draw(st.sampled_from([1.0, 1e-8])) + draw(
        st.sampled_from([0.0, 0.1, 60.0])
    )
    jitter = draw(st.sampled_from([0, 1e-30, 1e-17, 1e-16, 1e-13, 1e-9]))
    return points + jitter * rng.normal(size=points.shape)


def row_value(R, row, degree, step, n):
    digits = (int(R[row, i]) << (30 * i) for i in range(degree * n))
    return sum(digits) * Fraction(step) ** degree


def hold_rows(points, digits=(2, 4)):
    """Check every row of the scratch array that means something."""
    sites, true = exact.on_lattice(points), exactly(points)
    assert [[Fraction(v) for v in x] for x in sites.x] == true
    R = np.full(exact.SCRATCH, 7)  # what was there before does not matter
    step, n = exact.determinants(sites, R, 0, 1, 2, 3, 4, exact.TO_SPHERE)
    assert n in digits
    u, v, w, t = (between(true[0], true[k]) for k in range(1, 5))
    products = [cross(v, w), cross(w, u), cross(u, v)]
    volume = determinant([u, v, w])
    center = [
        sum(dot(e, e) * p[k] for e, p in zip((u, v, w), products, strict=True))
        for k in range(3)
    ]
    expected = {
        (exact.VW, 2): products[0],
        (exact.DETERMINANT, 3): [volume],
        (exact.CENTER, 4): center,
        (exact.POWER, 5): [dot(t, t) * volume - dot(t, center)],
    }
    for (row, degree), values in expected.items():
        for k, value in enumerate(values):
            assert row_value(R, row + k, degree, step, n) == value
            assert exact.sign_of(R, row + k, n) == sign(value)
            high, rest = value_of(sites, row + k)
            # Five digits of 30 bits, the highest at least 1, hold 2**-120 of the value;
            # two floats hold 2**-106 of it, added up in five steps.
            error = abs(Fraction(high) + Fraction(rest) - value)
            assert error <= abs(value) / 2**100
            assert abs(rest) <= abs(high) * 2**-53
    return R


def value_of(sites, row):
    value, rest = np.empty((2, 1, 1))
    exact.values(sites, np.arange(5)[None], exact.TO_SPHERE, row, value, rest)
    return float(value[0, 0]), float(rest[0, 0])


@given(near_degenerate())
@settings(max_examples=100, deadline=None)
def test_every_row_is_the_determinant_it_stands_for(points):
    hold_rows(points)


@given(st.integers(0, 2**32 - 1), st.sampled_from([2.0**-30, 1.0, 2.0**9]))
@settings(max_examples=30, deadline=None)
def test_two_digits_are_as_good_as_four(seed, size):
    rng = np.random.default_rng(seed)
    points = size * rng.integers(-(2**30), 2**30, size=(5, 3)) / 2.0**30
    hold_rows(points, digits=[2])
    points[rng.integers(5), rng.integers(3)] = 3 * 2.0**-100
    hold_rows(points, digits=[4])


def test_the_first_stages_do_not_need_the_last_ones():
    points = LAYOUTS["random"]
    sites = exact.on_lattice(points)
    whole = hold_rows(points[:5])
    R = np.full(exact.SCRATCH, 7)
    _, n = exact.determinants(sites, R, 0, 1, 2, 3, 4, exact.NORMAL)
    assert (R[exact.VW : exact.VW + 3] == whole[exact.VW : exact.VW + 3])[
        :, : 2 * n
    ].all()
    assert (R[exact.DETERMINANT] == 7).all()


@given(near_degenerate())
@settings(max_examples=200, deadline=None)
def test_predicates_are_right_however_close_the_call(points):
    sites, true = exact.on_lattice(points), exactly(points)
    assume(len({tuple(x) for x in sites.x}) == 5)
    R = np.empty(exact.SCRATCH, dtype=np.int64)
    for order in ((0, 1, 2, 3, 4), (4, 2, 0, 1, 3), (3, 4, 1, 2, 0)):
        a, b, c, d, e = order
        side = sign(volume(true, a, b, c, d))
        assert orientation(sites, R, a, b, c, d) == side
        assert orientation(sites, R, b, a, c, d) == -side
        if side < 0:
            a, b = b, a
        if side:
            above = above_sphere(true, a, b, c, d, e)
            assert in_sphere(sites, R, a, b, c, d, e) == (above < 0)


@pytest.mark.parametrize("name", LAYOUTS)
def test_predicates_are_right_on_the_layouts(name):
    points = LAYOUTS[name]
    sites, true = exact.on_lattice(points), exactly(points)
    R = np.empty(exact.SCRATCH, dtype=np.int64)
    rng = np.random.default_rng(0)
    for _ in range(60):
        a, b, c, d, e = map(int, rng.permutation(len(points))[:5])
        side = sign(volume(true, a, b, c, d))
        assert orientation(sites, R, a, b, c, d) == side
        if side:
            a, b = (a, b) if side > 0 else (b, a)
            above = above_sphere(true, a, b, c, d, e)
            assert in_sphere(sites, R, a, b, c, d, e) == (above < 0)


def test_on_a_sphere_the_first_lift_that_counts_decides():
    sites = exact.on_lattice(LAYOUTS["cube"])
    R = np.empty(exact.SCRATCH, dtype=np.int64)

    def inside(simplex, others):
        assert orientation(sites, R, *simplex) == 1
        return [in_sphere(sites, R, *simplex, e) for e in others]

    # 3 = 1 + 2 - 0: over 0, 4, 2, 1 it stands by l_3 + l_0 - l_1 - l_2, l_0 first; so
    # do 5 and 6; and 7 by l_7 + 2 l_0 - l_4 - l_2 - l_1.
    assert inside((0, 4, 2, 1), (3, 5, 6, 7)) == [False] * 4
    # 2 * 0 = 1 + 2 + 4 - 7: l_0 comes first. For 3, 5 and 6, l_1 does:
    # 2 * 3 = 1 + 2 - 4 + 7, 2 * 5 = 1 - 2 + 4 + 7, 2 * 6 = -1 + 2 + 4 + 7.
    assert inside((1, 4, 2, 7), (0, 3, 5, 6)) == [False, True, True, False]


def test_coordinates_are_multiples_of_the_grain():
    rng = np.random.default_rng(0)
    points = np.vstack([rng.normal(size=(50, 3)), LAYOUTS["grid 3"], np.zeros((1, 3))])
    sites = exact.on_lattice(points)
    assert (sites.x == np.trunc(points * 2.0**100) / 2.0**100).all()
    assert (np.log2(sites.grain) % 1 == 0).all()
    assert (sites.x % sites.grain[:, None] == 0).all()
    odd = (sites.x / sites.grain[:, None]) % 2 == 1
    assert odd.any(axis=1)[:50].all()  # no coarser grain would do
