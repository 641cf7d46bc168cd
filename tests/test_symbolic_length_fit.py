"""Lengths from a static trial and moving frames together."""

import casadi as ca
import numpy as np
import pytest

from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.size_fit import MARKER_SD, POSE_SD, size_covariance
from ikns.errors import InvalidInput, MarkerMismatch, NotEnoughData
from ikns.recording.recording import Recording
from ikns.symbolic import fit_lengths, markers_in_world
from ikns.symbolic.length_program import FrameData, LengthProgram

FACTORS = dict(
    zip(SEGMENTS, [1.03, 0.97, 1.06, 0.95, 1.04, 0.98, 1.05, 0.96, 1.03], strict=True)
)


@pytest.fixture(scope="module")
def generic():
    return Skeleton.load()


def person(generic, *, misplaced=4e-3, seed=0):
    """A body of other proportions whose landmarks were missed by 4 mm per axis."""
    body = generic.resized(FACTORS)
    rng = np.random.default_rng(seed)
    places = body.marker_positions + rng.normal(0, misplaced, (24, 3))
    return body.with_markers(body.marker_set.at(places))


def filmed(body, angles, *, noise=0.0, seed=0, source="simulated"):
    """Recording of a body at joint angles (T, 18), its trunk still."""
    rng = np.random.default_rng(seed)
    root = np.tile([0.3, -0.2, 1.1, 0.5, 0.5, 0.5, 0.5], (len(angles), 1))
    markers = np.stack([body.markers_in_world(q) for q in np.hstack([root, angles])])
    markers += noise * rng.normal(size=markers.shape)
    time = np.arange(len(angles)) / 50
    return Recording(time, markers, body.marker_set.labels, source)


def standing(body):
    return filmed(body, np.tile(np.radians([5, 0, 15, 8, 0, 20, 0, 0, 0] * 2), (60, 1)))


def exercise(body, n=120):
    """Every joint of both arms through 60 deg or so, each at a rate of its own."""
    rates = np.linspace(1.1, 4.3, 18)
    turns = 0.5 * np.sin(np.outer(np.arange(n) / 50, rates) + np.arange(18))
    middle = np.radians([0, 5, 20, 30, 0, 70, 0, 0, 5] * 2)
    reach = np.array([0.3, 0.3, 1, 1, 1, 1, 1, 1, 0.5] * 2)
    return middle + turns * reach


def errors(lengths, body, parts):
    truth = body.segment_lengths
    return {p: abs(lengths[p] - truth[p]) for p in truth if p.endswith(parts)}


def test_turning_joints_show_lengths_that_misplaced_markers_hide(generic):
    body = person(generic)
    recording = filmed(body, exercise(body), source="simulated exercise")
    skeleton, found = fit_lengths(
        generic, standing(body), [recording], n_frames=30, independent_frames=30
    )
    assert found.solved
    assert skeleton.segment_lengths == found.lengths
    assert found.frames == 30
    assert "RMEP" not in skeleton.marker_set.labels
    # Landmarks missed by 4 mm at both ends, two to a joint, move a static length by up
    # to 4 mm; without noise only the priors' pull is left, far below 1 mm.
    limbs = ("upper_arm", "forearm")
    assert max(errors(found.static_lengths, body, limbs).values()) > 2e-3
    assert max(errors(found.lengths, body, limbs).values()) < 5e-4
    for part, sd in found.length_sd.items():
        assert sd < found.static_length_sd[part]


def test_a_marker_that_the_static_trial_lacks_takes_no_part(generic):
    body = person(generic)
    recording = filmed(body, exercise(body), source="simulated exercise")
    static = standing(body)
    without = static.select([label for label in static.labels if label != "RUPA"])
    settings = {"n_frames": 20, "marker_sd": 1e-3}
    skeleton, found = fit_lengths(generic, without, [recording], **settings)
    assert "RUPA" not in skeleton.marker_set.labels
    # Whatever the moving frames show of it.
    elsewhere = recording.markers.copy()
    elsewhere[:, recording.labels.index("RUPA")] += 0.3
    moved = Recording(recording.time, elsewhere, recording.labels, recording.source)
    _, same = fit_lengths(generic, without, [moved], **settings)
    assert same.lengths == found.lengths


def test_joints_that_do_not_turn_add_nothing(generic):
    body = person(generic)
    still = filmed(body, np.tile(standing_angles(), (60, 1)), noise=1e-4, seed=3)
    _, found = fit_lengths(
        generic, standing(body), [still], n_frames=20, marker_sd=MARKER_SD
    )
    # The same posture again: the markers' noise of 0.1 mm is all that can differ, and
    # the static trial is believed to 1 mm instead of 1 mm / sqrt(21).
    for part, length in found.lengths.items():
        assert length == pytest.approx(found.static_lengths[part], abs=1e-3)
        assert found.length_sd[part] > 0.9 * found.static_length_sd[part]


def standing_angles():
    return np.radians([5, 0, 15, 8, 0, 20, 0, 0, 0] * 2)


def test_a_side_that_rests_keeps_its_static_uncertainty(generic):
    body = person(generic, seed=5)
    angles = exercise(body)
    names = list(generic.joint_names)
    left = [i for i, name in enumerate(names) if name.startswith("left")]
    angles[:, left] = standing_angles()[left]
    recording = filmed(body, angles, noise=1e-3)
    _, found = fit_lengths(
        generic, standing(body), [recording], n_frames=30, independent_frames=30
    )
    # Left and right differ by 1 % or so in one person (SIDE_SD), and shared knowledge
    # of that narrows the resting side a little, the moving one a lot.
    ratio = {p: found.length_sd[p] / found.static_length_sd[p] for p in found.length_sd}
    assert ratio["right_upper_arm"] < 0.5 < ratio["left_upper_arm"]


def test_the_spread_of_the_markers_is_found(generic):
    body = person(generic)
    recording = filmed(body, exercise(body), noise=2e-3)
    _, found = fit_lengths(generic, standing(body), [recording], n_frames=25)
    # 25 frames of 42 free numbers: 1 / sqrt(2 * 1050) = 2.2 %; the rounds stop at 5 %.
    assert found.marker_sd == pytest.approx(2e-3, rel=0.1)
    _, given = fit_lengths(
        generic, standing(body), [recording], n_frames=25, marker_sd=5e-3
    )
    assert given.marker_sd == 5e-3
    assert given.length_sd["right_forearm"] > found.length_sd["right_forearm"]


@pytest.fixture(scope="module")
def small(generic):
    """Two frames: the program and all it is asked."""
    body = person(generic)
    rng = np.random.default_rng(1)
    q = np.hstack([np.tile([0, 0, 0, 0, 0, 0, 1.0], (2, 1)), exercise(body, 2)])
    markers = np.stack([body.markers_in_world(row) for row in q])
    weights = rng.uniform(0.5, 1, (2, 24)) / MARKER_SD**2
    weights[1, 3] = 0
    markers[1, 3] = np.nan
    return FrameData(q, markers, weights, np.full(2, 1 / POSE_SD**2))


def written_out(generic, frames, found):
    """Half the cost from the public function, on a chart about the minimum found."""
    places = markers_in_world(generic)
    s, o = ca.SX.sym("s", 9), ca.SX.sym("o", 24, 3)
    steps = [ca.SX.sym(f"v{k}", 24) for k in range(2)]
    spread = np.array([m.placement_sd for m in generic.marker_set.markers])
    cost = ca.bilin(ca.DM(np.linalg.inv(size_covariance())), s, s)
    cost += ca.sumsqr(o / spread)
    for k, v in enumerate(steps):
        half, (x, y, z, w) = v[3:6] / 2, found.q[k, 3:7]
        turned = ca.vertcat(
            w * half + ca.DM([x, y, z]) + ca.cross(ca.DM([x, y, z]), half),
            w - ca.dot(ca.DM([x, y, z]), half),
        )
        q = ca.vertcat(
            found.q[k, :3] + v[:3], turned / ca.norm_2(turned), found.q[k, 7:] + v[6:]
        )
        off = places(q, s, o) - np.nan_to_num(frames.markers[k])
        cost += ca.dot(frames.weights[k], ca.sum2(off**2))
        cost += frames.pulls[k] * ca.sumsqr(q[7:])
    free = ca.vertcat(s, ca.vec(o), *steps)
    curvature, slope = ca.hessian(cost / 2, free)
    at = np.concatenate([found.log_sizes, found.offsets.ravel(order="F"), np.zeros(48)])
    both = ca.Function("both", [free], [slope, curvature])(at)
    return both[0].full().ravel(), both[1].full()


def test_it_finds_a_minimum_of_the_cost_and_its_curvature(generic, small):
    found = LengthProgram(generic, 2).solve(small, np.zeros(9), np.zeros((24, 3)))
    assert found.solved
    slope, curvature = written_out(generic, small, found)
    assert (np.linalg.eigvalsh(curvature) > 0).all()
    # What a Newton step from here would still gain, in squared standard deviations;
    # IPOPT stops at 1e-6 of a gradient that it has scaled down from 1e5 to 100.
    assert slope @ np.linalg.solve(curvature, slope) < 1e-6
    covariance = np.linalg.inv(curvature)[:9, :9]
    # Conditioned like 1e8: 1e-16 of rounding times that.
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-5, atol=1e-9)
    # What is seen only narrows what is known.
    assert np.linalg.eigvalsh(size_covariance() - covariance).min() > 0


def test_frames_are_far_apart_and_the_same_every_time(generic):
    body = person(generic)
    recording = filmed(body, exercise(body), noise=1e-3)
    one, two = (
        fit_lengths(generic, standing(body), [recording], n_frames=12)[1].lengths
        for _ in range(2)
    )
    assert one == two


def test_bad_input_is_refused_with_one_sentence(generic):
    body = person(generic)
    static, moving = standing(body), filmed(body, exercise(body, 30), source="a.c3d")
    with pytest.raises(InvalidInput, match="at least 10 frames, found 3"):
        fit_lengths(generic, static, [moving], n_frames=3)
    with pytest.raises(InvalidInput, match="marker_sd above 0 m, found -1"):
        fit_lengths(generic, static, [moving], marker_sd=-1.0)
    short = Recording(moving.time[:5], moving.markers[:5], moving.labels, "short.c3d")
    with pytest.raises(NotEnoughData, match=r"short.c3d: expected at least 10.* 5\.$"):
        fit_lengths(generic, static, [short])
    with pytest.raises(NotEnoughData, match="no recording: expected"):
        fit_lengths(generic, static, [])
    strange = Recording(moving.time, moving.markers[:, :3], ("A", "B", "C"), "b.c3d")
    with pytest.raises(MarkerMismatch, match="b.c3d: only 0 of"):
        fit_lengths(generic, static, [strange])
