"""What a frame shows, and that nothing else leaves as a number."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st

import ikns
from ikns.body.chains import chain_joints
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.errors import MarkerMismatch, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.marker_ik.visibility import visible_segments
from ikns.motion.motion import Motion
from ikns.nullspace.map import MapWarning, still_mask
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject


def hide(recording: Recording, rows: np.ndarray, labels: list[str]) -> Recording:
    """Hide markers in some frames."""
    markers = recording.markers.copy()
    columns = [recording.labels.index(label) for label in labels]
    markers[np.ix_(rows, columns)] = np.nan
    return Recording(recording.time, markers, recording.labels, "hidden.c3d")


def of_arm(recording: Recording, side: str) -> list[str]:
    return [label for label in recording.labels if label[0] == side[0].upper()]


def short() -> tuple[Skeleton, Recording]:
    """A scaled body and 100 frames that miss nothing."""
    run = small_person.protocol()
    skeleton = small_person.subject().skeleton
    q = run.points.truth.q[:100]
    markers = np.stack([skeleton.markers_in_world(row) for row in q])
    time = run.points.recording.time[:100]
    return skeleton, Recording(time, markers, skeleton.marker_set.labels, "short")


def test_a_limb_is_in_sight_with_one_marker_and_the_thorax_with_three() -> None:
    skeleton, recording = short()
    for frame, gone in enumerate(
        (
            [],
            ["C7"],
            ["C7", "T10"],
            ["RWRA", "RWRB"],
            ["RWRA", "RWRB", "RFRM"],
        )
    ):
        recording = hide(recording, np.array([frame]), gone)
    motion = MarkerIK(skeleton).track(recording)
    seen = dict(zip(motion.segments, motion.seen[:5].T.tolist(), strict=True))
    assert seen["thorax"] == [True, True, False, True, True]
    assert seen["right_forearm"] == [True, True, True, True, False]
    assert motion.in_sight("right_arm")[:5].tolist() == [True, True, False, True, False]
    assert motion.in_sight("left_arm")[:5].tolist() == [True, True, False, True, True]


@pytest.mark.parametrize("worn", ["oxford24", "plug_in_gait", "ue_adl"])
@settings(max_examples=60)
@given(
    seed=st.integers(0, 10**6),
    share=st.sampled_from([0.2, 0.5, 0.8]),
)
def test_the_seen_markers_fix_every_joint_that_counts_as_known(
    worn: str, seed: int, share: float
) -> None:
    # Independent of the rule: a joint that the null space of the seen markers' Jacobian
    # moves could be anywhere.
    skeleton = Skeleton.load(marker_set=worn)
    rng = np.random.default_rng(seed)
    q = skeleton.neutral()
    q[7:] = rng.uniform(skeleton.lower, skeleton.upper)
    positions, jacobian = skeleton.marker_jacobian(q)
    seen = rng.random(len(positions)) < share
    markers = np.where(seen[:, None], positions, np.nan)
    known = visible_segments(skeleton, markers[None]).known[0]
    tracked = [not marker.static_only for marker in skeleton.marker_set.markers]
    free = np.setdiff1d(np.arange(24), skeleton.columns(skeleton.marker_set.held))
    worn_markers = skeleton.marker_set.markers
    turning = np.array([marker.free_turn for marker in worn_markers])
    turns = []
    for side in ("right", "left"):
        # A cluster with a free turn moves by an unknown of its own, as by its joint,
        # and not by the joint.
        column = 6 + skeleton.joint_names.index(f"{side}_forearm_pronation")
        own = turning & [m.link.startswith(side) for m in worn_markers]
        turns.append(np.where(own[:, None], jacobian[..., column], 0.0))
        jacobian[own, :, column] = 0.0
    jacobian = np.concatenate([jacobian, np.stack(turns, axis=2)], axis=2)
    free = np.r_[free, 24, 25]
    rows = jacobian[seen & tracked][..., free].reshape(-1, len(free))
    _, values, basis = np.linalg.svd(rows)
    # Marker levers are 0.02 m and more; rounding leaves 1e-16 m.
    null = basis[np.count_nonzero(values > 1e-6) :]
    moved = np.zeros(26)
    moved[free] = np.linalg.norm(null, axis=0)
    assert (moved[6:24][known] < 1e-6).all()


def test_joints_next_to_a_hidden_segment_are_unknown_and_others_are_not() -> None:
    skeleton, recording = short()
    hidden = {
        "RFIN": ["wrist"],
        "RWRA RWRB RFRM": ["elbow", "forearm", "wrist"],
        "RSHO": ["clavicle", "shoulder"],
        "C7 T10": ["clavicle", "shoulder"],
    }
    for labels, parts in hidden.items():
        part = hide(recording, np.arange(40, 60), labels.split())
        motion = MarkerIK(skeleton).track(part)
        unknown = np.flatnonzero(np.isnan(motion.angles[50]))
        sides = ("right", "left") if "C7" in labels else ("right",)
        expected = [
            name
            for name in skeleton.joint_names
            if name.startswith(sides) and name.split("_")[1] in parts
        ]
        assert [skeleton.joint_names[joint] for joint in unknown] == expected
        assert np.isnan(motion.chain_angles("right_arm")[40:60]).all()
        assert np.isnan(motion.thorax_in_world[50]).all() == ("C7" in labels)


intervals = st.lists(
    st.tuples(st.integers(0, 99), st.integers(1, 40)), min_size=1, max_size=4
)


@settings(max_examples=25)
@given(gaps=intervals, side=st.sampled_from(["right", "left"]))
def test_a_hidden_arm_is_never_still_and_leaves_no_number(
    gaps: list[tuple[int, int]], side: str
) -> None:
    skeleton, recording = short()
    rows = np.zeros(100, dtype=bool)
    for first, length in gaps:
        rows[first : first + length] = True
    whole = MarkerIK(skeleton).track(recording)
    hidden = hide(recording, np.flatnonzero(rows), of_arm(recording, side))
    motion = MarkerIK(skeleton).track(hidden)
    chain, other = f"{side}_arm", "left_arm" if side == "right" else "right_arm"
    own = [name.startswith(side) for name in motion.joint_names]
    hand = ("right", "left").index(side)
    assert not still_mask(motion, chain, max_hand_speed=np.inf)[rows].any()
    for left in (
        motion.angles[:, own],
        motion.v[:, 6:][:, own],
        motion.hand_in_thorax[:, hand],
        motion.hand_rotation_in_thorax[:, hand],
        motion.hand_velocity_in_thorax[:, hand],
        motion.chain_angles(chain),
        motion.chain_velocities(chain),
        motion.task_position(chain),
        motion.hand_speed(chain)[:, None],
        motion.task_position("both_arms"),
    ):
        assert np.isnan(left[rows]).all()
    assert np.isfinite(motion.q).all()
    np.testing.assert_array_equal(motion.in_sight(chain), ~rows)
    # The other arm stays known in every frame, and leaves as the solver found it.
    np.testing.assert_array_equal(motion.known[:, ~np.array(own)], True)
    columns = [7 + motion.joint_names.index(name) for name in chain_joints(other)]
    np.testing.assert_array_equal(motion.chain_angles(other), motion.q[:, columns])
    # What is left without noise: a hidden arm that returns a radian from where it was
    # pulls with PRIOR^2 = 4e-4 m^2 at the thorax, which four markers hold at 0.1 m:
    # 4e-4 / (4 * 0.1^2) = 0.01 rad.
    angles = whole.chain_angles(other)
    np.testing.assert_allclose(motion.chain_angles(other), angles, atol=0.01, rtol=0)
    assert np.isfinite(motion.hand_speed(other)).all()


def test_speed_next_to_a_gap_is_that_of_what_was_seen() -> None:
    # A hand that goes on at the same speed while hidden: where it was left would make
    # it slow before the gap, and the jump afterwards fast.
    skeleton, recording = short()
    q = np.tile(small_person.protocol().points.truth.q[:1], (100, 1))
    elbow = 7 + skeleton.joint_names.index("right_elbow_flexion")
    q[:, elbow] += 0.5 * (recording.time - recording.time[50])
    markers = np.stack([skeleton.markers_in_world(row) for row in q])
    turning = Recording(recording.time, markers, recording.labels, "turning")
    hidden = hide(turning, np.arange(40, 70), of_arm(recording, "right"))
    motion = MarkerIK(skeleton).track(hidden)
    rate = motion.chain_velocities("right_arm")[:, 3]
    known = np.isfinite(rate)
    # 50 Hz: one sample of each side of a window of 11 is too uncertain.
    assert known[:39].all()
    assert known[72:].all()
    assert not known[40:70].any()
    # The solver's lag behind the jump fades within a frame or two, see PRIOR.
    np.testing.assert_allclose(rate[:39], 0.5, atol=5e-3)
    np.testing.assert_allclose(rate[75:], 0.5, atol=2e-2)


def test_nine_hidden_reaches_teach_nothing() -> None:
    run = simulate_protocol(virtual_subject(1), seed=1)
    points, at = run.points.recording, run.points.point
    leaves = np.flatnonzero((at[:-1] >= 0) & (at[1:] != at[:-1]))[:9]
    rows = np.zeros(len(at), dtype=bool)
    for leave in leaves:
        rows[leave - 25 : leave + 75] = True
    assert rows.sum() == 900
    hidden = hide(points, np.flatnonzero(rows), of_arm(points, "right"))
    skeleton, _ = ikns.scale(ikns.Skeleton.load(), run.static.recording)
    # As in the README.
    motion = ikns.MarkerIK(skeleton).track(hidden)
    x, q = ikns.null_space_samples(motion, chain="right_arm", max_hand_speed=0.05)
    learned = _learn(x, q)
    # The same frames cut out of a recording that hides nothing.
    whole = ikns.MarkerIK(skeleton).track(points)
    kept = still_mask(whole) & ~rows
    cut = _learn(
        whole.task_position("right_arm")[kept], whole.chain_angles("right_arm")[kept]
    )
    near = [
        int(np.argmin(np.linalg.norm(learned.centers_ - center, axis=1)))
        for center in cut.centers_
    ]
    assert sorted(near) == list(range(10))
    cosines = np.abs(
        np.sum(learned.directions_[near, 0] * cut.directions_[:, 0], axis=1)
    )
    # Of some 400 samples of a point the two next to its gap have no speed, and the
    # solver needs some more to catch up: 1 % of the variance, which turns the largest
    # axis by less than 1 % rad, 0.6 deg. Counted as seen it was 2 to 6 deg.
    assert len(x) > 0.98 * kept.sum()
    assert np.degrees(np.arccos(np.minimum(cosines, 1.0))).max() < 0.6
    width, true = learned.upper_ - learned.lower_, cut.upper_ - cut.lower_
    # The ends are quantiles, which 1 % of the samples moves by 1 % of the range.
    np.testing.assert_allclose(width[near], true, rtol=0.01)


def _learn(x: np.ndarray, q: np.ndarray) -> ikns.NullSpaceMap:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        return ikns.NullSpaceMap(n_points=10).fit(x, q)


def test_a_recording_of_one_arm_is_tracked_and_the_other_is_never_known() -> None:
    skeleton, recording = short()
    left = of_arm(recording, "left")
    one = recording.select([name for name in recording.labels if name not in left])
    motion = MarkerIK(skeleton).track(one)
    assert motion.in_sight("right_arm").all()
    assert not motion.in_sight("left_arm").any()
    assert np.isnan(motion.chain_angles("left_arm_clavicle")).all()
    with pytest.raises(NotEnoughData, match="left_clavicle is never visible"):
        ikns.null_space_samples(motion, chain="left_arm")


def test_a_chain_that_was_asked_for_must_be_shown() -> None:
    skeleton, recording = short()
    lost = hide(recording, np.arange(100), ["RFIN"])
    with pytest.raises(
        MarkerMismatch,
        match=r"^hidden.c3d: the segment right_hand is never visible; expected at "
        r"least 1 of RFIN of oxford24 in a frame\.$",
    ):
        MarkerIK(skeleton).track(lost, chain="right_arm")
    assert MarkerIK(skeleton).track(lost, chain="left_arm").in_sight("left_arm").all()
    one = small_person.cut(recording, 0, 1)
    with pytest.raises(NotEnoughData, match=r"^short: expected at least 2 frames"):
        MarkerIK(skeleton).track(one, chain="right_arm")
    assert np.isnan(MarkerIK(skeleton).track(one).hand_speed("right_arm")).all()


def test_a_marker_that_weighs_nothing_shows_nothing() -> None:
    skeleton, recording = short()
    markers = tuple(
        replace(marker, static_only=marker.label == "RFIN")
        for marker in skeleton.marker_set.markers
    )
    dressed = skeleton.with_markers(replace(skeleton.marker_set, markers=markers))
    motion = MarkerIK(dressed).track(recording)
    assert not motion.in_sight("right_arm").any()
    wrist = motion.joint_names.index("right_wrist_flexion")
    assert np.isnan(motion.angles[:, wrist]).all()
    with pytest.raises(MarkerMismatch, match="a marker on the segment right_hand"):
        MarkerIK(dressed).track(recording, chain="right_arm")


def test_a_held_joint_leaves_at_its_value_while_its_neighbors_are_seen() -> None:
    skeleton, recording = short()
    wrists = ("right_wrist_flexion", "right_wrist_deviation")
    worn = skeleton.marker_set
    for labels, shown in ((worn.labels, True), (set(worn.labels) - {"RFIN"}, True)):
        held = replace(worn.only(labels), held=wrists)
        dressed = skeleton.with_markers(held)
        motion = MarkerIK(dressed).track(
            hide(recording, np.arange(50, 60), ["RWRA", "RWRB", "RFRM"])
        )
        columns = [motion.joint_names.index(name) for name in wrists]
        assert motion.held == wrists
        assert motion.in_sight("right_arm")[:50].all() == shown
        assert (motion.angles[:50, columns] == 0).all()
        assert np.isnan(motion.angles[50:60, columns]).all()


def test_an_arm_without_markers_is_never_in_sight_even_if_held() -> None:
    skeleton, recording = short()
    worn = skeleton.marker_set
    right = [label for label in worn.labels if not label.startswith("L")]
    left = tuple(name for name in skeleton.joint_names if name.startswith("left"))
    bare = skeleton.with_markers(
        MarkerSet("right only", worn.only(right).markers, held=left)
    )
    motion = MarkerIK(bare).track(recording)
    assert motion.in_sight("right_arm").all()
    assert not motion.in_sight("left_arm").any()
    assert np.isnan(motion.angles[:, [n in left for n in motion.joint_names]]).all()


def test_a_motion_without_a_word_on_it_was_seen_as_a_whole() -> None:
    truth = small_person.protocol().points.truth
    assert truth.in_sight("both_arms").all()
    assert np.isfinite(truth.angles).all()
    fields = {name: getattr(truth, name) for name in Motion.__dataclass_fields__}
    seen = np.ones((len(truth.time), 1), dtype=bool)
    seen[7] = False
    hidden = Motion(**fields | {"segments": ("left_hand",), "seen": seen})
    assert np.flatnonzero(np.isnan(hidden.hand_speed("left_arm"))).tolist() == [7]
    assert np.isfinite(hidden.hand_speed("right_arm")).all()
