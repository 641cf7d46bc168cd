"""Laws of the learned map: planted directions, signs, ranges and the control signal."""

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import ortho_group
from sklearn.base import clone
from voronoi_oracle import laplace_weights, sibson_weights

from ikns.nullspace.map import NullSpaceMap

CORNERS = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
LAYOUT = np.vstack([CORNERS, [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
# A box in front of the chest, not quite parallel to the thorax axes.
TILT = Rotation.from_euler("YXZ", [0.5, 0.1, -0.15]).as_matrix()
PLACES = LAYOUT * [0.12, 0.2, 0.15] @ TILT + [0.3, -0.1, 0.15]
N = 7
seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=12, deadline=None)  # each fit searches a box, 0.1 s


def truth(d=1, *, seed=0):
    """Planted directions (10, d, 7) that turn smoothly over the workspace.

    Signs of neighbors are only defined where their directions are well within a right
    angle. No two places are more than 1.26 units apart, so here the directions of any
    two differ by at most 0.88 rad (cosine 0.64; the map warns below 0.5).
    """
    rng = np.random.default_rng(seed)
    frame = ortho_group.rvs(N, random_state=rng)
    unit = (PLACES - PLACES.mean(axis=0)) / np.ptp(PLACES, axis=0).max()
    axis = rng.normal(size=3)
    angle = 0.7 * unit @ (axis / np.linalg.norm(axis))
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * frame[k] + s * frame[k + d] for k in range(d)], axis=1)


def record(rng, directions, *, n=80, hand=0.004, noise=0.01, spread=(0.6, 0.4)):
    """Still samples: x, q, v and the planted point of each."""
    P, d, _ = directions.shape
    which = np.repeat(np.arange(P), n)
    drive = rng.uniform(-1, 1, (P * n, d)) * spread[:d]
    rate = rng.normal(size=(P * n, d)) * spread[:d]
    posture = rng.normal(scale=0.5, size=(P, N))
    planted = directions[which]
    q = posture[which] + np.einsum("td,tdn->tn", drive, planted)
    v = np.einsum("td,tdn->tn", rate, planted)
    x = PLACES[which] + rng.normal(scale=hand, size=(P * n, 3))
    return (
        x,
        q + noise * rng.normal(size=q.shape),
        v + noise * rng.normal(size=q.shape),
        which,
    )


def match(learned):
    """Index of the learned point at each planted place."""
    gap = np.linalg.norm(PLACES[:, None] - learned.centers_, axis=2)
    assert gap.min(axis=1).max() < 0.005
    return gap.argmin(axis=1)


@pytest.fixture(scope="module")
def planted():
    x, q, v, which = record(np.random.default_rng(1), truth())
    return x, q, v, which, NullSpaceMap().fit(x, q)


@pytest.mark.parametrize("domain", ["position", "velocity"])
def test_planted_directions_are_found(planted, domain):
    x, q, v, _, _ = planted
    learned = NullSpaceMap(domain=domain).fit(x, q, velocity=v)
    cosines = np.einsum(
        "pn,pn->p", learned.directions_[match(learned), 0], truth()[:, 0]
    )
    # Angle of a leading component: noise / signal / sqrt(N) in each of 6 directions:
    # 0.01 / 0.35 (deviation of the drive) / sqrt(80) * sqrt(6) = 0.0078 rad expected.
    assert np.arccos(np.abs(cosines)).max() < 4 * 0.0078
    assert len(set(np.sign(cosines))) == 1
    assert (learned.n_components_ == 1).all()


def test_two_planted_degrees_of_freedom_span_the_planted_planes():
    x, q, _, _ = record(np.random.default_rng(2), truth(2))
    learned = NullSpaceMap(n_dof=2).fit(x, q)
    found = learned.directions_[match(learned)]
    assert np.abs(found @ np.swapaxes(found, 1, 2) - np.eye(2)).max() < 1e-13
    # The weaker one has deviation 0.23, so 1.5 times the error of a single direction.
    missed = truth(2) - truth(2) @ np.swapaxes(found, 1, 2) @ found
    assert np.linalg.norm(missed, axis=2).max() < 6 * 0.0078
    # Neighbors agree row by row, though each cluster's components came in any turn.
    assert np.einsum("idn,jdn->ijd", found, found).min() > 0
    assert learned.control_signal(q[:5], x[:5]).shape == (5, 2)
    assert learned.control_signal(q[0], x[0]).shape == (2,)


@given(seeds)
@few
def test_signs_agree_whatever_signs_and_order_joints_and_samples_have(seed):
    rng = np.random.default_rng(seed)
    x, q, _, _ = record(rng, truth(seed=seed % 100), n=30)
    reference = truth(seed=seed % 100).mean(axis=0)
    learned = NullSpaceMap(reference=reference).fit(x, q)
    assert (learned.directions_[match(learned), 0] @ reference[0] > 0).all()
    sign, joints = rng.choice([-1.0, 1.0], N), rng.permutation(N)
    samples = rng.permutation(len(x))
    other = NullSpaceMap(reference=(reference * sign)[:, joints]).fit(
        x[samples], (q * sign)[samples][:, joints]
    )
    # The same sums in another order: rounding of 300 samples.
    z = learned.directions_[match(learned)]
    assert np.allclose(
        other.directions_[match(other)], (z * sign)[..., joints], rtol=0, atol=1e-9
    )
    c = learned.control_signal(q, x)
    assert np.allclose(
        other.control_signal((q * sign)[:, joints], x), c, rtol=0, atol=1e-9
    )


@given(seeds)
@few
def test_control_signal_ignores_where_the_frame_and_the_joint_zeros_are(seed):
    rng = np.random.default_rng(seed)
    x, q, _, _ = record(rng, truth(), n=30)
    shift, zero = rng.normal(size=3), rng.normal(size=N)
    # The face centers of the start are those up and down, so the turn is about Y.
    turn = Rotation.from_rotvec([0, rng.uniform(-3, 3), 0]).as_matrix()
    learned, moved = (
        NullSpaceMap().fit(x, q),
        NullSpaceMap().fit(x @ turn + shift, q + zero),
    )
    where = rng.uniform(PLACES.min(axis=0), PLACES.max(axis=0), (50, 3))
    posture = rng.normal(size=(50, N))
    # Rounding, times the slope of the weights close to the hull.
    assert np.allclose(
        moved.control_signal(posture + zero, where @ turn + shift),
        learned.control_signal(posture, where),
        rtol=0,
        atol=1e-7,
    )


def test_reversing_the_reference_turns_the_signal_over(planted):
    x, q, _, _, learned = planted
    reference = learned.directions_[0, 0]
    up = NullSpaceMap(reference=reference).fit(x, q)
    down = NullSpaceMap(reference=-reference).fit(x, q)
    assert np.array_equal(up.directions_, -down.directions_)
    assert np.array_equal(up.lower_, -down.upper_)
    assert np.allclose(
        up.control_signal(q, x), 1 - down.control_signal(q, x), rtol=0, atol=1e-12
    )


def test_without_a_reference_the_largest_entry_of_the_sum_is_positive(planted):
    total = planted[-1].directions_.sum(axis=(0, 1))
    assert total[np.abs(total).argmax()] > 0


def test_a_reference_for_two_degrees_of_freedom_is_followed_row_by_row():
    x, q, _, _ = record(np.random.default_rng(3), truth(2))
    rows = truth(2).mean(axis=0)
    crossed = np.array([rows[1], -rows[0]])
    learned = NullSpaceMap(n_dof=2, reference=crossed).fit(x, q)
    agreement = learned.directions_ @ crossed.T / np.linalg.norm(crossed, axis=1)
    # Planted planes turn by up to 0.4 rad about the reference: cosines above 0.9.
    assert np.diagonal(agreement, axis1=1, axis2=2).min() > 0.9


def test_training_samples_fill_exactly_the_range_from_0_to_1_at_the_centers(planted):
    _, q, _, _, learned = planted
    for k, center in enumerate(learned.centers_):
        c = learned.control_signal(q[learned.labels_ == k], center)
        assert c.min() == pytest.approx(0, abs=1e-12)
        assert c.max() == pytest.approx(1, abs=1e-12)


def test_quantiles_leave_the_ends_outside():
    x, q, _, _ = record(np.random.default_rng(4), truth(), noise=0.0)
    learned = NullSpaceMap(quantiles=(0.1, 0.9)).fit(x, q)
    own = q[learned.labels_ == 3] @ learned.directions_[3, 0]
    assert learned.lower_[3, 0] == pytest.approx(np.quantile(own, 0.1))
    assert learned.upper_[3, 0] == pytest.approx(np.quantile(own, 0.9))


def test_signal_is_the_range_weighted_mean_of_the_local_signals(planted):
    x, q, _, _, learned = planted
    rng = np.random.default_rng(5)
    where = rng.uniform(PLACES.min(axis=0), PLACES.max(axis=0), (200, 3))
    posture = rng.normal(size=(200, N))
    w = learned.interpolator_.weights(where)
    local = posture @ learned.directions_[:, 0].T - learned.lower_[:, 0]
    width = (learned.upper_ - learned.lower_)[:, 0]
    mean = np.average(local / width, axis=1, weights=w * width)
    c = learned.control_signal(posture, where)
    assert np.allclose(c, mean, rtol=0, atol=1e-12)
    # The same from the interpolated direction and range.
    low, high = learned.range(where)
    along = np.einsum("tdn,tn->td", learned.directions(where), posture)
    assert np.allclose(c, ((along - low) / (high - low))[:, 0], rtol=0, atol=1e-12)


def test_interpolated_directions_are_not_normalized_again(planted):
    lengths = np.linalg.norm(planted[-1].directions(PLACES.mean(axis=0)))
    assert 0.5 < lengths < 1 - 1e-6


def test_outside_the_hull_each_mode_does_what_it_says(planted):
    x, q, _, _, learned = planted
    away = PLACES.mean(axis=0) + 3 * (learned.centers_[2] - PLACES.mean(axis=0))
    modes = {
        mode: NullSpaceMap.from_arrays(
            learned.centers_,
            learned.directions_,
            learned.lower_,
            learned.upper_,
            outside=mode,
        )
        for mode in ("nearest", "project", "nan")
    }
    at_center = learned.control_signal(q[:9], learned.centers_[2])
    assert not learned.inside(away)
    assert np.allclose(modes["nearest"].control_signal(q[:9], away), at_center)
    assert np.isnan(modes["nan"].control_signal(q[:9], away)).all()
    # Projection is continuous: across the hull c changes as little as the hand moves.
    path = np.linspace(PLACES.mean(axis=0), away, 4001)
    steps = np.abs(np.diff(modes["project"].control_signal(q[0], path)))
    assert steps.max() < 0.05


@pytest.mark.parametrize("interpolation", ["natural", "laplace", "nearest"])
def test_the_interpolation_changes_the_weights_alone(planted, interpolation):
    x, q, _, _, learned = planted
    other = clone(learned).set_params(interpolation=interpolation).fit(x, q)
    for name in ("centers_", "directions_", "lower_", "upper_", "labels_"):
        np.testing.assert_array_equal(getattr(other, name), getattr(learned, name))
    place = PLACES.mean(axis=0) + [0.02, -0.03, 0.01]
    weights = other.interpolator_.weights(place)
    if interpolation == "nearest":
        nearest = np.linalg.norm(learned.centers_ - place, axis=1).argmin()
        assert weights.tolist() == np.eye(len(weights))[nearest].tolist()
        assert not other.inside(place)  # no volume belongs to it
        return
    exact = sibson_weights if interpolation == "natural" else laplace_weights
    # As in test_interpolation.
    expected = [float(w) for w in exact(learned.centers_, place)]
    np.testing.assert_allclose(weights, expected, atol=1e-12)


def test_missing_values_give_nan_and_touch_nothing_else(planted):
    x, q, _, _, learned = planted
    q, x = q[:4].copy(), x[:4].copy()
    whole = learned.control_signal(q, x)
    q[1, 2], x[2, 0], q[3, 0] = np.nan, np.nan, np.inf
    c = learned.control_signal(q, x)
    assert c[0] == whole[0]
    assert np.isnan(c[1:]).all()


def test_from_arrays_and_pickle_bring_the_same_map_back(planted):
    x, q, _, _, learned = planted
    arrays = [
        np.array(getattr(learned, name).tolist())  # as written to text and read again
        for name in ("centers_", "directions_", "lower_", "upper_")
    ]
    loaded = NullSpaceMap.from_arrays(*arrays, counts=learned.counts_)
    flat = NullSpaceMap.from_arrays(arrays[0], *(a[:, 0] for a in arrays[1:]))
    thawed = pickle.loads(pickle.dumps(learned))
    c = learned.control_signal(q, x)
    for other in (loaded, flat, thawed):
        assert np.array_equal(other.control_signal(q, x), c)
    assert np.array_equal(loaded.counts_, learned.counts_)


def test_a_zero_range_gives_nan_without_a_warning(planted):
    learned = planted[-1]
    same = NullSpaceMap.from_arrays(
        learned.centers_, learned.directions_, learned.lower_, learned.lower_
    )
    assert np.isnan(same.control_signal(np.zeros(N), PLACES)).all()


def test_one_point_needs_no_volume(planted):
    x, q, _, which, _ = planted
    own = which == 4
    learned = NullSpaceMap(n_points=1, radius=1.0).fit(x[own], q[own])
    c = learned.control_signal(q[own], [9.0, 9.0, 9.0])
    assert (c.min(), c.max()) == pytest.approx((0, 1), abs=1e-12)
    assert not learned.inside(x[:3]).any()


def test_every_sample_belongs_to_the_point_that_its_label_says(planted):
    x, _, _, which, learned = planted
    kept = learned.labels_ >= 0
    assert np.array_equal(match(learned)[which[kept]], learned.labels_[kept])
    assert np.array_equal(np.bincount(learned.labels_[kept]), learned.counts_)
    assert np.array_equal(learned.all_counts_, learned.counts_)
