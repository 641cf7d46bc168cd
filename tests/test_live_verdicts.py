"""What a live calibration says of a recording before the person leaves."""

from functools import cache

import numpy as np
import pytest
import small_person

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.calibration import Judge, ProtocolStep, Verdict
from ikns.nullspace.map import still_mask
from ikns.recording.recording import Recording
from ikns.simulation import Unsteadiness, simulate_protocol, virtual_subject


def piece(run, k: int) -> Recording:
    """Return the stay at point `k` of simulated points."""
    rows = np.flatnonzero(run.points.point == k)
    return small_person.cut(run.points.recording, rows[0], rows[-1] + 1)


@cache
def unsteady():
    """The same person, the hand wandering at some 0.1 m/s (simulated)."""
    return simulate_protocol(
        virtual_subject(1),
        seed=1,
        n_points=2,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=1.5,
        rate=50,
        unsteadiness=Unsteadiness(drift=15e-3, drift_hz=1.0),
    )


@cache
def judge() -> Judge:
    made = Judge(Skeleton.load())
    static = ProtocolStep("static", "static", 1.2)
    made.accept(static, made.judge(static, small_person.protocol().static.recording))
    return made


def at_point(recording: Recording, name: str = "point_01") -> Verdict:
    return judge().judge(ProtocolStep(name, "point", 1.5), recording)


def test_steady_points_are_kept_and_their_figures_are_those_of_the_calibration():
    subject = small_person.subject()
    (motion,) = subject.motions
    gate = still_mask(motion)
    for k in range(0, 10, 2):
        verdict = at_point(piece(small_person.protocol(), k))
        assert verdict.keep, verdict.reason
        rows = small_person.protocol().points.point == k
        # At the ends of the cut the speed is a one-sided slope over half the window
        # of 0.2 s (5 frames at each end), and tracking starts anew there.
        assert abs(verdict.values["samples"] - (gate & rows).sum()) <= 10
        assert verdict.values["components"] == 1
        assert verdict.place is not None
        # Hand drift of 4 mm per axis and 1 mm of marker noise: the means of two sets
        # of samples of the same stay differ by less than one standard deviation.
        place = motion.task_position("right_arm")[gate & rows].mean(axis=0)
        assert np.linalg.norm(verdict.place - place) < 4e-3 * np.sqrt(3)


def test_an_unsteady_hand_is_recommended_for_redo():
    for k in (0, 1):
        verdict = at_point(piece(unsteady(), k))
        assert not verdict.keep
        assert not verdict.usable
        assert "not steady" in verdict.reason


def test_the_same_place_again_is_reported():
    recording = piece(small_person.protocol(), 3)
    again = Judge(Skeleton.load())
    again.skeleton = judge().skeleton
    step = ProtocolStep("point_01", "point", 1.5)
    again.accept(step, again.judge(step, recording))
    verdict = again.judge(ProtocolStep("point_02", "point", 1.5), recording)
    assert not verdict.keep
    assert verdict.usable
    assert verdict.values["nearest"] == "point_01"
    assert verdict.values["nearest_cm"] == 0


def test_an_elbow_that_rests_is_reported():
    recording = piece(small_person.protocol(), 4)
    seen = np.isfinite(recording.markers).all(axis=(1, 2))
    frozen = np.tile(recording.markers[np.argmax(seen)], (len(recording.time), 1, 1))
    noise = np.random.default_rng(1).normal(0, 5e-4, frozen.shape)
    verdict = at_point(
        Recording(recording.time, frozen + noise, recording.labels, "rest")
    )
    assert not verdict.keep
    assert "elbow hardly moved" in verdict.reason


def test_frozen_markers_are_reported():
    recording = piece(small_person.protocol(), 4)
    seen = np.isfinite(recording.markers).all(axis=(1, 2))
    frozen = np.tile(recording.markers[np.argmax(seen)], (len(recording.time), 1, 1))
    verdict = at_point(Recording(recording.time, frozen, recording.labels, "frozen"))
    assert not verdict.keep
    assert "elbow hardly moved: 0 deg" in verdict.reason


def test_hidden_markers_are_reported():
    recording = piece(small_person.protocol(), 0)
    hand = [i for i, label in enumerate(recording.labels) if label == "RFIN"]
    hidden = recording.markers.copy()
    hidden[:, hand] = np.nan
    verdict = at_point(Recording(recording.time, hidden, recording.labels, "p"))
    assert not verdict.usable
    assert "right_hand" in verdict.reason
    assert not at_point(None).usable  # type: ignore[arg-type]


@pytest.mark.parametrize("names", [("RUPA", "RELB"), ("RUPA", "RFRM")])
def test_markers_with_each_others_names_are_told(names):
    recording = piece(small_person.protocol(), 0)
    first, second = (recording.labels.index(name) for name in names)
    markers = recording.markers.copy()
    markers[:, [first, second]] = markers[:, [second, first]]
    verdict = at_point(Recording(recording.time, markers, recording.labels, "p"))
    assert not verdict.keep
    assert f"swap {names[0]} and {names[1]}" in verdict.reason


@pytest.mark.parametrize("change", [0.03, -0.03])
def test_a_marker_that_was_put_elsewhere_is_told(change):
    recording = piece(small_person.protocol(), 0)
    # Along the line to its neighbor, so that their distance changes by all of it.
    first, second = (recording.labels.index(name) for name in ("RWRA", "RWRB"))
    markers = recording.markers.copy()
    line = markers[:, first] - markers[:, second]
    length = np.linalg.norm(line, axis=1, keepdims=True)
    markers[:, first] += change * line / length
    verdict = at_point(Recording(recording.time, markers, recording.labels, "p"))
    assert not verdict.keep
    # 1 mm of noise in each direction at both ends, static and here: the median of 75
    # frames is 0.2 mm off.
    side = "farther apart" if change > 0 else "closer"
    told = [f"RWRA and RWRB are {mm} mm {side} than in" for mm in (29, 30, 31)]
    assert any(words in verdict.reason for words in told), verdict.reason


def test_a_marker_that_the_static_trial_never_shows_is_reported():
    static = small_person.protocol().static.recording
    step = ProtocolStep("static", "static", 1.2)
    hidden = static.markers.copy()
    hidden[:, static.labels.index("RUPA")] = np.nan
    verdict = judge().judge(
        step, Recording(static.time, hidden, static.labels, "static")
    )
    assert not verdict.keep
    assert verdict.usable
    assert "Never visible: RUPA;" in verdict.reason
    # Nor are those of an arm that wears none, or that the cameras do not know at all.
    left = [i for i, label in enumerate(static.labels) if label.startswith("L")]
    hidden = static.markers.copy()
    hidden[:, left] = np.nan
    one_arm = Recording(static.time, hidden, static.labels, "static")
    assert judge().judge(step, one_arm).keep
    unknown = static.select([la for la in static.labels if la != "RUPA"])
    assert judge().judge(step, unknown).keep


def test_a_person_who_moves_in_the_static_trial_is_reported_with_the_marker():
    static = small_person.protocol().static.recording
    moving = static.markers.copy()
    column = static.labels.index("RFIN")
    moving[:, column, 0] += np.linspace(0, 0.1, len(moving))
    step = ProtocolStep("static", "static", 1.2)
    verdict = judge().judge(
        step, Recording(static.time, moving, static.labels, "static")
    )
    assert not verdict.keep
    assert "RFIN" in verdict.reason
    # A ramp of 100 mm has a standard deviation of 100 / sqrt(12) = 29 mm; the fit of
    # the body takes off up to 1 / 24 of it, and sway and noise add some 3 mm.
    assert 24 < verdict.values["spread_mm"] < 33
    steady = judge().judge(step, static)
    assert steady.keep
    assert steady.values["markers_seen"] == 24


def test_settings_out_of_range_are_refused_before_the_protocol():
    for bad in ({"n_dof": 8}, {"min_still": np.nan}, {"max_hand_speed": 0.0}):
        with pytest.raises(InvalidInput, match=next(iter(bad))):
            Judge(Skeleton.load(), **bad)  # type: ignore[arg-type]
