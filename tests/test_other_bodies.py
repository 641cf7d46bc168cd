"""Calibration of people whose joints are not the package's body's."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
import other_body
import pytest
from scipy.spatial.transform import Rotation

from ikns.body.joint_axes import TILTS
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.exploration_fit import fit_explorations
from ikns.calibration.motion_fit import camera_noise
from ikns.calibration.scaling import scale
from ikns.errors import InvalidInput
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.recording import Recording

NOISE = 1e-3
STANDING = np.radians([10, 3, 0, 12, 5, 2, 0])


@cache
def recordings(seed: int, skin: float = 0.0) -> tuple[Recording, Recording]:
    """A static trial and ten held points."""
    body = other_body.draw_person(seed, wrist_sd=0.0)
    rng = np.random.default_rng(seed)
    q, _, _ = other_body.exploration(body, seconds=1.5, seed=seed)
    made = []
    for angles in (np.tile(STANDING, (60, 1)), q):
        markers, labels = other_body.recorded(body, angles, rng, NOISE)
        if skin and len(angles) > 60:
            gain = rng.normal(size=(7, *markers[0].shape))
            moved = np.tensordot(angles - STANDING, gain, axes=1)
            markers += skin * moved / np.sqrt(np.mean(np.sum(moved**2, axis=2)))
        time = np.arange(len(angles)) / 50
        made.append(Recording(time, markers, tuple(labels), "simulated"))
    return made[0], made[1]


@cache
def calibrated(seed: int, skin: float = 0.0):
    static, points = recordings(seed, skin)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return calibrate(static, [points])


def test_the_other_body_holds_its_hands_and_moves_its_elbow():
    body = other_body.draw_person(1)
    q, point, truth = other_body.exploration(body, seconds=1.5, seed=1)
    markers, hand, turned = other_body.place(body.right, q)
    for k in range(10):
        at = np.flatnonzero(point == k)
        # It wanders by 1.5 mm and 8 mrad per axis, from a start anywhere in the cycle.
        assert np.ptp(hand[at], axis=0).max() < 4e-3
        swing = Rotation.from_matrix(turned[at] @ turned[at[0]].T).magnitude()
        assert swing.max() < 2 * np.sqrt(3) * 8e-3
        assert np.ptp(markers["ELB"][at], axis=0).max() > 0.03
        step = 1e-5 * truth[k]
        there = other_body.place(body.right, q[at] + step)[1]
        # A direction nearest to null spaces that differ by up to 20 deg over the sweep.
        assert np.linalg.norm(there - hand[at], axis=1).max() < 1e-5 * 0.5 * 0.4


def test_the_other_arms_jacobian_is_a_twist():
    arm = other_body.draw_person(3).right
    q = np.random.default_rng(0).uniform(-1, 1, (4, 7))
    J, (_, _, R) = other_body.hand_jacobian(arm, q), other_body.place(arm, q)
    # Every joint turns the hand at unit rate; central differences of step 1e-6.
    np.testing.assert_allclose(np.linalg.norm(J[:, 3:], axis=1), 1, atol=1e-8)
    # The last joint's axis is fixed in the hand.
    own = np.einsum("tji,tj->ti", R, J[:, 3:, 6])
    np.testing.assert_allclose(own, np.tile(arm.axes[6], (4, 1)), atol=1e-8)


def axes_of(skeleton: Skeleton, joint: str, link: str, q: np.ndarray) -> np.ndarray:
    """Axis about which a joint turns a link, in the thorax frame."""
    column = 7 + skeleton.joint_names.index(joint)
    turned = q.copy()
    turned[column] += 0.5
    before, after = (skeleton.link_in_thorax(p, link)[1] for p in (q, turned))
    return Rotation.from_matrix(after @ before.T).as_rotvec() / 0.5


@pytest.mark.parametrize("seed", [1, 2])
def test_lengths_and_axes_of_another_body_are_found(seed):
    arm, found = other_body.draw_person(seed, wrist_sd=0.0).right, calibrated(seed)
    body = found.report["body"]
    for part, true in other_body.lengths(arm).items():
        error = body["lengths_m"][f"right_{part}"] - true
        assert abs(error) < 5e-3
        # 3.3 standard deviations: one case in a thousand.
        assert abs(error) < 3.3 * body["length_sd_m"][f"right_{part}"]
    # With the joints turning the upper arm is known far better than by landmarks.
    assert body["length_sd_m"]["right_upper_arm"] < 2e-3
    q = found.skeleton.neutral()
    q[7:] = 0.3
    elbow, fore = (
        axes_of(found.skeleton, f"right_{joint}", "right_forearm", q)
        for joint in ("elbow_flexion", "forearm_pronation")
    )
    bent = other_body.turn(arm.axes[3], np.array(0.3))
    lean = other_body.turn(np.array([1.0, 0, 0]), np.array(-arm.carrying))
    true = np.arccos(arm.axes[3] @ bent @ lean @ arm.axes[4])
    generic = np.radians(90 + 13)
    # These axes miss one another by 2 mm (sd) at either end, which the model does not:
    # 2.8 mm on the 45 mm by which the forearm's markers stand off their axis.
    off = abs(np.arccos(elbow @ fore) - true)
    assert off < np.arctan(2.8 / 45) * 1.2
    assert off < abs(generic - true)  # nearer than without a fit


@pytest.mark.parametrize("seed", [1, 2])
def test_directions_of_another_body_are_found(seed):
    body, found = other_body.draw_person(seed, wrist_sd=0.0), calibrated(seed)
    _, point, truth = other_body.exploration(body, seconds=1.5, seed=seed)
    hand = found.motions[0].task_position("right_arm")
    learned, off = found.null_space_map, []
    for k, n in enumerate(truth):
        here = np.median(hand[point == k], axis=0)
        nearest = np.linalg.norm(learned.centers_ - here, axis=1).argmin()
        off.append(np.arccos(min(1, abs(learned.directions_[nearest, 0] @ n))))
    assert np.degrees(np.sort(off))[8] < 6


def test_skin_that_goes_with_the_posture_makes_the_spreads_wide():
    body, found = other_body.draw_person(1, wrist_sd=0.0), calibrated(1, 6e-3)
    fitted, static = found.report["body"], found.report["static"]
    # 6 mm in three directions are 3.5 mm per axis; postures absorb part of it.
    assert 1e-3 < fitted["skin_sd_m"] < 3.5e-3
    for part, true in other_body.lengths(body.right).items():
        name = f"right_{part}"
        assert fitted["length_sd_m"][name] > 0.5 * static["length_sd_m"][name]
        error = fitted["lengths_m"][name] - true
        assert abs(error) < 3.3 * fitted["length_sd_m"][name]


def test_too_few_frames_leave_the_static_trials_body():
    static, points = recordings(1)
    short = Recording(points.time[:8], points.markers[:8], points.labels, "short")
    skeleton, _ = scale(Skeleton.load(), static)
    motion = MarkerIK(skeleton).track(short)
    again, report = fit_explorations(
        Skeleton.load(), skeleton, static, [short], [motion]
    )
    assert report is None
    assert again is skeleton


def test_frames_with_exchanged_markers_are_not_used():
    static, points = recordings(2)
    markers = points.markers.copy()
    first, second = (points.labels.index(label) for label in ("RELB", "RWRA"))
    markers[::20, [first, second]] = markers[::20, [second, first]]
    spoiled = Recording(points.time, markers, points.labels, "exchanged")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = calibrate(static, [spoiled]).report["body"]
    clean = calibrated(2).report["body"]
    for name in ("right_upper_arm", "right_forearm"):
        change = found["lengths_m"][name] - clean["lengths_m"][name]
        assert abs(change) < 3 * clean["length_sd_m"][name]


@pytest.mark.parametrize("rate", [50, 200])
def test_camera_noise_is_that_of_the_cameras(rate):
    rng = np.random.default_rng(0)
    time = np.arange(4 * rate) / rate
    # 10 cm at 0.3 Hz: accelerations of 0.36 m/s^2, 0.14 mm in a frame at 50 Hz.
    slow = 0.1 * np.sin(2 * np.pi * 0.3 * time)[:, None, None]
    markers = slow + 1e-3 * rng.normal(size=(len(time), 8, 3))
    markers[rng.random(markers.shape[:2]) < 0.1] = np.nan
    # A median of 2000 to 12000 numbers that share noise: known to about 4 %.
    assert camera_noise([markers]) == pytest.approx(1e-3, rel=0.12)
    assert camera_noise([np.full((5, 2, 3), np.nan)]) > 0


def test_tilts_move_markers_as_their_slopes_say():
    body = Skeleton.load()
    rng = np.random.default_rng(4)
    axes = [(joint, component) for joint, component, _ in TILTS]
    q = body.integrate(body.neutral(), rng.normal(0, 0.5, body.nv))
    start = {joint: rng.normal(0, 0.1, 3) for joint, _ in axes}
    body = body.tilted(start)
    slopes = body.tilt_jacobian(q, axes)
    h = 1e-5
    for k, (joint, component) in enumerate(axes):
        step = h * np.eye(3)[component]
        there, back = (
            body.tilted({joint: s * step}).markers_in_world(q) for s in (1, -1)
        )
        # Second order in h; a URDF's nine digits over the step.
        np.testing.assert_allclose(slopes[..., k], (there - back) / (2 * h), atol=2e-4)


def test_a_tilt_of_no_joint_is_refused():
    with pytest.raises(InvalidInput, match="no joint 'knee'"):
        Skeleton.load().tilted({"knee": np.zeros(3)})
