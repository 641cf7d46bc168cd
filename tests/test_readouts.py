"""Three methods to read c off a motion: what each follows, and what it leaves alone."""

import dataclasses
import json
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score

from ikns.calibration import calibrate
from ikns.calibration.natural import check_own_arm
from ikns.calibration.readouts import learn_readouts
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput, NotEnoughData
from ikns.live.control.recorded import control_table, jump_sentence
from ikns.motion.motion import Motion
from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.nullspace.map import MapWarning, NullSpaceMap, still_mask
from ikns.nullspace.map.smooth import SmoothField
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import METHODS, IntentMap, Readout, readout_samples
from ikns.nullspace.readout.coordinates import (
    elbow_height_gradient,
    mean_orientation,
    rotation_vector,
)

CORNERS = 0.3 * np.array(list(np.ndindex(2, 2, 2))) + [0.1, -0.3, 0.0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("readouts") / "person"
    small_person.subject().save(made)
    return made


def planted(seed, *, ends=(-0.5, 0.7), own=0.2, n=60):
    """Wrists and swivels of eight places with a known range beyond the posture."""
    rng = np.random.default_rng(seed)
    wrist = np.repeat(CORNERS, n, axis=0) + rng.normal(scale=0.003, size=(8 * n, 3))
    meant = np.tile(np.linspace(*ends, n), 8)
    natural = NaturalPosture.of_people().swivel(wrist) + own
    return wrist, natural + meant, np.repeat(np.arange(8), n)


def turned(motion: Motion, joints: tuple[str, ...], by: float) -> Motion:
    """The same motion with joints of the right forearm and hand elsewhere."""
    q = np.array(motion.q)
    for joint in joints:
        q[:, motion.joint_names.index(joint) - len(motion.joint_names)] += by
    return dataclasses.replace(motion, q=q)


@given(st.integers(0, 50), st.floats(-1.0, 0.0), st.floats(0.1, 1.0))
@settings(max_examples=8, deadline=None)
def test_intent_is_the_planted_share_of_the_range(seed, low, high):
    wrist, swivel, _ = planted(seed, ends=(low, high))
    intent = IntentMap(8).fit(wrist, swivel)
    assert np.allclose(intent.ends_, (low + 0.2, high + 0.2), atol=1e-9)
    assert intent.scatter_.max() < 1e-9
    at = np.array([0.25, -0.1, 0.2])
    meant = np.linspace(low, high, 5) + 0.2
    held = NaturalPosture.of_people().swivel(at) + meant
    c = intent.control_signal(held[:, None], at)
    assert np.allclose(c, np.linspace(0, 1, 5), atol=1e-9)


def test_a_file_keeps_what_is_remembered_and_those_of_before_had_none():
    wrist, swivel, groups = planted(2)
    rng = np.random.default_rng(2)
    moved = rng.uniform(CORNERS.min(axis=0), CORNERS.max(axis=0), (300, 3))
    natural = NaturalPosture.of_people().swivel(moved) + 0.1 * np.sin(20 * moved[:, 0])
    made = IntentMap(8).fit(
        wrist, swivel, groups=groups, natural_X=moved, natural_y=natural
    )
    assert np.abs(made.natural_.heights_).max() > 0.01
    table = Readout("intent", "right_arm", made).table()
    again = Readout.from_table(table).map
    assert np.array_equal(again.natural_.swivel(moved), made.natural_.swivel(moved))
    for name in ("places_m", "heights_rad"):
        del table["natural_posture"][name]
    before = Readout.from_table(table).map.natural_
    smooth = NaturalPosture(local_penalty=None).fit(moved, natural)
    assert np.allclose(before.swivel(moved), smooth.swivel(moved), atol=1e-12)


def test_a_full_turn_is_no_change():
    wrist, swivel, _ = planted(1)
    intent = IntentMap(8).fit(wrist, swivel)
    one, other = (
        intent.control_signal(swivel[:, None] + turn, wrist) for turn in (0, 2 * np.pi)
    )
    assert np.allclose(one, other, atol=1e-9)


def test_a_half_explored_place_is_asked_for_again():
    wrist, swivel, which = planted(2)
    keep = (which != 3) | (np.arange(len(which)) % 60 < 30)
    intent = IntentMap(8).fit(wrist[keep], swivel[keep])
    with pytest.warns(MapWarning, match="turned only part of the way") as told:
        intent.warn_of_scatter([f"point {k}" for k in range(1, 9)])
    assert len(told) == 1
    worst = 1 + int(np.argmin(intent.upper_ - intent.lower_))
    assert f"at point {worst} the elbow" in str(told[0].message)
    assert f"is {intent.scatter_.max():.2f} of the range" in str(told[0].message)
    assert "hold the hand there again" in str(told[0].message)


def test_a_place_of_another_posture_is_no_half_explored_one():
    wrist, swivel, which = planted(2)
    intent = IntentMap(8).fit(wrist, swivel + 0.4 * (which == 3))
    # 0.4 rad of a range of 1.2; one place of eight moves the ends of all by nothing.
    assert np.isclose(intent.scatter_.max(), 0.4 / 1.2, atol=1e-6)
    assert np.allclose(intent.ends_, (-0.3, 0.9), atol=1e-6)
    with pytest.warns(MapWarning, match="than the natural one.*0.33 of.*movement"):
        intent.warn_of_scatter()
    # Several points in one sentence, the worst first.
    intent.scatter_[:] = [0.2, 0.3, 0.15, 0.4, 0.5, 0, 0, 0]
    names = [f"point {k}" for k in range(1, 9)]
    several = r"at point 5, point 4 and point 2 \(and 2 more\) .*0.50, 0.40 and 0.30 of"
    with pytest.warns(MapWarning, match=several):
        intent.warn_of_scatter(names)


@given(st.integers(0, 50), st.floats(0.1, 0.5))
@settings(max_examples=10, deadline=None)
def test_a_half_explored_place_does_not_narrow_the_others(seed, share):
    wrist, swivel, which = planted(seed)
    keep = (which != 3) | (np.arange(len(which)) % 60 < 60 * share)
    intent = IntentMap(8).fit(wrist[keep], swivel[keep])
    # Ends at -0.5 and 0.7 beyond a posture that is 0.2 off.
    assert np.allclose(intent.ends_, (-0.3, 0.9), atol=1e-6)


def test_own_movement_replaces_other_people():
    wrist, swivel, _ = planted(3)
    rng = np.random.default_rng(3)
    going = rng.uniform([0.1, -0.3, 0], [0.4, 0, 0.3], (1000, 3))
    habit = 1.0 - 2.0 * (going[:, 1] + 0.15)  # rises as the hand sinks
    told = IntentMap(8, penalty=1e-6).fit(
        wrist, swivel, natural_X=going, natural_y=habit
    )
    c = told.control_signal(habit[:, None], going)[told.inside(going)]
    assert np.ptp(c) < 1e-3  # ordinary movement means nothing: 1e-6 of penalty is left


def test_a_place_that_does_not_turn_is_refused():
    wrist, _, _ = planted(4)
    with pytest.raises(NotEnoughData, match="at which the elbow turns, found none"):
        IntentMap(8).fit(wrist, NaturalPosture.of_people().swivel(wrist))


def test_scores_let_scikit_learn_choose():
    wrist, swivel, which = planted(5)
    rng = np.random.default_rng(5)
    swivel = swivel + rng.normal(scale=0.02, size=len(swivel))
    by_place = GroupKFold(4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        search = GridSearchCV(
            IntentMap(6), {"quantiles": [(0.0, 1.0), (0.05, 0.95)]}, cv=by_place
        ).fit(wrist, swivel, groups=which)
        q = swivel[:, None] * [0.6, 0.8] + rng.normal(scale=0.05, size=(len(swivel), 2))
        score = cross_val_score(NullSpaceMap(8), wrist, q, cv=5, error_score="raise")
    assert 0.8 < search.best_score_ <= 1.0
    # The share of Z: 0.35 rad of range against 0.05 of noise across it.
    assert (score > 0.9).all()


def test_every_method_follows_the_elbow_of_a_simulated_person():
    subject, motion = small_person.subject(), small_person.subject().motions[0]
    true = small_person.protocol().points.swivel
    still = still_mask(motion, subject.chain)
    labels = np.full(len(still), -1)
    labels[still] = subject.null_space_map.labels_
    for method in METHODS:
        c = subject.readout(method).control_signal(subject.skeleton, motion)
        for k in range(10):
            own = (labels == k) & np.isfinite(c) & np.isfinite(true)
            # 1 mm of noise and 4 mm of drift leave more than this of the motion.
            assert np.corrcoef(c[own], true[own])[0, 1] > 0.9, (method, k)


def test_a_turned_hand_moves_the_paper_s_c_most():
    subject, motion = small_person.subject(), small_person.subject().motions[0]
    joints = ("right_forearm_pronation",)
    moved = turned(motion, joints, np.radians(20.0))
    change = {
        method: np.nanmedian(
            np.abs(
                subject.readout(method).control_signal(subject.skeleton, moved)
                - subject.readout(method).control_signal(subject.skeleton, motion)
            )
        )
        for method in METHODS
    }
    assert change["paper"] > 0.1
    assert change["proximal"] == 0.0
    # As much as the natural posture follows the hand's direction, which turns by no
    # more than the hand: the whole motion is turned, so the hand was led turned.
    readout = subject.readout("intent")
    follows = np.linalg.norm(readout.map.natural_.coefficients_[10:])
    a, b = readout.map.ends_
    assert 0 < change["intent"] <= follows * np.radians(20.0) / (b - a)
    x, y = readout.samples(subject.skeleton, motion)
    x, y = (np.repeat(rows[[300]], 50, axis=0) for rows in (x, y))
    x[25:, 3:] *= -1  # as far as a hand can turn, where it is
    assert np.ptp(readout.map.control_signal(y, readout.led(x))) == 0


def test_a_map_of_before_reads_the_wrist_alone():
    subject, motion = small_person.subject(), small_person.subject().motions[0]
    table = subject.readout("intent").table()
    for name in ("coefficients_rad", "people_rad"):
        table["natural_posture"][name] = table["natural_posture"][name][:10]
    before = Readout.from_table(table)
    moved = turned(motion, ("right_wrist_flexion",), np.radians(20.0))
    one, other = (before.control_signal(subject.skeleton, m) for m in (motion, moved))
    np.testing.assert_array_equal(one, other)
    wrist = readout_samples(subject.skeleton, motion, "right_arm", "intent")[0][:, :3]
    known = np.isfinite(wrist).all(axis=1)
    c = before.map.control_signal(
        arm_swivel(subject.skeleton, motion.angles, "right_arm")[1][:, None], wrist
    )
    np.testing.assert_array_equal(c[known], one[known])


def test_a_loaded_subject_reads_the_same_with_every_method(folder):
    made, loaded = small_person.subject(), Subject.load(folder)
    motion = made.motions[0]
    for method in METHODS:
        first, again = (one.readout(method) for one in (made, loaded))
        for name in ("control_signal", "inside"):
            np.testing.assert_array_equal(
                getattr(again, name)(loaded.skeleton, motion),
                getattr(first, name)(made.skeleton, motion),
            )


def test_a_folder_of_before_opens_and_says_what_it_lacks(folder, tmp_path):
    old = tmp_path / "old"
    shutil.copytree(folder, old)
    for method in ("proximal", "intent"):
        (old / f"{method}.json").unlink()
    loaded = Subject.load(old)
    assert loaded.readout("paper").map is loaded.null_space_map
    with pytest.raises(InvalidInput, match="has the method paper only; calibrate"):
        loaded.readout("intent")
    with pytest.raises(InvalidInput, match="expected a method of"):
        loaded.readout("guess")


def test_the_map_of_another_chain_is_refused(folder, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    path = other / "intent.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"chain": "left_arm"}))
    with pytest.raises(ValueError, match=r"intent.json.*of left_arm.*can be deleted"):
        Subject.load(other)


def test_control_writes_what_the_method_reads():
    subject = small_person.subject()
    motion = subject.motions[0]
    for method in METHODS:
        found = control_table(subject, motion, method=method)
        c = subject.readout(method).control_signal(subject.skeleton, motion)
        np.testing.assert_array_equal(found.rows[:, 1], np.clip(c, 0, 1))


def test_jumps_outside_the_volume_are_counted_and_told():
    subject = small_person.subject()
    motion, points = subject.motions[0], subject.null_space_map.centers_
    middle = points.mean(axis=0)
    # Held in the volume, the hand makes no jump; carried from corner to corner far
    # outside in one frame, it changes the nearest point each time.
    hand = np.array(motion.hand_in_thorax)
    hand[...] = middle
    held = dataclasses.replace(motion, hand_in_thorax=hand)
    hand = np.array(hand)
    corners = middle + 3 * (points - middle)
    hand[...] = corners[np.arange(len(hand)) % len(corners), None]
    carried = dataclasses.replace(motion, hand_in_thorax=hand)
    told = {m: control_table(subject, carried, method=m).summary for m in METHODS}
    c = control_table(subject, carried).rows[:, 1]
    far = int((np.abs(np.diff(c)) > 0.1).sum())
    assert told["paper"]["jumps_outside"] == far > 10
    assert control_table(subject, held).summary["jumps_outside"] == 0
    assert told["proximal"]["jumps_outside"] == told["intent"]["jumps_outside"] == 0
    assert f"jumps {far} times by more than 0.1" in jump_sentence("paper", far)
    assert "--outside project, or read c with --method" in jump_sentence("paper", far)
    assert jump_sentence("paper", 0) == ""
    # What `inside` means depends on the method.
    assert [told[m]["inside_means"] for m in METHODS] == [
        "in the volume of the places",
        "in the ellipsoid around the places",
        "where natural movement was taught",
    ]


def test_natural_movement_that_covers_nothing_is_refused():
    run = small_person.protocol()
    still = small_person.cut(run.points.recording, 0, 60)  # one place
    with pytest.raises(NotEnoughData, match="so this is no natural movement"):
        calibrate(run.static.recording, [run.points.recording], natural=[still])


def test_natural_movement_of_the_other_arm_is_refused():
    run = small_person.protocol()
    motion = small_person.subject().motions[0]
    other = dataclasses.replace(
        motion, hand_in_thorax=np.array(motion.hand_in_thorax[:, ::-1])
    )
    with pytest.raises(NotEnoughData, match="of the right_arm, but the right hand"):
        check_own_arm([other], "right_arm")
    check_own_arm([motion], "right_arm")
    # The whole calibration of an arm that rests meanwhile says so too.
    with pytest.raises(NotEnoughData, match="found one.* seems to be the wrong side"):
        calibrate(run.static.recording, [run.points.recording], chain="left_arm")


@pytest.mark.parametrize("n", [2, 10])
def test_only_one_held_place_is_refused(n):
    run = small_person.protocol()
    (rows,) = np.nonzero(run.points.point == 3)
    held = small_person.cut(run.points.recording, rows[0], rows[-1])
    with pytest.raises(NotEnoughData, match=f"expected {n} held places, found one"):
        calibrate(run.static.recording, [held], n_points=n)


def test_a_straight_arm_has_no_intent():
    subject, motion = small_person.subject(), small_person.subject().motions[0]
    q = np.array(motion.q)
    column = motion.joint_names.index("right_elbow_flexion") - len(motion.joint_names)
    q[:, column] = np.radians(8.0)
    straight = dataclasses.replace(motion, q=q)
    gate = still_mask(motion, "right_arm")
    found, report = learn_readouts(
        subject.skeleton, subject.null_space_map, [(straight, gate)], "right_arm"
    )
    assert "intent" not in found
    reason = report["without"]["intent"]
    assert "straight wherever the hand is held, with the elbow at 8 deg" in reason


def test_two_freedoms_leave_the_paper_s_method_alone():
    subject = small_person.subject()
    learned = NullSpaceMap.from_arrays(
        subject.null_space_map.centers_,
        np.repeat(subject.null_space_map.directions_, 2, axis=1),
        np.zeros((10, 2)),
        np.ones((10, 2)),
    )
    found, report = learn_readouts(subject.skeleton, learned, [], subject.chain)
    assert found == {}
    assert set(report["without"]) == {"proximal", "intent"}


def test_proximal_coordinates_turn_by_what_the_arm_turns():
    subject = small_person.subject()
    motion = subject.motions[0]
    start = mean_orientation(subject.skeleton, motion.angles, subject.chain)
    x, y = readout_samples(
        subject.skeleton, motion, subject.chain, "proximal", reference=start
    )
    upper = subject.skeleton.link_in_thorax(motion.angles, "right_upper_arm")[1]
    seen = np.isfinite(y).all(axis=1)
    cosine = (np.einsum("tii->t", start[0].T @ upper) - 1) / 2
    assert np.allclose(np.linalg.norm(y[seen, :3], axis=1), np.arccos(cosine[seen]))
    assert np.isnan(x[~seen]).all()


def test_the_gradient_of_the_elbow_s_height_is_that_of_finite_turns():
    rng = np.random.default_rng(6)
    start = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    start *= np.sign(np.linalg.det(start))
    step = 1e-4 * rng.normal(size=3)
    moved = start @ (np.eye(3) + np.cross(step, np.eye(3)).T)  # exp(step), first order
    rise = -(moved - start)[1, 1]
    gradient = elbow_height_gradient(start[None])
    assert gradient.shape == (1, 4)
    assert np.isclose(gradient[0, :3] @ step, rise, atol=1e-9)  # step squared
    assert np.allclose(rotation_vector(moved[None], start), step, atol=1e-7)


@given(st.integers(0, 100), st.integers(5, 12))
@settings(max_examples=15, deadline=None)
def test_a_smooth_field_is_exact_for_affine_values_and_bounded_far_away(seed, n):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 0.5, (n, 3))
    field = SmoothField(points, edges=np.empty((0, 2), int))
    inside = points.mean(axis=0) + 0.3 * (points - points.mean(axis=0))
    weights = field.weights(inside)
    assert field.inside(inside).all()
    # Systems of 16 with entries of order 1, badly conditioned for points in a plane.
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-8)
    assert np.allclose(weights @ points, inside, atol=1e-6)
    far = field.weights(points.mean(axis=0) + 1e4 * np.eye(3))
    assert not field.inside(points + 1e4).any()
    assert np.allclose(far, 1 / n, atol=1e-2)  # fades with the square of the way
    assert np.isnan(field.weights([np.nan, 0, 0])).all()


def test_a_smooth_field_of_few_points_is_their_mean():
    field = SmoothField(np.eye(3), edges=np.empty((0, 2), int))
    assert np.allclose(field.weights([[0.2, 0.1, 0.9]]), 1 / 3)
    assert not field.inside([[0.3, 0.3, 0.3]]).any()
