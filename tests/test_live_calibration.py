"""Protocol, takes, targets, folder and clock of a live calibration."""

import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import contents
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from ikns.errors import FileError, InvalidInput
from ikns.live.calibration import (
    LiveProtocol,
    RecordingsFolder,
    TargetPoints,
    Verdict,
    direction_in_words,
    paper_steps,
)
from ikns.live.calibration.clock import DeviceClock
from ikns.live.calibration.frames import recording_from_frames
from ikns.live.calibration.guidance import HandTracker
from ikns.live.stream import Frame
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

STATIC, FREE, ONE, TWO = paper_steps(
    points=2, static_seconds=0.2, free_seconds=0.3, point_seconds=0.1, countdown=0.1
)
RATE = 100.0


def frame(number: int, value: float | None = None) -> Frame:
    markers = np.full((1, 3), number if value is None else value, dtype=float)
    return Frame(number, number / RATE, 0.0, markers)


def feed(protocol: LiveProtocol, first: int, last: int) -> list[str]:
    """Frames `first` to before `last`, on the device's clock; return what happened."""
    happened = []
    for k in range(first, last):
        happened += [c.what for c in protocol.frame(frame(k), k / RATE)]
        if protocol.state in ("judging", "verdict"):
            break
    return happened


def new(auto_takes: int = 0, **more: object) -> LiveProtocol:
    return LiveProtocol(
        (STATIC, FREE, ONE, TWO),
        labels=("C7",),
        rate=RATE,
        auto_takes=auto_takes,
        **more,  # type: ignore[arg-type]
    )


def up_to_verdict(protocol: LiveProtocol, first: int = 0) -> int:
    """Press a key, wait for the recording to end; return the frame after it."""
    start = first / RATE
    assert [c.what for c in protocol.key("next", start)] == ["countdown"]
    assert protocol.step is not None
    n = round((0.1 + protocol.step.seconds) * RATE)
    assert feed(protocol, first, first + n) == ["recording", "judging"]
    return first + n


# --- the protocol -------------------------------------------------------------------


def test_a_step_records_its_seconds_right_after_its_countdown():
    protocol = new()
    assert [c.what for c in protocol.begin(0.0)] == ["ready"]
    assert feed(protocol, 0, 50) == []  # no one is ready
    protocol.key("next", 0.5)
    assert feed(protocol, 50, 60) == []
    assert protocol.state == "countdown"
    assert feed(protocol, 60, 100) == ["recording", "judging"]
    assert protocol.take is not None
    assert_array_equal(protocol.take.markers[:, 0, 0], np.arange(60, 80))
    assert_allclose(protocol.take.rate, RATE)


def test_steps_follow_each_other_until_all_are_accepted():
    protocol = new()
    protocol.begin(0.0)
    at = 0
    names = []
    while not protocol.over:
        assert protocol.step is not None
        names.append(protocol.step.name)
        at = up_to_verdict(protocol, at)
        protocol.judged(keep=True, usable=True, now=at / RATE)
        assert protocol.waiting
        protocol.key("next", at / RATE)
    assert names == ["static", "free", "point_01", "point_02"]
    assert protocol.state == "done"
    assert protocol.skipped == []


def test_redo_replaces_and_skip_leaves_out():
    protocol = new(accepted=["static", "free"])
    protocol.begin(0.0)
    at = up_to_verdict(protocol)
    first = protocol.take
    protocol.judged(keep=False, usable=True, now=at / RATE)
    changes = protocol.key("redo", at / RATE)
    assert [(c.what, c.step) for c in changes] == [("redo", ONE), ("ready", ONE)]
    at = up_to_verdict(protocol, at)
    assert first is not None
    assert protocol.take is not None
    assert first.markers[0, 0, 0] < protocol.take.markers[0, 0, 0]
    protocol.judged(keep=True, usable=True, now=at / RATE)
    assert protocol.key("next", at / RATE)[0].what == "accepted"
    changes = protocol.key("skip", at / RATE)
    assert [(c.what, c.step) for c in changes] == [("skipped", TWO), ("done", None)]
    assert protocol.skipped == ["point_02"]


def test_what_cannot_be_used_cannot_be_accepted_and_nothing_goes_without_static():
    protocol = new()
    protocol.begin(0.0)
    assert [c.what for c in protocol.key("skip", 0.0)] == ["rejected"]
    at = up_to_verdict(protocol)
    protocol.judged(keep=False, usable=False, now=at / RATE)
    for key in ("next", "skip"):
        assert [c.what for c in protocol.key(key, 1.0)] == ["rejected"]
    assert [c.what for c in protocol.key("redo", 1.0)] == ["redo", "ready"]


@pytest.mark.parametrize("at", ["ready", "countdown", "recording", "verdict"])
def test_quit_stops_wherever_it_is(at):
    protocol = new()
    protocol.begin(0.0)
    if at == "verdict":
        up_to_verdict(protocol)
        protocol.judged(keep=True, usable=True, now=1.0)
    elif at != "ready":
        protocol.key("next", 0.0)
        feed(protocol, 0, 5 if at == "countdown" else 15)
    assert protocol.state == at
    assert [c.what for c in protocol.key("quit", 1.0)] == ["stopped"]
    assert protocol.over
    assert protocol.frame(frame(500), 5.0) == []


def test_a_recording_ends_on_time_though_no_frame_comes():
    protocol = new()
    protocol.begin(0.0)
    protocol.key("next", 0.0)
    assert [c.what for c in protocol.tick(0.1)] == ["recording"]
    assert [c.what for c in protocol.tick(0.31)] == ["judging"]
    assert protocol.take is None


def test_without_keys_verdicts_are_followed():
    protocol = new(auto_takes=2, accepted=["static", "free"])
    at, what = 0, [c.what for c in protocol.begin(0.0)]
    assert what == ["ready", "countdown"]
    for keep, usable, then in (
        (False, True, ["verdict", "redo", "ready", "countdown"]),
        # What could be used but is refused is not kept for want of a better one.
        (False, True, ["verdict", "skipped", "ready", "countdown"]),
        (False, False, ["verdict", "redo", "ready", "countdown"]),
        (True, True, ["verdict", "accepted", "done"]),
    ):
        assert feed(protocol, at, at + 20) == ["recording", "judging"]
        at += 20
        changes = protocol.judged(keep=keep, usable=usable, now=at / RATE)
        assert [c.what for c in changes] == then
    assert protocol.skipped == ["point_01"]


@pytest.mark.parametrize("usable", [False, True])
def test_without_keys_a_refused_static_trial_ends_it(usable):
    protocol = new(auto_takes=1)
    protocol.begin(0.0)
    feed(protocol, 0, 100)
    changes = protocol.judged(keep=False, usable=usable, now=1.0)
    assert [c.what for c in changes] == ["verdict", "stopped"]


def test_a_pending_recording_is_judged_first():
    take = Recording([0.0, 0.01], np.zeros((2, 1, 3)), ["C7"])
    protocol = new(accepted=["static", "free"], pending={"point_01": take})
    assert [c.what for c in protocol.begin(0.0)] == ["judging"]
    assert protocol.kept
    assert protocol.take is take
    protocol.judged(keep=True, usable=True, now=0.0)
    protocol.key("next", 0.0)
    assert protocol.step is TWO
    assert not protocol.kept


@pytest.mark.parametrize(
    "bad", [{"points": 0}, {"static_seconds": 0.0}, {"countdown": -1.0}]
)
def test_steps_out_of_range_are_refused(bad):
    with pytest.raises(InvalidInput, match="expected"):
        paper_steps(**bad)


# --- frames to recordings -----------------------------------------------------------


@settings(max_examples=30)
@given(
    first=st.integers(0, 10**6),
    came=st.lists(st.booleans(), min_size=3, max_size=80),
    late=st.lists(st.integers(0, 8), min_size=80, max_size=80),
    twice=st.lists(st.booleans(), min_size=80, max_size=80),
)
def test_every_frame_goes_to_its_number(first, came, late, twice):
    """Lost frames are NaN, late ones find their place, repeated ones count once."""
    numbers = [first + k for k, here in enumerate(came) if here]
    if len(numbers) < 2:
        assert (
            recording_from_frames([frame(k) for k in numbers], ["C7"], RATE, "t")
            is None
        )
        return
    # Each is held up by a few frames at most; sorting by arrival shuffles them.
    order = sorted(range(len(numbers)), key=lambda i: numbers[i] + late[i])
    frames = [frame(numbers[i]) for i in order for _ in range(1 + twice[i])]
    recording = recording_from_frames(frames, ["C7"], RATE, "t")
    assert recording is not None
    expected = np.full(numbers[-1] - numbers[0] + 1, np.nan)
    for number in numbers:
        expected[number - numbers[0]] = number
    assert_array_equal(recording.markers[:, 0, 0], expected)
    assert_allclose(recording.time, np.arange(len(expected)) / RATE)


def test_a_device_that_counts_anew_goes_on():
    numbers = [9000, 9001, 0, 1, 3]
    recording = recording_from_frames([frame(k) for k in numbers], ["C7"], RATE, "t")
    assert recording is not None
    assert_array_equal(recording.markers[:, 0, 0], [9000, 9001, 0, 1, np.nan, 3])


# --- targets --------------------------------------------------------------------------


def test_suggested_places_are_the_corners_of_a_box_that_was_explored_whole():
    half = np.array([0.1, 0.2, 0.15])
    line = np.linspace(-1, 1, 5)
    grid = np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3) * half
    targets = TargetPoints(grid + [0.3, 0.0, 0.2], 10)
    offsets = (targets.positions - [0.3, 0.0, 0.2]) / half
    assert_allclose(np.sort(np.abs(offsets[:8]), axis=None), 1.0)
    assert len(np.unique(offsets[:8].round(6), axis=0)) == 8
    # Then the middles of the upper and the lower face.
    assert_allclose(offsets[8:], [[0, 1, 0], [0, -1, 0]], atol=1e-12)
    assert targets.direction(8) == "up"
    assert all(
        targets.direction(k) == direction_in_words(offsets[k] * half) for k in range(8)
    )


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 12))
def test_no_suggested_place_is_out_of_reach(seed, n):
    explored = np.random.default_rng(seed).normal(size=(50, 3)) * [0.1, 0.2, 0.1]
    for place in TargetPoints(explored, n).positions:
        assert (explored == place).all(axis=1).any()


def test_the_tracker_sees_the_hand_where_it_is():
    run = simulate_protocol(
        virtual_subject(1),
        seed=1,
        n_points=1,
        quick=True,
        free_seconds=0.5,
        marker_noise=0.0,
        occluded=0.0,
        rate=50,
    )
    worn = run.subject.skeleton.marker_set.without_static()
    skeleton = run.subject.skeleton.with_markers(worn)
    tracker = HandTracker(skeleton, "right_arm", run.free.recording.labels)
    place = tracker.position(run.free.recording.markers[0])
    truth = run.free.truth.task_position("right_arm")[0]
    assert place is not None
    # Without noise the truth leaves no residual; the solver's last step, of at most
    # 1e-5 rad, moves a hand 0.7 m away by less than 1e-5 m.
    assert np.linalg.norm(place - truth) < 1e-5
    assert tracker.position(np.full_like(run.free.recording.markers[0], np.nan)) is None


# --- folder -------------------------------------------------------------------------


def recording(value: float, n: int = 5) -> Recording:
    return Recording(np.arange(n) / RATE, np.full((n, 1, 3), value), ["C7"], "take")


KEEP = Verdict(True, True, "Good.", {"samples": 5, "leak_mm_per_c": [np.nan]})


def test_a_take_is_on_disk_before_anybody_decides(tmp_path: Path):
    folder = RecordingsFolder(tmp_path / "r", {"rate": RATE})
    back = folder.keep(ONE, recording(0.25))
    assert_array_equal(back.markers, 0.25)
    # What a crash leaves here is judged first when it is resumed.
    again = RecordingsFolder(tmp_path / "r", {"rate": RATE}, resume=True)
    assert again.accepted == {}
    assert again.pending([ONE, TWO]) == {"point_01": tmp_path / "r" / "point_01.c3d"}


def test_redone_takes_stay_and_the_accepted_one_counts(tmp_path: Path):
    folder = RecordingsFolder(tmp_path / "r", {})
    folder.keep(ONE, recording(0.25))
    folder.decide(ONE, "redo", replace(KEEP, keep=False))
    before = contents(tmp_path / "r")
    folder.keep(ONE, recording(0.5))
    folder.decide(ONE, "accepted", KEEP)
    folder.keep(TWO, recording(0.75))
    folder.decide(TWO, "skipped", KEEP)
    again = RecordingsFolder(tmp_path / "r", {}, resume=True)
    path = tmp_path / "r" / "point_01_take_2.c3d"
    assert again.accepted == {"point_01": path}
    assert again.pending([ONE, TWO]) == {}
    first = str(tmp_path / "r" / "point_01.c3d")
    assert contents(tmp_path / "r")[first] == before[first]
    assert [take["outcome"] for take in again.takes] == ["redo", "accepted", "skipped"]
    assert again.takes[1]["values"] == {"samples": 5, "leak_mm_per_c": [None]}


def test_a_folder_that_does_not_fit_is_refused(tmp_path: Path):
    with pytest.raises(FileError, match="no live calibration to continue"):
        RecordingsFolder(tmp_path / "r", {}, resume=True)
    RecordingsFolder(tmp_path / "r", {"rate": 100.0})
    with pytest.raises(InvalidInput, match="--resume"):
        RecordingsFolder(tmp_path / "r", {"rate": 100.0})
    with pytest.raises(InvalidInput, match="rate 100.0, found 50"):
        RecordingsFolder(tmp_path / "r", {"rate": 50.0}, resume=True)
    table = tmp_path / "r" / "protocol.json"
    for damage in ("{", json.dumps({"format": 9}), "[]"):
        table.write_text(damage)
        with pytest.raises(FileError, match="cannot be read"):
            RecordingsFolder(tmp_path / "r", {}, resume=True)


def test_one_program_at_a_time_records_takes(tmp_path: Path):
    folder = RecordingsFolder(tmp_path / "r", {})
    with folder.locked():
        other = RecordingsFolder(tmp_path / "r", {}, resume=True)
        with pytest.raises(InvalidInput, match="to record takes in one program"):
            other.locked().__enter__()
    with other.locked():
        pass


# --- clock --------------------------------------------------------------------------


def passed(clock: DeviceClock, *device_times: float) -> list[float]:
    now = []
    for device_time in device_times:
        clock.advance(Frame(0, device_time, 0.0, np.zeros((1, 3))))
        now.append(clock.now)
    return now


def test_time_is_that_of_the_device_and_never_goes_back():
    """Frames that come all at once still take the time that they show."""
    clock, began = DeviceClock(), time.monotonic()
    now = passed(clock, 50.0, 50.01, 50.5, 50.49, 50.51)
    assert_allclose(now, [0.0, 0.01, 0.5, 0.5, 0.51], atol=1e-9)
    # A clock set back, or ahead by more than anybody waited, is not followed; the time
    # that really passed is.
    now += passed(clock, 9.0, 9.01, 1e6, 1e6 + 0.01)
    assert np.all(np.diff(now) >= 0)
    assert 0.02 - 1e-9 <= now[-1] - 0.51 <= 0.02 + time.monotonic() - began


def test_time_goes_on_where_no_frame_comes_and_waits_for_those_held_up():
    clock = DeviceClock(grace=0.0)
    passed(clock, 0.0)
    time.sleep(0.02)
    clock.advance(None)
    assert clock.now >= 0.02
    waited = clock.now
    # Those that were held up come all at once: nothing is counted twice.
    assert passed(clock, 0.01, waited + 0.5) == pytest.approx([waited, waited + 0.5])
    patient = DeviceClock()
    passed(patient, 0.0)
    patient.advance(None)
    assert patient.now == 0.0
