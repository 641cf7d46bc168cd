import dataclasses
import math
import os
import threading
import time

import numpy as np
import pytest
import small_person
from hypothesis import assume, given
from hypothesis import strategies as st

from ikns.calibration import sight_needs
from ikns.control import FrameSolver
from ikns.control.controller import Controller
from ikns.control.settings import Settings
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.finger import SimulatedFinger
from ikns.recording import Recording
from ikns.runtime import replay_run, run
from ikns.session import check_session, create_session, open_run, read_run
from ikns.session.channels import STATES
from ikns.stream import Source
from ikns.stream.replay import Replay
from ikns.subject import FILES, Subject


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
    chosen = Settings() if settings is None else settings
    return open_run(
        create_session(folder),
        labels=labels,
        joint_names=subject.skeleton.joint_names,
        rate=50,
        configuration={"settings": dataclasses.asdict(chosen)},
        subject=texts,
    )


# --- the controller, without clock ---------------------------------------------------


def controller(subject, **settings):
    solver = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    made = Controller(solver, Settings(**settings))
    made.machine.arm(0.0)
    return made


def frames(subject, recording):
    return subject.skeleton.marker_set.pick(recording.labels, recording.markers)


def test_c_is_that_of_the_frame_solver_and_flexion_stays_in_range(subject, exploring):
    made = controller(subject)
    alone = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    for k, markers in enumerate(frames(subject, exploring)):
        decision = made.frame(markers, k / 50, k / 50)
        np.testing.assert_array_equal(decision.solved.c, alone.solve(markers).c)
        if decision.valid:
            made.machine.activate(k / 50)
        assert math.isnan(decision.flexion) or 0 <= decision.flexion <= 1


def test_a_frame_that_is_not_new_does_not_keep_the_finger_going(subject, exploring):
    made = controller(subject)
    markers = frames(subject, exploring)[10]
    made.frame(markers, 0.0, 0.0)
    made.machine.activate(0.0)
    states = [made.frame(markers, 0.0, k / 50).state for k in range(1, 40)]
    assert states[0] == "active"
    # 0.1 s later it holds, 0.5 s later it is safe.
    assert states[4:7] == ["active", "holding", "holding"]
    assert states[-1] == "safe"


def test_a_frozen_picture_does_not_keep_the_finger_going(subject, exploring):
    made = controller(subject)
    markers = frames(subject, exploring)[10].copy()
    markers[3] = np.nan  # hidden markers do not make it a new picture
    made.frame(markers, 0.0, 0.0)
    made.machine.activate(0.0)
    # The device goes on counting time, as a server does whose cameras hang.
    states = [made.frame(markers, k / 50, k / 50).state for k in range(1, 40)]
    assert states[4:7] == ["active", "holding", "holding"]
    assert states[-1] == "safe"


def test_a_device_clock_that_starts_anew_is_followed(subject, exploring):
    made = controller(subject)
    markers = frames(subject, exploring)
    made.frame(markers[0], 1000.0, 0.0)
    assert made.frame(markers[1], 0.0, 0.02).valid


LIMITS = ["max_residual", "max_worst_residual", "max_intermarker_error"]


@pytest.mark.parametrize("limit", LIMITS)
def test_a_pose_that_explains_nothing_does_not_count(subject, exploring, limit):
    made = controller(subject, **{limit: 1e-9})
    assert not made.frame(frames(subject, exploring)[0], 0.0, 0.0).valid


@pytest.mark.parametrize("name", [limit.removeprefix("max_") for limit in LIMITS])
def test_a_distance_that_is_no_number_does_not_count(subject, exploring, name):
    made = controller(subject)
    markers = frames(subject, exploring)[0]
    good = made.frame(markers, 0.0, 0.0)
    assert good.valid
    found = good.solved._replace(**{name: math.nan})
    made.solver.solve = lambda _: found
    assert not made.frame(markers + 1e-3, 0.02, 0.02).valid


def of_chain(subject):
    """Columns of the chain's markers, by segment."""
    needs = sight_needs(subject.skeleton, subject.chain).values()
    return [columns for columns, _ in needs]


@given(data=st.data())
def test_a_marker_that_leaves_its_segment_is_named(subject, exploring, data):
    # Pulled by 0.25 m straight away from the middle of the others of its segment. One
    # of them at least lies on that side of it, so their distance d grows to
    # sqrt(d^2 + 0.25^2) or more: by 85 mm where d is up to 0.33 m, as here.
    segments = [own for own in of_chain(subject) if len(own) >= 3]
    seen = frames(subject, exploring)
    own = data.draw(st.sampled_from(segments))
    k, which = data.draw(st.integers(0, len(seen) - 1)), data.draw(st.sampled_from(own))
    others = [column for column in own if column != which]
    assume(np.isfinite(seen[k, own]).all())
    away = seen[k, which] - seen[k, others].mean(axis=0)
    markers = seen[k].copy()
    markers[which] += 0.25 * away / np.linalg.norm(away)
    made = controller(subject)
    assume(made.frame(seen[k], 0.0, 0.0).valid)  # in sight
    decision = made.frame(markers, 0.02, 0.02)
    assert not decision.valid
    label = subject.skeleton.marker_set.labels[which]
    assert label in decision.refused
    assert "farther apart than at calibration" in decision.refused


def test_a_refusal_says_what_to_look_after(subject, exploring):
    seen = frames(subject, exploring)
    labels = subject.skeleton.marker_set.labels
    made = controller(subject)
    assert made.frame(seen[0], 0.0, 0.0).refused == ""
    assert made.frame(seen[0], 0.02, 0.02).refused == "the same picture again"
    hidden = seen[1].copy()
    hidden[of_chain(subject)[-1]] = np.nan
    assert "right hand is not in sight" in made.frame(hidden, 0.04, 0.04).refused
    alone = next(own for own in of_chain(subject) if len(own) == 1)[0]
    astray = seen[2].copy()
    astray[alone] += 1.0
    told = made.frame(astray, 0.06, 0.06).refused
    assert told.startswith(f"{labels[alone]} is ")
    anywhere = seen[3] + np.random.default_rng(0).normal(0, 0.5, seen[3].shape)
    assert "than at calibration" in made.frame(anywhere, 0.08, 0.08).refused


@given(data=st.data())
def test_a_marker_half_a_meter_astray_never_counts(subject, exploring, data):
    # With all markers in sight no posture brings one there and leaves the others; of
    # 20000 draws on other people none did.
    chain = np.concatenate(of_chain(subject)).tolist()
    seen = frames(subject, exploring)
    k = data.draw(st.integers(1, len(seen) - 1))
    markers, which = seen[k].copy(), data.draw(st.sampled_from(chain))
    angle = data.draw(st.floats(-math.pi, math.pi))
    height = data.draw(st.floats(-1, 1))
    around = math.sqrt(1 - height**2)
    where = [around * math.cos(angle), around * math.sin(angle), height]
    assume(np.isfinite(markers[chain]).all())
    markers[which] += 0.5 * np.array(where)
    made = controller(subject)
    assume(made.frame(seen[k - 1], 0.0, 0.0).valid)  # in sight
    assert not made.frame(markers, 0.02, 0.02).valid


@given(data=st.data())
def test_after_a_marker_was_astray_the_next_frame_counts_again(
    subject, exploring, data
):
    # The arm is in sight, and one marker is off by a meter for 60 ms: what was found
    # meanwhile must not be where the solver starts from.
    chain = np.concatenate(of_chain(subject)).tolist()
    seen = frames(subject, exploring)
    k = data.draw(st.integers(1, len(seen) - 5))
    assume(np.isfinite(seen[k - 1 : k + 4, chain]).all())
    which = data.draw(st.sampled_from(chain))
    sign, axis = data.draw(st.sampled_from([-1, 1])), data.draw(st.integers(0, 2))
    made, undisturbed = controller(subject), controller(subject)
    before = made.frame(seen[k - 1], 0.0, 0.0)
    undisturbed.frame(seen[k - 1], 0.0, 0.0)
    assert before.valid
    for j in range(3):
        markers = seen[k + j].copy()
        markers[which, axis] += sign
        now = (j + 1) / 50
        assert not made.frame(markers, now, now).valid
        undisturbed.frame(seen[k + j], now, now)
    again, wanted = (c.frame(seen[k + 3], 0.08, 0.08) for c in (made, undisturbed))
    assert again.valid
    # The solver is pulled to where it starts from, so it is off by a part of the way
    # from there.
    angles, way = again.solved.q[7:], wanted.solved.q[7:] - before.solved.q[7:]
    assert np.abs(angles - wanted.solved.q[7:]).max() < np.abs(way).max()


def test_out_of_sight_is_not_valid(subject):
    made = controller(subject)
    nothing = np.full((len(subject.skeleton.marker_set.labels), 3), np.nan)
    decision = made.frame(nothing, 0.0, 0.0)
    assert not decision.valid
    assert math.isnan(decision.flexion)


def test_flexion_holds_while_the_hand_travels(subject):
    # Between two points the hand is fast, at a point it is not.
    trial = small_person.protocol().points
    still, moving = (
        controller(subject, hold_speed=speed, dead_band=0.0) for speed in (None, 0.15)
    )
    speed = trial.truth.hand_speed("right_arm")
    changed = {"still": [], "moving": []}
    before = {}
    for k, markers in enumerate(frames(subject, trial.recording)[:300]):
        for name, made in (("still", still), ("moving", moving)):
            made.frame(markers, k / 50, k / 50)
            made.machine.activate(k / 50)
            changed[name].append(made.flexion != before.get(name))
            before[name] = made.flexion
    # Well above the gate: the filter of the speed lags by 1 / (2 pi 5 Hz) = 32 ms, two
    # frames, so only frames whose neighbors are fast too are looked at.
    fast = np.array([speed[max(0, k - 3) : k + 4].min() > 0.3 for k in range(300)])
    assert fast.sum() > 10
    assert np.array(changed["still"])[fast].any()
    assert not np.array(changed["moving"])[fast].any()


@pytest.mark.parametrize(
    "bad", [{"dead_band": 1.0}, {"hold_speed": 0.0}, {"max_worst_residual": math.nan}]
)
def test_settings_that_make_no_sense_are_refused(bad):
    with pytest.raises(InvalidInput, match=next(iter(bad)).replace("_", ".")):
        Settings(**bad)


# --- the loop ------------------------------------------------------------------------


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


def test_a_session_of_the_loop_replays_bit_for_bit(subject, exploring, tmp_path):
    folder = tmp_path / "session"
    with session_for(subject, folder, tmp_path) as session:
        with source(exploring, speed=4) as stream:
            run(stream, subject, SimulatedFinger(), session=session)
    recorded = read_run(folder)
    assert len(recorded.frame) == len(exploring.time)
    again = replay_run(recorded)
    assert again.different == {"c": 0, "flexion_asked": 0, "state": 0}
    assert np.isfinite(again.c).mean() > 0.5
    assert check_session(folder) == []


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


def states(report):
    return [change.after for change in report.transitions]


def test_a_short_silence_holds_and_goes_on(subject, exploring):
    # Long enough for a machine that is busy: its own pauses must not make it safe.
    settings = Settings(hold_after=0.2, safe_after=10.0)
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
    assert report.transitions[-1].reason == "asked to stop"
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

    class Attentive(SimulatedFinger):
        def connect(self):
            self.frozen = gc.get_freeze_count()
            super().connect()

    finger = Attentive()
    with source(exploring, speed=0) as stream:
        run(stream, subject, finger)
    assert finger.frozen > 0


def test_the_interpreter_is_as_it_was(subject, exploring):
    import gc
    import sys

    before, during = sys.getswitchinterval(), []
    with source(exploring, speed=0) as stream:
        run(
            stream,
            subject,
            on_decision=lambda *_: during.append(sys.getswitchinterval()),
        )
    assert max(during) < before == sys.getswitchinterval()
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


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


def test_rehearsals_change_nothing(subject, exploring, tmp_path):
    found = []
    for speed in (1, 0):  # with a pace there are pauses to rehearse in, without none
        folder = tmp_path / str(speed)
        folder.mkdir()
        with session_for(subject, folder / "session", folder) as writer:
            report = run(source(exploring, speed=speed), subject, session=writer)
        found.append((report.rehearsals, read_run(folder / "session")))
    (some, paced), (none, fast) = found
    assert some > 0
    assert none == 0
    np.testing.assert_array_equal(paced.model["c"], fast.model["c"])
    assert replay_run(paced).same
