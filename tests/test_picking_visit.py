"""A visit of pick and place: whatever is pressed, nothing is lost or counted twice."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.experiments.picking import PickAttempt, PickVisit, pick_schedule
from ikns.experiments.tracking import Visit, schedule

STEPS = pick_schedule(1, objects=("A", "B", "I"), training=1, rest=60.0)
KEYS = [s.key for s in STEPS if s.kind != "rest"]

commands = st.sampled_from(
    "begin ready start success dropped wait long finish abort skip repeat rest".split()
)


def press(visit, command, now):
    """Do a command at a time; say what the clock shows then, and what was refused."""
    try:
        if command == "begin":
            visit.begin(now)
        elif command == "ready":
            visit.begin()
        elif command in ("success", "dropped") and visit.trial:
            visit.trial.stop(now, command)
        elif command == "start" and visit.trial:
            visit.trial.start(now)
        elif command == "finish":
            visit.finish()
        elif command == "abort":
            visit.abort(now, "a pause")
        elif command == "skip":
            visit.skip(now, "tired")
        elif command == "repeat":
            visit.repeat("once more")
        elif command == "rest":
            visit.rest(now)
    except InvalidInput:
        return now, True
    return now + {"wait": 3.0, "long": 30.0}.get(command, 0.25), False


@given(st.lists(commands, max_size=60))
def test_any_sequence_of_commands_keeps_the_laws(sequence):
    visit, now = PickVisit(STEPS), 0.0
    for command in sequence:
        before, ended = list(visit.attempts), visit.ended
        now, refused = press(visit, command, now)
        # Nothing is ever taken out, and what is refused changes nothing.
        assert visit.attempts[: len(before)] == before
        assert len(visit.attempts) - len(before) <= (not refused)
        # Every step is either to do or ended, never both; order is the schedule's.
        left = [s.key for s in visit.remaining if s.kind != "rest"]
        assert left == [key for key in KEYS if key not in visit.ended]
        # Every key counts at most once, by its last attempt.
        for key, record in visit.records().items():
            last = [a for a in visit.attempts if a.key == key][-1]
            assert last.record is record
            assert record.outcome == last.outcome
            assert record.step.key == key
            assert 0.0 <= record.time <= record.step.limit
            assert (record.time == record.step.limit) == (record.outcome == "timeout")
        # Only what counts takes a step away, only a repeat brings one back.
        assert len(visit.ended) - len(ended) in {"repeat": (0, -1)}.get(command, (0, 1))
        # A visit taken up again from its attempts stands where this one does.
        again = PickVisit(STEPS, visit.attempts)
        assert again.ended == visit.ended
        assert [s.key for s in again.remaining if s.key] == left


@given(st.lists(commands, max_size=30))
def test_a_visit_can_always_be_brought_to_its_end(sequence):
    visit, now = PickVisit(STEPS), 0.0
    for command in sequence:
        now, _ = press(visit, command, now)
    visit.abort(now, "start afresh")
    while visit.current is not None:
        if visit.current.kind == "rest":
            assert visit.rest(now) <= 60.0
            now += 60.0
            assert visit.rest(now) == 0.0
        else:
            visit.begin(now).stop(now + 5.0, "success")
            assert visit.finish()
    assert set(visit.ended) == set(KEYS)
    with pytest.raises(InvalidInput, match="none is left"):
        visit.begin(now)


def test_a_drop_and_a_time_out_are_results_and_an_abort_is_not():
    visit = PickVisit(STEPS)
    first = visit.current.key
    visit.begin(0.0)
    visit.abort(1.0, "cough")
    assert visit.current.key == first
    visit.begin(10.0).stop(12.0, "dropped")
    assert visit.finish()
    visit.begin(20.0).update(40.0)
    assert visit.finish()
    outcomes = ["aborted", "dropped", "timeout"]
    assert [a.outcome for a in visit.attempts] == outcomes
    assert [a.record.time for a in visit.attempts] == [1.0, 2.0, 20.0]
    assert [r.outcome for r in visit.records().values()] == ["dropped", "timeout"]


def test_a_trial_can_wait_for_the_participant_s_own_start():
    visit = PickVisit(STEPS)
    trial = visit.begin()
    assert trial.update(50.0).state == "waiting"
    assert not visit.finish()
    trial.start(51.0)
    trial.stop(55.5, "success")
    assert visit.finish()
    assert visit.attempts[0].record.time == 4.5


def test_the_comment_is_kept_with_the_attempt():
    visit = PickVisit(STEPS)
    trial = visit.begin(0.0)
    trial.stop(4.0, "dropped")
    trial.comment = "touched the table"
    visit.finish()
    assert visit.attempts[0].record.comment == "touched the table"


def test_skipping_a_running_trial_keeps_its_record():
    visit = PickVisit(STEPS)
    visit.begin(0.0)
    visit.skip(3.0, "broken object")
    (attempt,) = visit.attempts
    assert (attempt.outcome, attempt.record.time) == ("skipped", 3.0)
    assert not visit.records()
    visit.repeat("found another")
    assert visit.current.key == attempt.key


@given(st.integers(0, len(STEPS)))
def test_an_interrupted_visit_continues_where_it_stopped(n):
    keys = [s.key for s in STEPS[:n] if s.kind != "rest"]
    visit = PickVisit(STEPS, [PickAttempt(key, "success") for key in keys])
    # A rest is over when something after it was done, not before.
    last_is_rest = n > 0 and STEPS[n - 1].kind == "rest"
    assert visit.remaining == tuple(STEPS[n - last_is_rest :])


def test_attempts_of_another_schedule_are_refused():
    with pytest.raises(InvalidInput, match="ikns/trial/K/0"):
        PickVisit(STEPS, [PickAttempt("ikns/trial/K/0", "success")])


@pytest.mark.parametrize(
    ("visit", "attempt"),
    [
        (
            Visit(schedule(0, conditions=("a", "b", "c"), training=0, rest=60.0)),
            "30 s of tracking",
        ),
        (
            PickVisit(
                pick_schedule(0, conditions=("a", "b", "c"), training=0, rest=60.0)
            ),
            "30 s of picking",
        ),
    ],
    ids=["tracking", "picking"],
)
def test_a_rest_that_was_cut_short_does_not_shorten_the_next(visit, attempt):
    now, rests = 0.0, []
    while visit.current is not None:
        if visit.current.kind != "rest":
            visit.begin(now).update(now + 30.0)
            assert visit.finish()
            now += 30.0
        else:
            rests.append(visit.rest(now))
            visit.skip(now + 1.0, f"ready for {attempt}")
    assert rests == [60.0, 60.0]
