"""The live loop: source, controller, finger and session together, and its replay."""

import dataclasses
import math
import os
import threading
import time

import numpy as np
import pytest
import small_person

from ikns.calibration.subject import Subject
from ikns.calibration.subject_files import FILES
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.finger import FingerError, SimulatedFinger
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime import replay_run, run
from ikns.live.session import check_session, create_session, open_run, read_run
from ikns.live.session.channels import STATES
from ikns.live.stream import Event, Source
from ikns.live.stream.replay import Replay
from ikns.motion.marker_ik.rejection_count import kind_of
from ikns.recording.recording import Recording


@pytest.fixture(scope="module")
def subject(files):
    return Subject.load(files / "person")


@pytest.fixture(scope="module")
def exploring():
    return small_person.cut(small_person.protocol().points.recording, 0, 150)


def source(recording, **options):
    return Source(Replay(recording, **options))


def session_for(subject, folder, tmp_path, settings=None):
    subject.save(tmp_path / "person")
    texts = {name: (tmp_path / "person" / name).read_text() for name in FILES}
    labels = subject.skeleton.marker_set.labels
    chosen = ControlSettings() if settings is None else settings
    return open_run(
        create_session(folder),
        labels=labels,
        joint_names=subject.skeleton.joint_names,
        rate=50,
        configuration={"settings": dataclasses.asdict(chosen)},
        subject=texts,
    )


def test_every_frame_is_taken_and_the_finger_follows(subject, exploring):
    finger = SimulatedFinger()
    with source(exploring) as stream:
        report = run(stream, subject, finger)
    assert report.frames == len(exploring.time)
    assert report.source["dropped"] == 0
    assert [c.after for c in report.transitions][:2] == ["armed", "active"]
    assert report.transitions[-1].after == "disarmed"
    assert report.stages["total"].count == report.frames
    assert finger.state().mode == "relaxed"


@pytest.mark.parametrize("method", ["paper", "intent"])
def test_a_session_of_the_loop_replays_bit_for_bit(
    subject, exploring, tmp_path, method
):
    folder, chosen = tmp_path / "session", ControlSettings(method=method)
    with session_for(subject, folder, tmp_path, chosen) as session:
        with source(exploring, speed=4) as stream:
            run(stream, subject, SimulatedFinger(), settings=chosen, session=session)
    recorded = read_run(folder)
    assert len(recorded.frame) == len(exploring.time)
    again = replay_run(recorded)
    kinds = ("c", "flexion_asked", "state", "uncertainty")
    assert again.different == dict.fromkeys(kinds, 0)
    assert np.isfinite(again.c).mean() > 0.5
    assert check_session(folder) == []


def test_a_session_from_before_there_was_an_uncertainty_replays(
    subject, exploring, tmp_path
):
    folder, chosen = tmp_path / "session", ControlSettings(max_uncertainty=None)
    with session_for(subject, folder, tmp_path, chosen) as session:
        with source(exploring, speed=0) as stream:
            run(stream, subject, settings=chosen, session=session)
    recorded = read_run(folder)
    old = {**recorded.configuration["settings"]}
    del old["max_uncertainty"]
    model = {name: v for name, v in recorded.model.items() if "uncertainty" not in name}
    before = dataclasses.replace(
        recorded,
        configuration={**recorded.configuration, "settings": old},
        model=model,
    )
    again = replay_run(before)
    assert again.different == {"c": 0, "flexion_asked": 0, "state": 0}


def test_a_replay_notices_a_changed_marker(subject, exploring, tmp_path):
    folder = tmp_path / "session"
    with session_for(subject, folder, tmp_path) as session:
        with source(exploring, speed=0) as stream:
            run(stream, subject, session=session)
    recorded = read_run(folder)
    markers = recorded.markers.copy()
    markers[20:] += 1e-3
    again = replay_run(dataclasses.replace(recorded, markers=markers))
    assert not again.same


class Stuttering(Replay):
    """A recording whose frames stop coming for a while."""

    def __init__(self, recording, *, after, silence):
        super().__init__(recording)
        self._after, self._until, self._silence = after, math.inf, silence

    def poll(self, timeout):
        if self._number == self._after:
            self._until = min(self._until, time.monotonic() + self._silence)
            if time.monotonic() < self._until:
                time.sleep(min(timeout, 0.02))
                return None
        return super().poll(timeout)


class Backlog(Replay):
    """Received its first frames long before they are asked for."""

    def poll(self, timeout):
        frame = super().poll(timeout)
        if frame is not None and frame.number < 10:
            return dataclasses.replace(frame, receive_time=frame.receive_time - 5)
        return frame


def test_frames_that_came_before_the_start_do_not_move_the_finger(subject, exploring):
    with Source(Backlog(exploring, speed=0)) as source:
        report = run(source, subject, SimulatedFinger())
    assert report.frames == len(exploring.time) - 10
    assert report.stages["total"].percentile(100) < 5


class Unread(Replay):
    """Holds frames that nobody has read, without a time of receipt, as LSL does."""

    def skip(self):
        self._number += 10


def test_a_run_begins_with_the_newest_frame(subject, exploring):
    with Source(Unread(exploring, speed=0)) as source:
        report = run(source, subject, SimulatedFinger())
    assert report.frames == report.source["received"] == len(exploring.time) - 10
    assert report.source["dropped"] == 0


def states(report):
    return [change.after for change in report.transitions]


def test_a_short_silence_holds_and_goes_on(subject, exploring):
    # Long enough for a machine that is busy: its own pauses must not make it safe.
    settings = ControlSettings(hold_after=0.2, safe_after=10.0)
    with Source(Stuttering(exploring, after=50, silence=0.5)) as stream:
        report = run(stream, subject, SimulatedFinger(), settings=settings)
    assert states(report)[:2] == ["armed", "active"]
    assert "holding" in states(report)
    assert states(report)[-2:] == ["active", "disarmed"]


def test_a_long_silence_makes_the_finger_safe(subject, exploring, tmp_path):
    folder = tmp_path / "session"
    with session_for(subject, folder, tmp_path) as session:
        with Source(Stuttering(exploring, after=50, silence=1.0)) as stream:
            report = run(stream, subject, SimulatedFinger(), session=session)
    assert states(report)[:2] == ["armed", "active"]
    # Poses that come again do not bring it back.
    assert states(report)[-2:] == ["safe", "disarmed"]
    safe = report.transitions[-2]
    assert "no valid pose for" in safe.reason
    again = replay_run(read_run(folder))
    assert again.same
    assert STATES[again.state[-1]] == "safe"


class Reconnected(SimulatedFinger):
    """A finger that counts its connections and may refuse the second."""

    def __init__(self, *, refuses=0):
        super().__init__()
        self.connections, self._refuses = 0, refuses

    def connect(self):
        self.connections += 1
        if 1 < self.connections <= 1 + self._refuses:
            raise FingerError("the servo is not there.")
        super().connect()


@pytest.mark.parametrize("refuses", [0, 1])
def test_a_stopped_finger_is_armed_again_on_request_only(
    subject, exploring, tmp_path, refuses
):
    folder, arm, shown = tmp_path / "session", threading.Event(), []
    finger = Reconnected(refuses=refuses)

    def show(status):
        shown.append(status)
        if len(shown) == 5:
            finger.make_safe("a test")
        # For a while nothing is asked for; then once more after each refusal.
        stopped = sum(bool(status.stopped) for status in shown)
        if status.stopped and stopped % 5 == 0:
            arm.set()

    with session_for(subject, folder, tmp_path) as session:
        with source(exploring) as stream:
            report = run(
                stream,
                subject,
                finger,
                session=session,
                arm=arm,
                on_status=show,
                status_every=0.05,
            )
    # A busy machine may add pauses, in which it holds.
    reached = [name for name in states(report) if name not in ("active", "holding")]
    assert reached == ["armed", "safe", "armed", "disarmed"]
    assert "active" in states(report)[-3:]
    assert finger.connections == 2 + refuses
    why = [status.stopped for status in shown if status.stopped]
    assert len(why) >= 5
    assert why[0].endswith("a test")
    refused = "; re-arming failed: the servo is not there"
    assert why[-1].endswith(refused if refuses else "a test")
    assert report.stopped == ""
    assert replay_run(read_run(folder)).same


def test_a_run_that_ends_stopped_says_so(subject, exploring):
    with source(exploring, speed=2) as stream:
        report = run(stream, subject, Failing(40))
    assert report.stopped == "overheating"


class Failing(SimulatedFinger):
    """A finger that goes to its safe state by itself after some commands."""

    def __init__(self, after):
        super().__init__()
        self._left = after

    def command(self, flexion):
        self._left -= 1
        if self._left == 0:
            self.make_safe("overheating")
        return super().command(flexion)


def test_a_finger_in_trouble_stops_the_machine(subject, exploring, tmp_path):
    folder = tmp_path / "session"
    with session_for(subject, folder, tmp_path) as session:
        with source(exploring, speed=2) as stream:
            report = run(stream, subject, Failing(40), session=session)
    stop = next(c for c in report.transitions if c.after == "safe")
    assert "overheating" in stop.reason
    assert replay_run(read_run(folder)).same


def test_an_exception_in_the_loop_relaxes_the_finger(subject, exploring):
    finger = SimulatedFinger()

    def explode(status):
        raise RuntimeError("a screen broke")

    with source(exploring) as stream, pytest.raises(RuntimeError, match="a screen"):
        run(stream, subject, finger, on_status=explode, status_every=0.1)
    assert finger.state().mode == "relaxed"


def test_it_stops_when_asked(subject, exploring):
    stop = threading.Event()
    shown = []

    def show(status):
        shown.append(status)
        if len(shown) == 3:
            stop.set()

    with source(exploring) as stream:
        report = run(stream, subject, stop=stop, on_status=show, status_every=0.1)
    assert report.transitions[-1].reason == "stop requested"
    assert 0 < report.frames < len(exploring.time)
    assert [status.frames for status in shown] == sorted(s.frames for s in shown)


def test_it_ends_after_its_time(subject, exploring):
    with source(exploring) as stream:
        report = run(stream, subject, duration=0.5)
    assert 0.5 <= report.seconds < 1.5


def test_a_source_of_other_markers_is_refused(subject):
    other = Recording([0.0, 0.01], np.zeros((2, 1, 3)), ["ELSE"])
    finger = SimulatedFinger()
    with source(other) as stream, pytest.raises(MarkerMismatch, match="found ELSE"):
        run(stream, subject, finger)
    assert finger.state().mode == "relaxed"


def test_a_frame_may_take_no_longer_than_until_the_next_at_any_speed(
    subject, exploring
):
    class Slow(SimulatedFinger):
        def command(self, flexion):
            time.sleep(0.005)
            return super().command(flexion)

    # 50 Hz ten times as fast leaves 2 ms a frame.
    with source(exploring, speed=10) as stream:
        report = run(stream, subject, Slow())
    assert report.misses == report.frames


def test_garbage_is_collected_before_the_finger_is_connected(subject, exploring):
    # Collecting takes a tenth of a second and stops every thread, also one that has to
    # keep a servo's watchdog quiet.
    import gc

    happened = []

    class Attentive(SimulatedFinger):
        def connect(self):
            happened.append(f"connected while collecting is {gc.isenabled()}")
            super().connect()

    def collected(phase, info):
        if info["generation"] == 2:
            happened.append(phase)

    gc.callbacks.append(collected)
    try:
        with source(exploring, speed=0) as stream:
            run(stream, subject, Attentive())
    finally:
        gc.callbacks.remove(collected)
    connected = happened.index("connected while collecting is False")
    assert happened[connected - 2 : connected] == ["start", "stop"]


def test_the_interpreter_is_as_it_was(subject, exploring):
    import gc
    import sys

    before, during = sys.getswitchinterval(), []
    frozen = gc.get_freeze_count()
    with source(exploring, speed=0) as stream:
        run(
            stream,
            subject,
            on_decision=lambda *_: during.append(sys.getswitchinterval()),
        )
    assert max(during) < before == sys.getswitchinterval()
    assert gc.isenabled()
    assert gc.get_freeze_count() <= frozen  # some of those may be gone


@pytest.fixture(name="scheduler")
def _scheduler(monkeypatch):
    """Stand in for the system's scheduler: policies that were asked for."""
    asked = [os.SCHED_OTHER]
    monkeypatch.setattr(os, "sched_getscheduler", lambda _: asked[-1])
    monkeypatch.setattr(os, "sched_getparam", lambda _: os.sched_param(0))
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda _, policy, __: asked.append(policy)
    )
    return asked


def test_real_time_lasts_as_long_as_the_run(subject, exploring, scheduler):
    during = set()
    with source(exploring, speed=0) as stream:
        run(
            stream,
            subject,
            on_decision=lambda *_: during.add(scheduler[-1]),
            realtime=True,
        )
    assert during == {os.SCHED_RR}
    assert scheduler == [os.SCHED_OTHER, os.SCHED_RR, os.SCHED_OTHER]


def test_without_being_asked_the_scheduler_is_left_alone(subject, exploring, scheduler):
    with source(exploring, speed=0) as stream:
        run(stream, subject)
    assert scheduler == [os.SCHED_OTHER]


def test_real_time_that_is_not_allowed_leaves_the_finger_untouched(
    subject, exploring, scheduler, monkeypatch
):
    def refuse(*_):
        raise PermissionError("Operation not permitted")

    class Untouched(SimulatedFinger):
        def connect(self):
            pytest.fail("connected")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with source(exploring, speed=0) as stream:
        with pytest.raises(InvalidInput, match=r"rtprio 1 for the user"):
            run(stream, subject, Untouched(), realtime=True)
    assert scheduler == [os.SCHED_OTHER]


def test_every_decision_is_handed_on_with_its_time(subject, exploring, tmp_path):
    told = []
    with session_for(subject, tmp_path / "session", tmp_path) as writer:
        begun = time.monotonic()
        run(
            source(exploring, speed=0),
            subject,
            session=writer,
            on_decision=lambda *what: told.append(what),
        )
    record = read_run(tmp_path / "session")
    when, flexion, decisions = zip(*told, strict=True)
    assert len(told) == len(exploring.time)
    assert begun <= when[0] <= when[-1] <= time.monotonic()
    assert list(when) == sorted(when)
    np.testing.assert_array_equal(flexion, record.model["flexion_asked"])
    np.testing.assert_array_equal([d.flexion for d in decisions], flexion)


def test_events_of_the_source_are_told_and_recorded(subject, exploring, tmp_path):
    folder, told = tmp_path / "session", []
    with session_for(subject, folder, tmp_path) as session:
        with source(exploring, speed=0) as stream:
            stream.events.append(Event(0.0, "lab: before the\tstart."))
            frames = iter(range(1000))

            def meanwhile(*_):
                if next(frames) == 40:
                    stream.events.append(Event(1.0, "lab: one."))
                    stream.events.append(Event(1.0, "lab: two."))

            report = run(
                stream,
                subject,
                session=session,
                on_decision=meanwhile,
                on_notice=told.append,
            )
    assert told == ["lab: before the\tstart.", "lab: one.", "lab: two."]
    assert report.notices == told
    assert report.problem == ""
    recorded = [e[3] for e in read_run(folder).events if e[2] == "notice"]
    assert recorded == ["lab: before the start.", "lab: one.", "lab: two."]
    assert replay_run(read_run(folder)).same
    assert check_session(folder) == []


class Mute(Replay):
    """A source that sends nothing."""

    def poll(self, timeout):
        time.sleep(min(timeout, 0.02))


def test_without_any_frame_that_is_the_reason(subject, exploring):
    told = []
    with Source(Mute(exploring)) as stream:
        report = run(stream, subject, duration=0.8, on_notice=told.append)
    # The source reports its silence, too.
    (why,) = (sentence for sentence in told if "has not moved after" in sentence)
    assert why.endswith(" s: no frame arrived.")
    assert report.problem == "the finger never moved: no frame arrived."


def test_each_new_reason_is_told_once(subject, exploring):
    # A frame with every marker, and noise: none is equal to another.
    whole = exploring.markers[np.isfinite(exploring.markers).all(axis=(1, 2))][0]
    noise = np.random.default_rng(4).normal(scale=1e-4, size=exploring.markers.shape)
    told, markers = [], whole + noise
    markers[:80, exploring.labels.index("RFIN")] = np.nan
    markers[80:, exploring.labels.index("RUPA"), 0] += 0.4
    there = dataclasses.replace(exploring, markers=markers)
    with source(there) as stream:
        report = run(stream, subject, on_notice=told.append)
    first, *others = told
    assert first.endswith(": the right hand is not visible.")
    assert others
    assert all("RUPA" in sentence for sentence in others)
    assert len(others) == len({kind_of(n.partition(": ")[2]) for n in others})
    assert sum(report.rejections.values()) == report.frames
    assert report.rejections["the right hand is not visible"] == 80
    assert all("up to" in why for why in report.rejections if "RUPA" in why)


def test_a_wrong_unit_is_a_reason_where_it_was_not_refused(subject, exploring):
    there = dataclasses.replace(exploring, markers=100 * exploring.markers)
    with source(there, speed=0) as stream:
        report = run(stream, subject)
    (why,) = (w for w in report.rejections if "not visible" not in w)
    assert why == (
        "the body is 100 times as large as at calibration; the unit may be wrong"
    )


def test_warming_caches_changes_nothing(subject, exploring, tmp_path):
    found = []
    for speed in (1, 0):  # with a pace there are pauses to warm caches in, without none
        folder = tmp_path / str(speed)
        folder.mkdir()
        with session_for(subject, folder / "session", folder) as writer:
            report = run(source(exploring, speed=speed), subject, session=writer)
        found.append((report.warm_ups, read_run(folder / "session")))
    (some, paced), (none, fast) = found
    assert some > 0
    assert none == 0
    np.testing.assert_array_equal(paced.model["c"], fast.model["c"])
    assert replay_run(paced).same
