"""One compiled call against the same steps one by one in Python."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from ikns.body.chains import SIDES, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.calibration import sight_needs
from ikns.errors import InvalidInput
from ikns.live.control import FrameSolver
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.recording import Recording


@pytest.fixture(scope="module")
def skeleton():
    body = Skeleton.load()
    return body.with_markers(body.marker_set.without_static())


def wandering(skeleton, n, seed=0):
    """Poses and markers of arms that wander, 5 % of the markers hidden."""
    rng = np.random.default_rng(seed)
    q = skeleton.neutral()
    q[7:] = 0.4
    poses, frames = [], []
    for _ in range(n):
        q = q.copy()
        q[7:] = np.clip(q[7:] + rng.normal(0, 0.03, 18), 0.05, 0.8)
        seen = skeleton.markers_in_world(q) + rng.normal(0, 1e-3, (22, 3))
        seen[rng.random(22) < 0.05] = np.nan
        poses.append(q)
        frames.append(seen)
    return np.array(poses), np.array(frames)


def some_map(skeleton, poses, chain, *, n_points=10, n_dof=1, **parameters):
    """A map with any directions around where the hands were: no motion is tested."""
    rng = np.random.default_rng(7)
    rows = [SIDES.index(side) for side in chain_sides(chain)]
    places = skeleton.hands_in_thorax(poses)[0][:, rows].mean(axis=1)
    spread = np.ptp(places, axis=0) / 2
    points = places.mean(axis=0) + rng.uniform(-1, 1, (n_points, 3)) * spread
    n = len(chain_joints(chain))
    directions = np.linalg.qr(rng.normal(size=(n_points, n, n_dof)))[0]
    lower = rng.uniform(-1, 0, (n_points, n_dof))
    return NullSpaceMap.from_arrays(
        points,
        np.swapaxes(directions, 1, 2),
        lower,
        lower + rng.uniform(0.5, 1, lower.shape),
        **parameters,
    )


def one_by_one(skeleton, null_space_map, chain, frames):
    solver, q, found = MarkerIK(skeleton), None, []
    rows = [SIDES.index(side) for side in chain_sides(chain)]
    columns = [skeleton.joint_names.index(name) for name in chain_joints(chain)]
    for seen in frames:
        pose = solver.solve(seen, q)
        q = None if q is None and np.isnan(pose.residual) else pose.q
        place = skeleton.hands_in_thorax(pose.q)[0][rows].mean(axis=0)
        c = null_space_map.control_signal(pose.q[7:][columns], place)
        found.append((pose, place, np.atleast_1d(c), null_space_map.inside(place)))
    return found


@pytest.mark.parametrize(
    ("chain", "settings"),
    [
        ("right_arm", {}),
        ("left_arm", {"outside": "project"}),
        ("right_arm", {"outside": "nan"}),
        ("right_arm_clavicle", {"n_dof": 2}),
        ("both_arms", {"n_dof": 2, "n_points": 20}),
        ("right_arm", {"n_points": 3}),
        ("right_arm", {"interpolation": "laplace"}),
        ("right_arm", {"interpolation": "nearest"}),
    ],
)
def test_a_frame_is_its_steps_one_by_one(skeleton, chain, settings):
    poses, frames = wandering(skeleton, 120)
    learned = some_map(skeleton, poses, chain, **settings)
    solver = FrameSolver(skeleton, learned, chain)
    recording = Recording(
        np.arange(len(frames)) / 100, frames, skeleton.marker_set.labels
    )
    needs = [columns for columns, _ in sight_needs(skeleton, chain).values()]
    chain_markers = np.concatenate(needs)
    shown = MarkerIK(skeleton).track(recording).in_sight(chain)
    assert shown.any()
    inside, worn = 0, skeleton.markers_in_world(poses[0])
    steps = one_by_one(skeleton, learned, chain, frames)
    for seen, known, (pose, place, c, within) in zip(frames, shown, steps, strict=True):
        frame = solver.solve(seen)
        np.testing.assert_array_equal(frame.q, pose.q)
        np.testing.assert_array_equal(frame.hand_in_thorax, place)
        assert frame.residual == pose.residual
        away = np.linalg.norm(skeleton.markers_in_world(pose.q) - seen, axis=1)
        # pin's forward kinematics against our own: rounding of places of up to 1 m.
        worst = np.nanmax(away[chain_markers])
        assert frame.worst_residual == pytest.approx(worst, abs=1e-14)
        # scipy's distances of what is seen against those of the model in any posture:
        # the same rounding.
        off = [
            np.nanmax([0.0, *np.abs(pdist(seen[c]) - pdist(worn[c]))]) for c in needs
        ]
        assert frame.intermarker_error == pytest.approx(max(off), abs=1e-14)
        assert (frame.iterations, frame.converged) == (pose.iterations, pose.converged)
        assert frame.in_sight == known
        certain = frame.uncertainty <= solver.max_uncertainty
        assert frame.inside == (certain[0] and within)
        inside += frame.inside
        if certain.all():
            # The same sums of at most 20 products in another order, over a width of
            # at least 0.5: 20 * 1.1e-16 / 0.5 times values of order 1.
            np.testing.assert_allclose(frame.c, c, rtol=0, atol=1e-14)
        else:
            assert np.isnan(frame.c[~certain]).all()
    natural = len(learned.centers_) > 3 and learned.interpolation != "nearest"
    assert (inside > 5) == natural


def test_without_markers_the_pose_stays_and_there_is_no_signal(skeleton):
    poses, frames = wandering(skeleton, 2)
    solver = FrameSolver(skeleton, some_map(skeleton, poses, "right_arm"), "right_arm")
    before = solver.solve(frames[0])
    gone = solver.solve(np.full_like(frames[0], np.nan))
    np.testing.assert_array_equal(gone.q, before.q)
    assert np.isnan([gone.residual, gone.worst_residual]).all()
    assert gone.intermarker_error == 0
    assert np.isnan(gone.c).all()
    assert not gone.in_sight
    assert not gone.inside


def test_until_markers_come_every_frame_starts_from_scratch(skeleton):
    poses, frames = wandering(skeleton, 2)
    learned = some_map(skeleton, poses, "right_arm")
    late, prompt = (FrameSolver(skeleton, learned, "right_arm") for _ in range(2))
    late.solve(np.full_like(frames[0], np.nan))
    np.testing.assert_array_equal(late.solve(frames[0]).q, prompt.solve(frames[0]).q)


def test_a_reset_solver_remembers_nothing(skeleton):
    poses, frames = wandering(skeleton, 40)
    learned = some_map(skeleton, poses, "right_arm")
    used, new = (FrameSolver(skeleton, learned, "right_arm") for _ in range(2))
    for seen in frames:
        used.solve(seen)
    used.reset()
    np.testing.assert_array_equal(used.solve(frames[0]).q, new.solve(frames[0]).q)
    used.reset(poses[5])
    np.testing.assert_array_equal(
        used.solve(frames[5]).q, MarkerIK(skeleton).solve(frames[5], poses[5]).q
    )


def test_results_are_the_callers_own(skeleton):
    poses, frames = wandering(skeleton, 2)
    solver = FrameSolver(skeleton, some_map(skeleton, poses, "right_arm"), "right_arm")
    first = solver.solve(frames[0])
    kept = [np.copy(part) for part in first[:3]]
    solver.solve(frames[1])
    first.q[:] = 0
    for part, copy in zip((first.c, first.hand_in_thorax), kept[::2], strict=True):
        np.testing.assert_array_equal(part, copy)
    np.testing.assert_array_equal(solver.solve(frames[1]).converged, True)


def test_what_does_not_fit_is_refused(skeleton):
    poses, frames = wandering(skeleton, 2)
    learned = some_map(skeleton, poses, "right_arm")
    with pytest.raises(InvalidInput, match=r"14 joints of both_arms, found one of 7"):
        FrameSolver(skeleton, learned, "both_arms")
    solver = FrameSolver(skeleton, learned, "right_arm")
    with pytest.raises(InvalidInput, match=r"expected markers \(22, 3\)"):
        solver.solve(frames[0][:5])
    with pytest.raises(InvalidInput, match=r"finite pose"):
        solver.reset(np.full(25, np.nan))
