"""What the map says about samples that are too few, too alike, or contradictory."""

import re
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from ikns.body.chains import chain_joints
from ikns.errors import IknsError, InvalidInput, NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.map import MapWarning, NullSpaceMap, null_space_samples, still_mask
from ikns.nullspace.map.alignment import spanning_tree

PLACES = np.array(list(np.ndindex(2, 2, 2)), dtype=float) * 0.3
rng = np.random.default_rng(0)


def samples(places=PLACES, directions=None, *, n=40, joints=3):
    """Still samples within 2 mm of places, along one direction at each."""
    if directions is None:
        directions = np.tile(np.eye(joints)[0], (len(places), 1))
    which = np.repeat(np.arange(len(places)), n)
    x = places[which] + rng.uniform(-0.002, 0.002, (len(which), places.shape[1]))
    q = rng.uniform(-0.5, 0.5, (len(which), 1)) * directions[which]
    return x, q + rng.normal(scale=0.01, size=q.shape)


def refused(error, X, y, **parameters):
    """The one sentence with which a fit is refused."""
    velocity = parameters.pop("velocity", None)
    with pytest.raises(error) as caught:
        NullSpaceMap(**{"n_points": 8, **parameters}).fit(X, y, velocity=velocity)
    sentence = str(caught.value)
    if isinstance(caught.value, IknsError):
        assert sentence.endswith(".")
        assert not re.search(r"[a-z]\. [A-Z]|\n", sentence), "more than one sentence"
    return sentence


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["x", "q"])
def test_samples_that_are_not_finite_are_refused(bad, where):
    x, q = samples()
    (x if where == "x" else q)[5, 1] = bad
    with pytest.raises(ValueError, match="NaN|infinity"):
        NullSpaceMap(n_points=8).fit(x, q)


def test_fewer_samples_than_points_are_refused():
    x, q = samples()
    assert "n_samples=7" in refused(NotEnoughData, x[:7], q[:7])


def test_samples_at_one_place_are_refused():
    x, q = samples()
    assert "in one plane" in refused(NotEnoughData, x * [1, 1, 0], q)
    assert "on one line" in refused(NotEnoughData, x * [1, 0, 0] + 5e-4 * q, q)
    assert "at one place" in refused(NotEnoughData, np.full_like(x, 0.1), q)
    sheet = x * [1, 1, 0] + rng.normal(scale=0.005, size=x.shape)
    assert "points lie in one plane" in refused(NotEnoughData, sheet, q)


def test_too_few_points_with_samples_are_refused_and_counted():
    x, q = samples()
    keep = np.zeros(len(x), dtype=bool)
    keep[:120] = keep[120::40] = True  # three points whole, one sample of the others
    sentence = refused(NotEnoughData, x[keep], q[keep], min_samples=5)
    assert "5 of 8 PCA points have fewer than 5 samples" in sentence
    assert sentence.count(" has 1") == 3
    assert "; and 2 more" in sentence


def test_a_radius_that_is_too_small_is_blamed_and_not_the_hand():
    x, q = samples()
    x = x + 1e-3 * rng.normal(size=x.shape)  # a held hand sways by millimeters
    sentence = refused(NotEnoughData, x, q, radius=1e-7)
    assert f"of {len(x)} samples are within the radius of 1e-07 m" in sentence
    assert "give a larger radius" in sentence
    assert "hand was not held" not in sentence


def test_points_that_overlap_are_reported():
    x = rng.normal(scale=0.005, size=(800, 3))  # the hand never went anywhere
    q = rng.uniform(-0.5, 0.5, (800, 1)) * [1.0, 0.0, 0.0]
    with pytest.warns(MapWarning, match="hardly farther apart"):
        NullSpaceMap(n_points=8).fit(x, q)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"n_dof": 0}, "n_dof between 1 and the 3 joints"),
        ({"n_dof": 4}, "n_dof between 1 and the 3 joints"),
        ({"variance": 0.0}, "variance"),
        ({"variance": 1.5}, "variance"),
        ({"quantiles": (0.9, 0.1)}, "quantiles"),
        ({"quantiles": (0.1,)}, "quantiles"),
        ({"min_samples": 0}, "min_samples"),
        ({"domain": "torque"}, "domain"),
        ({"outside": "guess"}, "outside"),
        ({"interpolation": "cubic"}, "interpolation"),
        ({"radius": -1.0}, "radius"),
        ({"n_points": 0}, "at least one point"),
        ({"reference": [1.0, 0.0]}, "reference of shape"),
        ({"reference": [np.nan, 0.0, 0.0]}, "reference of shape"),
        ({"reference": [0.0, 0.0, 0.0]}, "independent rows"),
        ({"domain": "velocity"}, "velocities"),
        ({"domain": "velocity", "velocity": np.zeros((3, 3))}, "velocity for each"),
    ],
)
def test_parameters_out_of_range_are_refused(parameters, words):
    assert words in refused(InvalidInput, *samples(), **parameters)


def test_points_with_too_few_samples_are_left_out_and_named():
    x, q = samples()
    keep = np.ones(len(x), dtype=bool)
    keep[120:159] = False  # one sample is left at the fourth corner
    with pytest.warns(MapWarning, match=r"1 of 8 .* fewer than 3 .*\(.*\) has 1"):
        learned = NullSpaceMap(n_points=8).fit(x[keep], q[keep])
    assert learned.all_counts_.min() == 1
    assert len(learned.all_centers_) == 8
    assert len(learned.centers_) == len(learned.counts_) == 7
    assert learned.labels_.max() == 6
    assert learned.labels_[120] == -1


def test_a_point_where_no_joint_moves_has_no_influence():
    x, q = samples()
    q[:40] = [0.3, 0.2, 0.1]
    with pytest.warns(MapWarning, match=r"no joint moves at \("):
        learned = NullSpaceMap(n_points=8).fit(x, q)
    (silent,) = np.flatnonzero(learned.n_components_ == 0)
    assert not learned.directions_[silent].any()
    assert np.isnan(learned.control_signal(q[0], learned.centers_[silent]))
    others = np.delete(learned.directions_[:, 0], silent, axis=0)
    assert (others @ others[0] > 0.9).all()
    middle = learned.control_signal(q[100:], x.mean(axis=0))
    assert np.isfinite(middle).all()


def test_more_freedom_than_wanted_is_reported():
    x, q = samples()
    q[:40, 1] += rng.uniform(-0.5, 0.5, 40)
    with pytest.warns(MapWarning, match="took 2 components"):
        learned = NullSpaceMap(n_points=8).fit(x, q)
    assert sorted(learned.n_components_) == [1] * 7 + [2]


def test_the_weighted_sum_takes_the_signs_that_agree_with_the_neighbor():
    # At one point two components, 3 to 1 in variance, along axes turned by 30 deg; the
    # sum is normalized (r1 p1 + r2 p2) with both p on the neighbors' side.
    x, q = samples()
    s = np.array([1, -1, 0, 0] * 10) * np.sqrt(3) * 0.2
    t = np.array([0, 0, 1, -1] * 10) * 0.2
    p1 = np.array([np.cos(np.pi / 6), -0.5, 0])
    p2 = np.array([0.5, np.cos(np.pi / 6), 0])
    q[:40] = s[:, None] * p1 + t[:, None] * p2
    with pytest.warns(MapWarning, match="took 2 components"):
        learned = NullSpaceMap(n_points=8, reference=[1.0, 0, 0]).fit(x, q)
    two = learned.directions_[np.argmax(learned.n_components_), 0]
    expected = 0.75 * p1 + 0.25 * p2
    assert np.allclose(two, expected / np.linalg.norm(expected), rtol=0, atol=1e-12)


def test_almost_orthogonal_neighbors_are_named():
    directions = np.tile([1.0, 0.0, 0.0], (8, 1))
    directions[7] = [0.1, 0.995, 0.0]
    x, q = samples(directions=directions)
    with pytest.warns(MapWarning, match=r"uncertain: \(.*\) and \(.*\) \(cos") as said:
        NullSpaceMap(n_points=8, reference=[1.0, 0, 0]).fit(x, q)
    assert len(said) == 1
    assert str(said[0].message).count(") and (") == 1  # the one edge of the tree


def test_neighbors_opposed_in_spite_of_the_tree_are_named():
    # Around a square of points the direction turns by 45 deg a step: after four steps
    # the line is the same but its direction reversed, so one edge must disagree.
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * 0.3
    places = np.array([[*p, z] for p in ring for z in (0.0, 0.3)])
    angle = np.repeat(np.pi / 4 * np.arange(4), 2)
    directions = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    x, q = samples(places, directions)
    with pytest.warns(MapWarning, match=r"cosine -0\.7"):
        NullSpaceMap(n_points=8).fit(x, q)


def test_an_almost_orthogonal_reference_is_reported():
    x, q = samples()
    with pytest.warns(MapWarning, match="which way c rises is uncertain"):
        NullSpaceMap(n_points=8, reference=[0.0, 1.0, 0.0]).fit(x, q)


def test_a_good_recording_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        NullSpaceMap(n_points=8, reference=[1.0, 0.0, 0.0]).fit(*samples())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"centers": PLACES[:5]}, "expected centers"),
        ({"lower": np.ones((8, 2))}, "expected centers"),
        ({"directions": np.full((8, 3), np.nan)}, "finite"),
        ({"lower": np.full(8, 2.0)}, "lower <= upper"),
        ({"centers": PLACES * [1, 1, 0]}, "points"),
        ({"interpolation": "cubic"}, "interpolation as one of .* found 'cubic'"),
    ],
)
def test_arrays_that_are_no_map_are_refused(change, words):
    arrays = {
        "centers": PLACES,
        "directions": np.ones((8, 3)),
        "lower": np.zeros(8),
        "upper": np.ones(8),
    }
    with pytest.raises((InvalidInput, NotEnoughData), match=words):
        NullSpaceMap.from_arrays(**{**arrays, **change})


def test_signals_of_the_wrong_width_are_refused():
    learned = NullSpaceMap(n_points=8).fit(*samples())
    with pytest.raises(InvalidInput, match=r"joint vectors of shape \(\.\.\., 3\)"):
        learned.control_signal(np.zeros(2), np.zeros(3))
    with pytest.raises(InvalidInput, match=r"hand positions of shape \(\.\.\., 3\)"):
        learned.control_signal(np.zeros(3), np.zeros(2))


@given(st.integers(0, 2**32 - 1), st.integers(1, 9))
def test_spanning_tree_is_the_strongest(seed, n):
    own = np.random.default_rng(seed)
    path = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    edges = np.unique(np.vstack([path, np.sort(own.integers(0, n, (6, 2)))]), axis=0)
    edges = edges[edges[:, 0] != edges[:, 1]]
    strength = own.uniform(0.1, 1, len(edges))
    tree = spanning_tree(strength, edges, own.integers(n))
    assert len(tree) == n - 1
    graph = coo_array((2 - strength, edges.T), (n, n))
    lightest = minimum_spanning_tree(graph).sum()
    number = {frozenset(e): k for k, e in enumerate(edges.tolist())}
    found = sum(2 - strength[number[frozenset(pair)]] for pair in tree)
    assert found == pytest.approx(lightest, abs=1e-12)


def motion(speed, *, chain="right_arm", missing=()):
    """A motion whose right hand has these speeds (m/s); the left hand rests."""
    T = len(speed)
    joints = chain_joints("both_arms")
    velocity = np.zeros((T, 2, 3))
    velocity[:, 0, 1] = speed
    hand = rng.normal(size=(T, 2, 3))
    hand[list(missing), 0] = np.nan
    return Motion(
        time=np.arange(T) / 100,
        q=rng.normal(size=(T, len(joints))),
        v=rng.normal(size=(T, len(joints))),
        joint_names=joints,
        hand_in_thorax=hand,
        hand_rotation_in_thorax=np.tile(np.eye(3), (T, 2, 1, 1)),
        hand_velocity_in_thorax=velocity,
        residual=np.zeros(T),
        iterations=np.ones(T, int),
        converged=np.ones(T, bool),
    )


def test_the_gate_keeps_slow_and_known_samples():
    moved = motion([0.01, 0.2, 0.049, 0.051, np.nan, 0.0], missing=[5])
    assert still_mask(moved).tolist() == [True, False, True, False, False, False]
    x, q = null_space_samples(moved)
    assert np.array_equal(x, moved.task_position("right_arm")[[0, 2]])
    assert np.array_equal(q, moved.chain_angles("right_arm")[[0, 2]])
    assert still_mask(moved, "left_arm").all()
    assert still_mask(moved, max_hand_speed=0.1).sum() == 3


def test_rests_that_are_too_short_are_left_out():
    speed = np.ones(40)
    speed[2:10] = speed[20:31] = 0.0  # 0.07 s and 0.10 s from first to last sample
    moved = motion(speed)
    assert np.flatnonzero(still_mask(moved, min_duration=0.1)).tolist() == [
        *range(20, 31)
    ]
    assert still_mask(moved, min_duration=0.07).sum() == 19
    with pytest.raises(NotEnoughData, match="for 0.2 s .* the 19 slower ones"):
        null_space_samples(moved, min_duration=0.2)


def test_both_arms_are_still_when_the_faster_hand_is():
    moved = motion([0.01, 0.2])
    x, q = null_space_samples(moved, "both_arms")
    assert np.array_equal(x, moved.hand_in_thorax[:1].mean(axis=1))
    assert q.shape == (1, 14)


@pytest.mark.parametrize(
    ("speed", "words"),
    [([0.3, 0.12, np.nan], "the slowest has 0.12 m/s"), ([np.nan], "none has a known")],
)
def test_a_motion_without_still_samples_is_refused_with_its_slowest_speed(speed, words):
    with pytest.raises(NotEnoughData, match=words):
        null_space_samples(motion(speed))
