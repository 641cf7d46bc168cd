"""Virtual subjects do what they say, and their truth is true.

Nothing here, nor in the simulation, uses a direction learned from a recording: the
motion has to stand on the Jacobian alone.
"""

import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns import simulation
from ikns.body.chains import SIDES
from ikns.errors import FileError, InvalidInput
from ikns.numerics.rigid import rigid_transform
from ikns.numerics.subspace import null_space
from ikns.recording.files import read
from ikns.simulation import (
    Protocol,
    Unsteadiness,
    simulate_protocol,
    virtual_subject,
    write_protocol,
)
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.artifacts import SoftTissue, occlusions
from ikns.simulation.movement import explore, reach
from ikns.simulation.places import (
    BOX_HIGH,
    BOX_LOW,
    VERTEX_SD,
    Place,
    box_points,
    explored_places,
)
from ikns.simulation.wander import minimum_jerk, tremor, wander

STEADY = Unsteadiness(drift=0.0, tilt=0.0, tremor=0.0, tremor_tilt=0.0)
CLEAN = {"marker_noise": 0.0, "occluded": 0.0}
SHORT = {"n_points": 3, "static_seconds": 1.0, "free_seconds": 3.0, "quick": True}


@pytest.fixture(scope="module")
def run() -> Protocol:
    """Return a short right-handed protocol with the usual artifacts."""
    return simulate_protocol(virtual_subject(4), seed=40, **SHORT)


@pytest.fixture(scope="module")
def steady() -> Protocol:
    """Return a left-handed protocol of somebody who holds the hand perfectly still."""
    return simulate_protocol(
        virtual_subject(5),
        seed=50,
        side="left",
        n_points=2,
        static_seconds=0.5,
        free_seconds=0.5,
        unsteadiness=STEADY,
        quick=True,
        **CLEAN,
    )


def hand(run: Protocol) -> tuple[np.ndarray, np.ndarray]:
    """Return true position and orientation of the exploring hand at the points."""
    truth, side = run.points.truth, SIDES.index(run.side)
    return truth.hand_in_thorax[:, side], truth.hand_rotation_in_thorax[:, side]


def box(arm: ArmKinematics, *, n: int) -> list[Place]:
    """Return points of the protocol for one arm."""
    rng = np.random.default_rng(1)
    (positions,) = box_points(
        [arm], np.zeros(18), n=n, near=rng.normal(0.0, VERTEX_SD, (n, 3))
    )
    return explored_places(
        arm,
        np.zeros(18),
        positions,
        rng=rng,
        girdle_rest=np.zeros(2),
        girdle_follow=0.0,
    )


# --- the person -----------------------------------------------------------------------


def test_the_same_seed_gives_the_same_person_and_recordings(run: Protocol) -> None:
    again = simulate_protocol(virtual_subject(4), seed=40, **SHORT)
    for one, two in zip(run.trials, again.trials, strict=True):
        np.testing.assert_array_equal(one.truth.q, two.truth.q)
        np.testing.assert_array_equal(one.recording.markers, two.recording.markers)


def test_another_seed_gives_another_person() -> None:
    lengths = [virtual_subject(s).skeleton.segment_lengths for s in (1, 2)]
    assert all(lengths[0][name] != lengths[1][name] for name in lengths[0])


def test_another_seed_gives_another_motion(run: Protocol) -> None:
    other = simulate_protocol(run.subject, seed=41, **SHORT)
    assert not np.array_equal(other.static.truth.q, run.static.truth.q)


def test_markers_sit_off_their_nominal_places_by_the_stated_error() -> None:
    bony, technical = [], []
    for seed in range(15):
        person = virtual_subject(seed, palpation_sd=2e-3, technical_sd=10e-3)
        bare = virtual_subject(seed, palpation_sd=0.0, technical_sd=0.0)
        off = person.skeleton.marker_positions - bare.skeleton.marker_positions
        for marker, error in zip(bare.skeleton.marker_set.markers, off, strict=True):
            (technical if marker.label[1:] in TECHNICAL else bony).append(error)
    # 15 x 16 x 3 and 15 x 8 x 3 values: the standard error of a standard deviation is
    # sd / sqrt(2 n), 2.6 % and 3.7 %; four of them.
    assert np.std(bony) == pytest.approx(2e-3, rel=0.11)
    assert np.std(technical) == pytest.approx(10e-3, rel=0.15)


TECHNICAL = {"UPA", "UPB", "UPC", "FRM"}


# --- the truth ------------------------------------------------------------------------


def test_the_hand_really_holds_still_while_the_elbow_swivels(run: Protocol) -> None:
    position, rotation = hand(run)
    speed = run.points.truth.hand_speed("right_arm")
    for k in range(len(run.places)):
        rows = run.points.point == k
        assert speed[rows].max() < 0.05
        # Five standard deviations of the drift (4 mm, 1.2 deg) on every axis.
        assert np.abs(position[rows] - run.places[k]).max() < 5 * 4e-3
        middle = Rotation.from_matrix(rotation[rows]).mean()
        tilt = (Rotation.from_matrix(rotation[rows]) * middle.inv()).as_rotvec()
        assert np.abs(tilt).max() < 5 * np.radians(1.2)
        assert np.ptp(run.points.swivel[rows]) > np.radians(40)


def test_without_drift_the_hand_does_not_move_at_all(steady: Protocol) -> None:
    position, rotation = hand(steady)
    for k in range(len(steady.places)):
        rows = steady.points.point == k
        # Newton stops at 1e-7 m and rad.
        assert np.abs(position[rows] - steady.places[k]).max() < 2e-7
        assert np.abs(rotation[rows] - rotation[rows][0]).max() < 4e-7
        assert np.ptp(steady.points.swivel[rows]) > np.radians(40)


def test_a_still_hand_leaves_the_elbow_angle_alone(steady: Protocol) -> None:
    flexion = steady.points.truth.chain_angles("left_arm")[:, 3]
    for k in range(len(steady.places)):
        # The distance from shoulder to wrist is fixed, so flexion is; pose errors of
        # 1e-7 times at most 10 rad/m near extension.
        assert np.ptp(flexion[steady.points.point == k]) < 2e-6


def test_drift_moves_the_elbow_angle_no_more_than_the_wrist(run: Protocol) -> None:
    skeleton, truth = run.subject.skeleton, run.points.truth
    lengths = skeleton.segment_lengths
    a, b = lengths["right_upper_arm"], lengths["right_forearm"]
    flexion = truth.chain_angles("right_arm")[:, 3]
    for k in range(len(run.places)):
        rows = np.flatnonzero(run.points.point == k)
        # The wrist moves with the knuckles and with the tilt of the hand: at most 5
        # standard deviations to either side. By the law of cosines the distance d from
        # the shoulder changes by a b sin(flexion) / d per rad.
        wander = 2 * 5 * np.hypot(4e-3, np.radians(1.2) * lengths["right_hand"])
        slope = a * b * np.sin(flexion[rows]).min() / (a + b)
        assert np.ptp(flexion[rows]) < wander / slope
        assert np.ptp(flexion[rows]) > np.radians(0.5)


def test_at_a_point_the_joints_move_along_the_null_space(steady: Protocol) -> None:
    skeleton, truth = steady.subject.skeleton, steady.points.truth
    speed = truth.chain_velocities("left_arm")
    inside = steady.points.point == np.roll(steady.points.point, 3)
    inside &= steady.points.point == np.roll(steady.points.point, -3)
    inside &= (steady.points.point >= 0) & (np.linalg.norm(speed, axis=1) > 0.3)
    rows = np.flatnonzero(inside)[::7]
    assert len(rows) > 30
    for i in rows:
        null = null_space(skeleton.chain_jacobian(truth.q[i], "left_arm"))[0]
        across = speed[i] - null * (null @ speed[i])
        # Central differences over 10 ms miss by h^2 / 6 times the third derivative,
        # here (2 pi 0.6 Hz)^2 and the curvature of the path: below 0.1 %.
        assert np.linalg.norm(across) < 2e-3 * np.linalg.norm(speed[i])


def test_differences_of_the_truth_agree_with_the_jacobian(run: Protocol) -> None:
    skeleton, truth = run.subject.skeleton, run.free.truth
    for i in range(10, len(truth.time) - 10, 25):
        J = skeleton.chain_jacobian(truth.q[i], "right_arm_clavicle", task="position")
        predicted = J @ truth.chain_velocities("right_arm_clavicle")[i]
        # Both are central differences over 10 ms; they differ by h^2 / 6 times the
        # third derivative of what bends between them: reaches of 3 rad/s make 1 mm/s.
        error = predicted - truth.hand_velocity_in_thorax[i, 0]
        assert np.abs(error).max() < 1e-3


def test_joints_stay_within_their_limits(run: Protocol, steady: Protocol) -> None:
    for protocol in (run, steady):
        skeleton = protocol.subject.skeleton
        for trial in protocol.trials:
            assert (trial.truth.angles >= skeleton.lower).all()
            assert (trial.truth.angles <= skeleton.upper).all()


def test_motion_has_no_jumps(run: Protocol) -> None:
    for trial in run.trials:
        # Tremor moves a joint by about 0.1 deg per frame, reaches by 2.
        assert np.abs(np.diff(trial.truth.q[:, 3:], axis=0)).max() < np.radians(4)


def test_trunk_and_resting_arm_are_nearly_still(run: Protocol) -> None:
    truth = run.points.truth
    # Sway of 2 mm and joints of 0.3 deg: five standard deviations.
    assert np.abs(truth.q[:, :3] - truth.q[:, :3].mean(axis=0)).max() < 5 * 2e-3
    left = truth.chain_angles("left_arm_clavicle")
    assert np.abs(left - left.mean(axis=0)).max() < 2 * 5 * np.radians(0.3)


def test_swivel_agrees_with_the_skeleton(run: Protocol) -> None:
    for q, swivel in zip(run.free.truth.q[::50], run.free.swivel[::50], strict=True):
        other = run.subject.skeleton.swivel(q)[0]
        assert other == pytest.approx(swivel, abs=1e-9)


def test_lifting_the_elbow_outwards_is_positive_swivel() -> None:
    skeleton = virtual_subject(1).skeleton
    for side in SIDES:
        arm = ArmKinematics(skeleton, side)
        posture = np.array([0, 0, 0.0, 0.6, 0, 1.4, 0, 0, 0])
        lifted = posture + [0, 0, 0.5, 0, 0, 0, 0, 0, 0]
        low, high = (arm.swivel(arm.put(np.zeros(18), p)) for p in (posture, lifted))
        assert high > low + 0.3


# --- the places -----------------------------------------------------------------------


@pytest.mark.parametrize("side", SIDES)
def test_points_stand_near_the_box_and_away_from_full_reach(side: str) -> None:
    skeleton = virtual_subject(8).skeleton
    arm, lengths = ArmKinematics(skeleton, side), skeleton.segment_lengths
    places = box(arm, n=10)
    reach_m = sum(lengths[f"{side}_{s}"] for s in ("upper_arm", "forearm", "hand"))
    outward = np.array([1, 1, 1 if side == "right" else -1])
    relative = np.stack([p.position for p in places]) - arm.shoulder(np.zeros(18))
    relative *= outward / reach_m
    share = (relative - BOX_LOW) / (BOX_HIGH - BOX_LOW)
    # 12 mm per axis at a vertex, four standard deviations, of a box of at least 0.15 m.
    assert np.abs(share[:8] - share[:8].round()).max() < 4 * 0.012 / 0.15
    assert len({tuple(row) for row in share[:8].round()}) == 8
    assert np.abs(share[8:] - [[0.5, 1, 0.5], [0.5, 0, 0.5]]).max() < 4 * 0.012 / 0.15
    for place in places:
        assert np.radians(45) < place.posture[5] < np.radians(140)
        assert np.ptp(place.motion.swivel) >= np.radians(40)
        assert (np.diff(place.motion.swivel) > 0).all()


def test_two_arms_hold_an_object_while_each_elbow_moves_by_itself() -> None:
    run = simulate_protocol(
        virtual_subject(6),
        seed=6,
        side="both",
        n_points=2,
        static_seconds=0.1,
        free_seconds=0.1,
        unsteadiness=STEADY,
        quick=True,
        **CLEAN,
    )
    skeleton, trial = run.subject.skeleton, run.points
    for k in range(2):
        rows = np.flatnonzero(trial.point == k)
        hands = trial.truth.hand_in_thorax[rows]
        assert np.abs(hands.mean(axis=1) - run.places[k]).max() < 2e-7
        assert np.linalg.norm(hands[:, 0] - hands[:, 1], axis=1) == pytest.approx(
            0.3, abs=1e-6
        )
        assert (np.ptp(trial.swivel[rows], axis=0) > np.radians(40)).all()
        # Two sines of different frequency: neither tells the other.
        assert abs(np.corrcoef(trial.swivel[rows].T)[0, 1]) < 0.9
        J = skeleton.chain_jacobian(trial.truth.q[rows[50]], "both_arms")
        speed = trial.truth.chain_velocities("both_arms")[rows[50]]
        # Self-motion of the whole chain; differences over 10 ms are good to 0.2 %.
        assert np.linalg.norm(J @ speed) < 2e-3 * np.linalg.norm(speed)


def test_reaches_are_straight_with_minimum_jerk() -> None:
    arm = ArmKinematics(virtual_subject(2).skeleton, "right")
    start, end = box(arm, n=2)
    plan = reach(start, end, n=90)
    way = end.position - start.position
    along = (plan.position - start.position) @ way / (way @ way)
    np.testing.assert_allclose(
        plan.position, start.position + along[:, None] * way, atol=1e-12
    )
    np.testing.assert_allclose(along, minimum_jerk(len(along)), atol=1e-12)
    np.testing.assert_allclose(plan.rotation[-1], end.rotation, atol=1e-12)


def test_exploring_uses_the_range_from_rest_to_rest() -> None:
    arm = ArmKinematics(virtual_subject(2).skeleton, "right")
    (place,) = box(arm, n=1)
    plan = explore(
        place, seconds=5.0, rate=100.0, rng=np.random.default_rng(3), index=7
    )
    swivel = np.array([arm.swivel(arm.put(np.zeros(18), p)) for p in plan.postures])
    # The amplitude is at least 70 % of the range.
    assert np.ptp(swivel) > 0.7 * np.ptp(place.motion.swivel)
    assert swivel.min() > place.motion.swivel[0] - 1e-6
    assert swivel.max() < place.motion.swivel[-1] + 1e-6
    assert swivel[[0, -1]] == pytest.approx(place.swivel, abs=1e-3)
    assert (plan.point == 7).all()


# --- cameras and skin -----------------------------------------------------------------


def test_clean_markers_are_those_of_the_true_body(steady: Protocol) -> None:
    labels = steady.subject.skeleton.marker_set.labels
    for trial in steady.trials:
        columns = [labels.index(label) for label in trial.recording.labels]
        for i in range(0, len(trial.truth.q), 40):
            seen = steady.subject.skeleton.markers_in_world(trial.truth.q[i])
            np.testing.assert_array_equal(trial.recording.markers[i], seen[columns])


def test_noise_has_the_stated_size_and_no_mean(run: Protocol) -> None:
    skeleton, trial = run.subject.skeleton, run.points
    worn = skeleton.marker_set.labels
    columns = [worn.index(label) for label in trial.recording.labels]
    true = np.stack([skeleton.markers_in_world(q)[columns] for q in trial.truth.q])
    noise = (trial.recording.markers - true)[np.isfinite(trial.recording.markers)]
    # About 70 000 values: the standard error is 0.27 % of 1 mm for the deviation and
    # 4 um for the mean; five of them.
    assert noise.std() == pytest.approx(1e-3, rel=0.014)
    assert abs(noise.mean()) < 2e-5


def test_motion_does_not_depend_on_the_artifacts(run: Protocol) -> None:
    other = simulate_protocol(run.subject, seed=40, soft_tissue=6e-3, **SHORT)
    for one, two in zip(run.trials, other.trials, strict=True):
        np.testing.assert_array_equal(one.truth.q, two.truth.q)
        gaps = [np.isnan(t.recording.markers).any(axis=2) for t in (one, two)]
        np.testing.assert_array_equal(*gaps)
    moved = other.points.recording.markers - run.points.recording.markers
    length = np.linalg.norm(moved[np.isfinite(moved).all(axis=2)], axis=1)
    # The random quarter of the variance is drawn anew: 16 s of it at 0.3 Hz are some
    # ten independent values for each of 22 markers, so its variance is good to 10 %.
    assert np.sqrt(np.mean(length**2)) == pytest.approx(6e-3, rel=0.1)


def test_skin_moves_smoothly_and_with_its_segment(run: Protocol) -> None:
    rng = np.random.default_rng(0)
    skeleton, q = run.subject.skeleton, run.points.truth.q
    skin = SoftTissue(
        skeleton, 6e-3, reference=np.zeros(18), angles=q[:, -18:], rng=rng
    )
    moved = skin.displacement(q, rate=100.0, rng=rng)
    # Posture changes within a second or so; 6 mm RMS then takes steps below 1 mm.
    assert np.linalg.norm(np.diff(moved, axis=0), axis=2).max() < 2e-3
    at = np.flatnonzero(skin.links == "right_upper_arm")
    kept, whole = 0.0, 0.0
    for row, shift in zip(q[::20], moved[::20], strict=True):
        places = skeleton.markers_in_world(row)[at]
        rotation, origin = rigid_transform(places, places + shift[at])
        rest = places + shift[at] - (places @ rotation.T + origin)
        kept, whole = kept + np.sum(rest**2), whole + np.sum(shift[at] ** 2)
    # Half of the variance is a rigid motion of the cluster. Of the rest, spread over
    # the 15 coordinates of 5 markers, a rigid fit takes 6: 0.5 x 9 / 15 = 0.3 is left,
    # and 0.6 would be if nothing moved together.
    assert kept / whole < 0.45


@settings(deadline=None, max_examples=20)
@given(share=st.floats(0.0, 0.3), seed=st.integers(0, 1000))
def test_occlusions_hide_the_stated_share(share: float, seed: int) -> None:
    links = np.array(["a"] * 4 + ["b"] * 3 + ["c"])
    hidden = occlusions(
        np.random.default_rng(seed), 1000, links, share=share, rate=100.0
    )
    # The last burst hides at most 30 frames of three markers.
    assert share <= hidden.mean() <= share + 90 / hidden.size


def test_occlusions_come_in_bursts() -> None:
    links = np.array([f"link {i}" for i in range(20)])
    hidden = occlusions(np.random.default_rng(1), 5000, links, share=0.03, rate=100.0)
    edges = np.diff(hidden.astype(int), axis=0)
    starts, ends = np.count_nonzero(edges == 1), np.count_nonzero(edges == -1)
    # Mean 12 frames, shortened by the cut at 30 and lengthened where bursts meet.
    assert 9 < hidden.sum() / max(starts, ends) < 15


def test_static_only_markers_are_worn_in_the_static_trial_only(run: Protocol) -> None:
    assert {"RMEP", "LMEP"} <= set(run.static.recording.labels)
    assert set(run.static.recording.labels) - set(run.free.recording.labels) == {
        "RMEP",
        "LMEP",
    }
    assert run.free.recording.labels == run.points.recording.labels


# --- random processes -----------------------------------------------------------------


def test_drift_has_the_stated_size_and_speed() -> None:
    rate, cutoff = 100.0, 0.3
    x = wander(np.random.default_rng(0), 200_000, 3, sd=2.0, cutoff=cutoff, rate=rate)
    # 2000 s hold about 2000 x 0.3 x 2 independent values per channel: 1.2 % for 3 of
    # them, and the speed of a second-order Butterworth is 2 pi cutoff sd.
    assert x.std() == pytest.approx(2.0, rel=0.06)
    speed = np.diff(x, axis=0).std() * rate
    assert speed == pytest.approx(2 * np.pi * cutoff * 2.0, rel=0.06)


def test_a_rate_that_cannot_show_tremor_is_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInput, match="above 24 Hz"):
        tremor(rng, 10, 1, sd=1.0, rate=24.0)
    assert tremor(rng, 10, 1, sd=1.0, rate=24.1).shape == (10, 1)


def test_tremor_is_between_8_and_12_hz() -> None:
    x = tremor(np.random.default_rng(0), 20_000, 1, sd=1.0, rate=100.0)[:, 0]
    power = np.abs(np.fft.rfft(x)) ** 2
    hertz = np.fft.rfftfreq(len(x), 0.01)
    band = (hertz > 7) & (hertz < 13)
    assert power[band].sum() > 0.9 * power.sum()
    assert x.std() == pytest.approx(1.0, rel=0.05)


@given(n=st.integers(2, 300))
def test_minimum_jerk_goes_from_rest_to_rest(n: int) -> None:
    s = np.concatenate([[0.0], minimum_jerk(n)])
    assert s[-1] == pytest.approx(1.0, abs=1e-12)
    assert (np.diff(s) >= -1e-15).all()
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-12)


# --- files and errors -----------------------------------------------------------------


def test_written_files_read_back(run: Protocol, tmp_path: Path) -> None:
    paths = write_protocol(tmp_path / "person", run)
    assert [p.name for p in paths] == ["static.c3d", "free.c3d", "points.c3d"]
    for path, trial in zip(paths, run.trials, strict=True):
        again = read(path)
        assert again.labels == trial.recording.labels
        # Single precision of millimeters: 2000 mm x 6e-8, twice.
        np.testing.assert_allclose(
            again.markers, trial.recording.markers, atol=3e-7, rtol=0
        )
        np.testing.assert_allclose(again.time, trial.recording.time, atol=1e-9)
        table = np.genfromtxt(
            path.with_name(f"{trial.name}_truth.csv"), delimiter=",", names=True
        )
        np.testing.assert_allclose(
            table["right_swivel_deg"], np.degrees(trial.swivel), atol=1e-5
        )
        np.testing.assert_array_equal(table["point"], trial.point)
        elbow = trial.truth.chain_angles("right_arm")[:, 3]
        np.testing.assert_allclose(
            table["right_elbow_flexion_deg"], np.degrees(elbow), atol=1e-5
        )
    truth = json.loads((tmp_path / "person" / "truth.json").read_text())
    assert truth["simulated"] is True
    assert truth["segment_lengths_m"] == run.subject.skeleton.segment_lengths
    assert truth["settings"]["soft_tissue"] == 0.0


def test_existing_files_are_not_replaced(run: Protocol, tmp_path: Path) -> None:
    (tmp_path / "points_truth.csv").write_text("mine")
    with pytest.raises(FileError, match="points_truth.csv"):
        write_protocol(tmp_path, run)
    assert [p.name for p in tmp_path.iterdir()] == ["points_truth.csv"]
    write_protocol(tmp_path, run, force=True)
    assert (tmp_path / "points_truth.csv").read_text().startswith("time_s,")


@pytest.mark.parametrize(
    "wrong",
    [{"side": "up"}, {"n_points": 0}, {"n_points": 11}, {"occluded": 0.9}],
    ids=str,
)
def test_wrong_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InvalidInput):
        simulate_protocol(virtual_subject(1), seed=1, **(SHORT | wrong))


def test_a_hand_out_of_reach_is_refused() -> None:
    arm = ArmKinematics(virtual_subject(1).skeleton, "right")
    with pytest.raises(InvalidInput, match="cannot be brought"):
        arm.to_pose(np.full(18, 0.1), np.array([3.0, 0.0, 0.0]), np.eye(3))


def test_the_simulation_never_looks_at_a_learned_direction() -> None:
    for path in Path(simulation.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert "nullspace_map" not in str(node.module), path.name


def test_a_steadier_person_is_not_another_person(run: Protocol) -> None:
    calm = replace(Unsteadiness(), drift=1e-3)
    other = simulate_protocol(run.subject, seed=40, unsteadiness=calm, **SHORT)
    np.testing.assert_array_equal(other.places, run.places)
