"""The trial machine and the visit: what they take down, and every way out."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.experiments.tracking import (
    Attempt,
    TrackingTrial,
    Visit,
    draw_profile,
    schedule,
)

PROFILE = draw_profile("T2", 3)


def played(c, *, rate=100.0, zero=0.0, trial=None):
    """Play a trial with c a function of the time in the profile."""
    trial = trial or TrackingTrial(PROFILE)
    trial.start(zero)
    views = [
        trial.add_sample(zero + k / rate, c(k / rate - 5.0))
        for k in range(round(30 * rate) + 1)
    ]
    return trial, views


def test_a_trial_aligns_for_5_s_tracks_for_25_s_and_is_done():
    trial, views = played(lambda t: 0.3)
    states = [view.state for view in views]
    assert states == ["align"] * 500 + ["track"] * 2500 + ["done"]
    record = trial.record
    assert record.state == "done"
    assert len(record.time) == 3001
    assert record.time[[0, 500, -1]] == pytest.approx([-5, 0, 25], abs=1e-9)
    np.testing.assert_array_equal(record.target, PROFILE.at(record.time))


def test_the_pointer_crosses_at_constant_speed_and_has_the_height_of_c():
    _, views = played(lambda t: 0.5 + 0.7 * math.sin(t))
    x = np.array([view.x for view in views])
    assert (x[:501] == 0).all()
    np.testing.assert_allclose(np.diff(x[500:]), 1 / 2500, atol=1e-12)
    y = np.array([view.y for view in views])
    time = np.arange(3001) / 100 - 5
    wanted = 100 * np.clip(0.5 + 0.7 * np.sin(time), 0, 1)
    np.testing.assert_allclose(y, wanted, atol=1e-9)


def test_the_record_keeps_c_as_it_came_and_the_pointer_waits_where_it_is_missing():
    trial, views = played(lambda t: math.nan if 3 < t < 4 or t < -4 else 1.5 + t)
    record = trial.record
    missing = np.isnan(record.c)
    assert missing.sum() == 99 + 100
    assert np.nanmax(record.c) == pytest.approx(26.5)
    assert np.isnan(record.y[:100]).all()
    np.testing.assert_array_equal(record.y, [view.y for view in views])
    assert np.isfinite(record.y[100:]).all()


@given(st.floats(0, 1e6), st.integers(1, 60))
@settings(max_examples=10)
def test_neither_the_clock_s_zero_nor_its_rate_matters(zero, rate):
    record = played(lambda t: 0.3, zero=zero, rate=rate)[0].record
    # A clock of 1e6 s rounds to 1e-10 s.
    assert record.time[[0, -1]] == pytest.approx([-5, 25], abs=1e-9)
    assert len(record.time) == 30 * rate + 1


def test_times_that_do_not_advance_are_not_recorded():
    trial = TrackingTrial(PROFILE)
    trial.start(10.0)
    for now in (10.0, 10.1, 10.1, 10.05, math.nan, 10.2):
        trial.add_sample(now, 0.5)
    trial.abort(10.3, "enough")
    assert trial.record.time == pytest.approx([-5, -4.9, -4.8])


def test_a_trial_ends_without_samples_too():
    trial = TrackingTrial(PROFILE)
    trial.start(0.0)
    assert trial.update(29.9).state == "track"
    assert trial.update(30.0).state == "done"
    assert trial.add_sample(30.1, 0.5).state == "done"
    assert len(trial.record.time) == 0


def test_an_aborted_trial_keeps_what_it_has_and_why():
    trial = TrackingTrial(PROFILE)
    trial.start(0.0)
    for k in range(700):
        trial.add_sample(k / 100, 0.5)
    with pytest.raises(InvalidInput, match="track"):
        _ = trial.record
    trial.abort(7.0, "a marker fell off")
    trial.add_sample(7.1, 0.5)
    record = trial.record
    assert (record.state, record.reason, len(record.c)) == (
        "aborted",
        "a marker fell off",
        700,
    )


def test_an_abort_after_the_end_does_not_spoil_the_trial():
    trial = TrackingTrial(PROFILE)
    trial.start(0.0)
    trial.abort(30.5, "too late")
    assert trial.record.state == "done"


def test_a_trial_starts_once_and_at_a_time():
    trial = TrackingTrial(PROFILE)
    with pytest.raises(InvalidInput):
        trial.start(math.nan)
    trial.start(0.0)
    with pytest.raises(InvalidInput):
        trial.start(1.0)
    with pytest.raises(InvalidInput):
        TrackingTrial(PROFILE, align=-1.0)


# --- the visit ------------------------------------------------------------------------

STEPS = schedule(1, training=1, rest=60.0)


def do_trial(visit, now=0.0):
    trial = visit.begin(now)
    trial.add_sample(now + 30.0, 0.5)
    assert visit.finish()


def test_a_visit_goes_through_all_steps_in_order():
    visit, done = Visit(STEPS), []
    while visit.current:
        if visit.current.kind == "rest":
            assert visit.rest(100.0) == 60.0
            assert visit.rest(159.0) == 1.0
            assert visit.rest(160.0) == 0.0
        else:
            done.append(visit.current.key)
            do_trial(visit)
    assert done == [s.key for s in STEPS if s.kind != "rest"]
    assert list(visit.records()) == done


def test_an_aborted_trial_is_repeated_and_both_attempts_are_kept():
    visit = Visit(STEPS)
    first = visit.current.key
    visit.begin(0.0).add_sample(0.5, 0.2)
    visit.abort(1.0, "cough")
    assert visit.current.key == first
    do_trial(visit)
    assert [(a.key, a.outcome) for a in visit.attempts] == [
        (first, "aborted"),
        (first, "done"),
    ]
    assert visit.attempts[0].record.c.tolist() == [0.2]


def test_a_step_can_be_skipped_and_repeated():
    visit = Visit(STEPS)
    first = visit.current.key
    visit.skip(0.0, "tired")
    assert visit.current.key == STEPS[1].key
    assert first not in visit.records()
    visit.repeat("rested")
    assert visit.current.key == first
    do_trial(visit)
    assert first in visit.records()


def test_a_repeated_trial_replaces_the_record_that_counts():
    visit = Visit(STEPS)
    do_trial(visit)
    before = next(iter(visit.records().values()))
    visit.repeat("sneezed")
    assert not visit.records()
    do_trial(visit)
    after = next(iter(visit.records().values()))
    assert after is not before
    assert [a.outcome for a in visit.attempts] == ["done", "again", "done"]


@given(st.integers(0, len(STEPS)))
def test_an_interrupted_visit_continues_where_it_stopped(n):
    keys = [s.key for s in STEPS[:n] if s.kind != "rest"]
    visit = Visit(STEPS, [Attempt(key, "done") for key in keys])
    # A rest is over when something after it was done, not before.
    last_is_rest = n > 0 and STEPS[n - 1].kind == "rest"
    assert visit.remaining == tuple(STEPS[n - last_is_rest :])


def test_a_rest_can_be_skipped_but_not_begun():
    keys = [s.key for s in STEPS if s.condition == STEPS[0].condition]
    visit = Visit(STEPS, [Attempt(key, "done") for key in keys])
    assert visit.current.kind == "rest"
    with pytest.raises(InvalidInput, match="rest"):
        visit.begin(0.0)
    visit.skip(0.0, "ready")
    assert visit.current.kind == "training"
    assert visit.rest(0.0) == 0.0


def test_a_trial_that_ran_out_counts_although_it_was_aborted_late():
    visit = Visit(STEPS)
    visit.begin(0.0)
    assert not visit.finish()
    visit.abort(40.0, "forgot to look")
    assert visit.attempts[0].outcome == "done"


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInput, match="T9"):
        Visit(STEPS, [Attempt("ikns/trial/T9/0", "done")])
    visit = Visit(STEPS)
    with pytest.raises(InvalidInput):
        visit.repeat("nothing yet")
    visit.begin(0.0)
    with pytest.raises(InvalidInput):
        visit.begin(1.0)
    with pytest.raises(InvalidInput):
        visit.repeat("one goes on")


def test_many_samples_are_recorded_like_one_after_the_other() -> None:
    profile = draw_profile("T1", seed=0)
    times = [0.0, 0.5, 0.5, 0.4, 2.0, 5.0, 12.0, 30.0, 31.0]
    c = [0.1, np.nan, 0.3, 0.4, 1.5, -0.2, 0.6, 0.7, 0.8]
    one, many = TrackingTrial(profile), TrackingTrial(profile)
    for trial in (one, many):
        trial.start(0.0)
    for now, each in zip(times, c, strict=True):
        one.add_sample(now, each)
    many.add_samples(times, c)
    assert many.update(32.0) == one.update(32.0)
    assert many.record.time.tobytes() == one.record.time.tobytes()
    assert many.record.c.tobytes() == one.record.c.tobytes()
