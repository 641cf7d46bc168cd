"""The conductor: no attempt is lost, whatever the commands and their order."""

import json
import math
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import FileError, InvalidInput
from ikns.experiments.conduct import (
    COMMANDS,
    Command,
    Conductor,
    HeldInput,
    PickingExperiment,
    TrackingExperiment,
    VirtualInput,
    VisitLog,
)
from ikns.experiments.conduct.visit_log import _FIXED
from ikns.experiments.picking import pick_schedule
from ikns.experiments.tracking import measure, schedule
from ikns.experiments.visits import counted_attempts, read_visit, tracking_record
from ikns.simulation.operator import Delay, Operator, typical

DESIGN = {"conditions": ["keyboard", "ikns"], "profiles": ["T1"], "repeats": 1}
SHORT = {"training": 1, "rest": 30.0}
STEPS = schedule(0, **DESIGN, **SHORT, seconds=12.0)
PICKS = pick_schedule(0, conditions=["ring", "ikns"], objects=["A", "C"], **SHORT)
ALIGN = 1.0
FINAL = {
    "tracking": {"done", "skipped"},
    "picking": {"success", "dropped", "timeout", "skipped"},
}


def about(experiment: str) -> dict[str, Any]:
    return {
        "experiment": experiment,
        "participant": "07",
        "participant_number": 6,
        "simulated": False,
        "design": DESIGN | SHORT,
        "seed": 0,
    }


def conductor(folder: Path, experiment: str = "tracking") -> Conductor:
    """A conductor at a visit's folder, new or gone on with."""
    log = VisitLog(folder, about(experiment))
    made = (
        TrackingExperiment(STEPS, log.attempts, align=ALIGN)
        if experiment == "tracking"
        else PickingExperiment(PICKS, log.attempts)
    )
    return Conductor(made, log, page_conditions=["keyboard", "ring"], rest=10.0)


def play(at: Conductor, start: float, seconds: float, c: float = 0.5) -> float:
    """Let time pass at 5 Hz with a signal; return when."""
    for k in range(1, round(seconds * 5) + 1):
        at.add_sample(start + k / 5, c)
        at.update(start + k / 5)
    return start + seconds


def ask(at: Conductor, now: float, *names: str, text: str = "") -> dict[str, Any]:
    for name in names:
        at.submit(Command(name, text))
    return at.update(now)


def start(folder: Path, experiment: str = "tracking") -> Conductor:
    """With the participant's page there and a signal coming."""
    made = conductor(folder, experiment)
    made.submit(Command("page_connected"))
    made.add_sample(0.0, 0.5)
    made.update(0.0)
    return made


# --- a trial ------------------------------------------------------------------------


def test_a_trial_is_on_disk_as_soon_as_it_ends(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    ask(at, 1.0, "begin")
    rng = np.random.default_rng(0)
    frames = np.arange(1.0, 14.2, 0.01)
    told = rng.uniform(0, 1, len(frames))
    told[100:120] = np.nan
    for now, c in zip(frames, told, strict=True):
        at.add_sample(now, c)
        shown = at.update(now)
    assert shown["state"] == "waiting"
    (row,) = read_visit(tmp_path / "v", experiment="tracking").attempts
    assert row["outcome"] == "done"
    assert row["condition"] == STEPS[0].condition
    # What came is what is written, bit for bit, on the time since the profile began.
    kept = frames - 1.0 - ALIGN <= 12.0 + 1e-6
    np.testing.assert_array_equal(row["c"], told[kept])
    np.testing.assert_allclose(row["time"], frames[kept] - 1.0 - ALIGN, atol=1e-12)
    # What the panel shows is what the record comes to.
    figures = measure(tracking_record(row))
    assert shown["attempts"][-1]["rmse"] == figures.rmse
    assert shown["attempts"][-1]["lag"] == pytest.approx(figures.lag, nan_ok=True)


def test_the_screen_says_what_is_due(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    shown = ask(at, 0.1, "begin")
    assert (shown["state"], shown["trial"]["x"]) == ("align", 0.0)
    assert shown["countdown"] == pytest.approx(ALIGN)
    assert "start of the line" in shown["prompt"]
    play(at, 0.1, ALIGN + 3.0)
    trial = at.shown["trial"]
    assert trial["x"] == pytest.approx(3.0 / 12.0)
    assert trial["y"] == 50.0
    assert at.shown["state"] == "track"
    profile = at.experiment.visit.trial.profile  # type: ignore[attr-defined]
    heights = at.curve["heights"]
    grid = np.linspace(0, 12.0, len(heights))
    np.testing.assert_allclose(heights, profile.at(grid), atol=0.0051)  # two digits
    json.dumps(at.plan)


def test_what_is_shown_is_plain_data(tmp_path: Path) -> None:
    for experiment in FINAL:
        at = start(tmp_path / experiment, experiment)
        for name in ("begin", "toggle", "abort", "rest", "skip", "repeat"):
            json.dumps([ask(at, 1.0, name), at.plan, at.curve])


def test_a_trial_needs_a_signal_and_its_page(tmp_path: Path) -> None:
    at = conductor(tmp_path / "v")
    assert "page" in ask(at, 0.0, "begin")["message"]
    at.submit(Command("page_connected"))
    assert "signal from keyboard" in ask(at, 0.1, "begin")["message"]
    at.add_sample(1.0, math.nan)
    assert "signal from keyboard" in ask(at, 1.0, "begin")["message"]
    at.add_sample(1.0, 0.5)
    assert "signal from keyboard" in ask(at, 2.1, "begin")["message"]
    at.add_sample(3.0, 0.5)
    assert ask(at, 3.1, "begin")["state"] == "align"


def test_closing_the_page_aborts_its_trial(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    ask(at, 0.1, "begin")
    shown = ask(at, 2.0, "page_disconnected")
    assert shown["state"] == "waiting"
    assert "page was closed" in shown["message"]
    (row,) = read_visit(tmp_path / "v").attempts
    assert (row["outcome"], len(row["c"])) == ("aborted", 0)
    assert "page was closed" in row["reason"]
    # It comes again.
    assert at.experiment.visit.current.key == row["key"]


def test_a_trial_with_the_arm_continues_without_a_page(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    while at.condition != "ikns" or at.state == "rest":
        ask(at, 1.0, "skip")
    at.add_sample(1.0, 0.5)
    ask(at, 1.0, "begin")
    shown = ask(at, 1.5, "page_disconnected")
    assert shown["state"] == "align"
    play(at, 1.5, ALIGN + 12.0)
    rows = read_visit(tmp_path / "v").attempts
    assert rows[-1]["outcome"] == "done"
    log = (tmp_path / "v" / "log.jsonl").read_text().splitlines()
    said = [json.loads(line)["what"] for line in log]
    assert said.count("page left") == 1


def test_no_trial_begins_in_a_rest_break_or_pause(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    assert ask(at, 1.0, "pause")["state"] == "paused"
    assert "pause" in ask(at, 1.0, "begin")["message"]
    assert ask(at, 1.0, "pause")["state"] == "waiting"
    assert ask(at, 1.0, "rest")["state"] == "rest"
    assert "break" in ask(at, 2.0, "begin")["message"]
    assert at.update(6.0)["countdown"] == pytest.approx(5.0)
    at.add_sample(11.0, 0.5)
    assert at.update(11.0)["state"] == "waiting"  # 10 s are over
    ask(at, 11.0, "rest")
    assert ask(at, 11.0, "skip")["state"] == "waiting"
    assert not at.log.attempts  # a break that is cut short is no attempt
    while at.state != "rest":
        ask(at, 12.0, "skip")
    assert at.update(13.0)["countdown"] == pytest.approx(29.0)
    assert at.update(42.1)["state"] == "waiting"


def test_a_stopped_clock_waits_for_the_outcome(tmp_path: Path) -> None:
    at = start(tmp_path / "v", "picking")
    assert ask(at, 0.1, "begin")["state"] == "ready"
    assert "running" in ask(at, 0.2, "success")["message"] or at.state == "ready"
    assert ask(at, 1.0, "toggle")["state"] == "running"
    assert at.update(5.0)["trial"]["time_left"] == pytest.approx(16.0)
    assert ask(at, 8.5, "toggle")["state"] == "judge"
    assert at.update(90.0)["state"] == "judge"  # no time-out any more
    ask(at, 91.0, "dropped", text="slipped  off\n the palm")
    (row,) = read_visit(tmp_path / "v", experiment="picking").attempts
    assert (row["outcome"], row["time"]) == ("dropped", 7.5)
    assert row["comment"] == "slipped off the palm"


def test_the_limit_ends_a_trial_by_itself(tmp_path: Path) -> None:
    at = start(tmp_path / "v", "picking")
    ask(at, 0.1, "begin", "toggle")
    ask(at, 3.0, "comment", text="heavy")
    assert at.update(20.2)["state"] == "waiting"
    (row,) = read_visit(tmp_path / "v", experiment="picking").attempts
    assert (row["outcome"], row["time"]) == ("timeout", 20.0)
    assert row["comment"] == "heavy"


def test_a_stopped_clock_can_be_aborted_late(tmp_path: Path) -> None:
    at = start(tmp_path / "v", "picking")
    ask(at, 0.1, "begin", "toggle")
    ask(at, 4.1, "toggle")
    ask(at, 100.0, "abort", text="the camera fell")
    (row,) = read_visit(tmp_path / "v", experiment="picking").attempts
    assert (row["outcome"], row["reason"]) == ("aborted", "the camera fell")


# --- emergency ----------------------------------------------------------------------


@pytest.mark.parametrize("experiment", FINAL)
def test_an_emergency_stop_acts_at_once_and_stays(
    tmp_path: Path, experiment: str
) -> None:
    at = start(tmp_path / "v", experiment)
    ask(at, 0.1, "begin", "toggle")
    called = []
    at.on_emergency.append(lambda: called.append(threading.current_thread().name))
    thread = threading.Thread(
        target=at.submit, args=(Command("emergency"),), name="page"
    )
    thread.start()
    thread.join()
    # Before anything was checked, in the thread of whoever asked.
    assert called == ["page"]
    assert at.emergency.is_set()
    shown = at.update(2.0)
    assert (shown["state"], shown["condition"]) == ("stopped", "")
    (row,) = read_visit(tmp_path / "v").attempts
    assert (row["outcome"], row["reason"]) == ("aborted", "emergency stop")
    others = sorted((COMMANDS | at.experiment.commands) - {"end"})
    assert ask(at, 3.0, *others)["state"] == "stopped"
    assert len(read_visit(tmp_path / "v").attempts) == 1
    ask(at, 4.0, "end")
    assert at.over


# --- any commands ---------------------------------------------------------------

ASKED = st.sampled_from(
    sorted(COMMANDS | PickingExperiment.commands)
    + ["begin", "toggle"] * 8
    + ["nonsense"]
)
#: What happens: a command, or time that passes with or without a signal.
HAPPENS = st.one_of(
    st.tuples(ASKED, st.text(max_size=8)),
    st.tuples(st.floats(0.01, 15.0), st.sampled_from([0.3, 1.7, math.nan])),
)


def consistent(at: Conductor, folder: Path) -> list[dict[str, Any]]:
    """What must hold at any time; returns the attempts on disk."""
    rows = read_visit(folder).attempts
    attempts = at.experiment.visit.attempts
    assert [(r["key"], r["outcome"]) for r in rows] == [
        (a.key, a.outcome) for a in attempts
    ]
    assert [r["number"] for r in rows] == list(range(1, len(rows) + 1))
    # Done and left make up all there is.
    steps = [s for s in at.experiment.visit.steps if s.kind != "rest"]
    final = FINAL[at.experiment.name]
    counted = counted_attempts(rows)
    assert {r["outcome"] for r in counted} <= final
    assert len(counted) + at.shown["trials_left"] == len(steps)
    practised: dict[str, int] = {}
    for row in rows:
        assert row["practised"] == practised.get(row["condition"], 0)
        over = row["outcome"] in final - {"skipped"}
        practised[row["condition"]] = row["practised"] + over
    return rows


@settings(max_examples=40)
@given(st.sampled_from(sorted(FINAL)), st.lists(HAPPENS, max_size=14), st.data())
def test_no_attempt_is_lost_whatever_the_commands(
    experiment: str, happens: list[tuple[Any, Any]], data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder, now = Path(name) / "v", 0.0
        at = start(folder, experiment)
        broken_off = data.draw(st.integers(0, len(happens)), "broken off")
        for k, (what, how) in enumerate(happens):
            if k == broken_off:  # another process goes on
                at.close(now)
                before = consistent(at, folder)
                at = conductor(folder, experiment)
                at.submit(Command("page_connected"))
                at.add_sample(now, 0.5)
                at.update(now)
                after = consistent(at, folder)
                assert len(after) == len(before)
            if isinstance(what, str):
                ask(at, now, what, text=how)
            else:
                now = play(at, now, min(what, 3.0), how)
                now += max(0.0, what - 3.0)
                at.add_sample(now, how)
                at.update(now)
        at.close(now)
        rows = consistent(at, folder)
        assert at.experiment.state() == ""
        # And what is left can be done by the next.
        again = conductor(folder, experiment)
        again.update(now)
        assert len(consistent(again, folder)) == len(rows)
        assert again.shown["trials_left"] == at.shown["trials_left"]


def test_many_threads_may_submit_commands(tmp_path: Path) -> None:
    at = start(tmp_path / "v")

    def press() -> None:
        for _ in range(200):
            at.submit(Command("pause"))

    threads = [threading.Thread(target=press) for _ in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        at.update(1.0)
    for thread in threads:
        thread.join()
    at.update(1.0)
    # None was lost: an even number of changes leaves it as it was.
    log = (tmp_path / "v" / "log.jsonl").read_text()
    assert log.count('"pause') == 800
    assert at.state == "waiting"


# --- the log ------------------------------------------------------------------------


@pytest.mark.parametrize("key", _FIXED)
def test_another_visit_does_not_continue_this_one(tmp_path: Path, key: str) -> None:
    first = about("tracking")
    VisitLog(tmp_path / "v", first)
    other = {"experiment": "picking", "simulated": True, "design": {"rest": 1}}
    changed = first | {key: other.get(key, "12")}
    with pytest.raises((InvalidInput, FileError), match=r"expected .* found"):
        VisitLog(tmp_path / "v", changed)
    VisitLog(tmp_path / "v", first)


def test_the_design_that_differs_is_named(tmp_path: Path) -> None:
    VisitLog(tmp_path / "v", about("tracking"))
    changed = about("tracking") | {"design": DESIGN | SHORT | {"rest": 60.0}}
    with pytest.raises(InvalidInput, match=r"expected rest 30\.0.* found 60\.0"):
        VisitLog(tmp_path / "v", changed)


def test_an_attempt_that_cannot_be_written_is_reported_and_kept(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    file = tmp_path / "v" / "visit.json"
    away = file.rename(tmp_path / "away.json")
    ask(at, 0.1, "begin")
    shown = ask(at, 1.0, "abort", "begin", "abort")
    assert "visit.json" in shown["fault"]
    with pytest.raises(FileError, match="2 attempts could not be written"):
        at.log.close()
    away.rename(file)
    assert at.update(5.0)["fault"] == ""
    assert len(consistent(at, tmp_path / "v")) == 2


def test_a_folder_with_other_files_is_not_changed(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InvalidInput, match=r"mine\.txt"):
        VisitLog(tmp_path, about("tracking"))
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


# --- signals ------------------------------------------------------------------------


@given(st.floats(allow_nan=True), st.floats(0, 1))
def test_a_held_signal_is_clipped_and_times_out(c: float, age: float) -> None:
    held = HeldInput(timeout=0.2)
    held.put(5.0, c)
    ((at, value),) = held.take(5.0 + age)
    assert at == 5.0 + age
    if at - 5.0 > 0.2 or not math.isfinite(c):
        assert math.isnan(value)
    else:
        assert value == min(max(c, 0.0), 1.0)
    held.clear()
    assert math.isnan(held.take(5.0)[0].c)


def virtual(visit: Callable[[], Any]) -> VirtualInput:
    rate = 100.0
    operator = Operator(typical("gamepad").practised(9), rate=rate, seed=1)
    return VirtualInput(operator, Delay(0.05, rate=rate), visit)


def test_a_virtual_operator_plays_a_trial(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    player = virtual(at.experiment.trial)  # type: ignore[attr-defined]
    now = 0.0
    for k in range(1500):
        now = k / 60
        for sample in player.take(now):
            at.add_sample(*sample)
        if k == 30:
            at.submit(Command("begin"))
        at.update(now)
    rows = read_visit(tmp_path / "v").attempts
    record = tracking_record(rows[0])
    # A hundred samples a second whatever the screen does: 13 s, the last one maybe
    # after the end.
    assert 1298 <= len(record.time) <= 1301
    np.testing.assert_allclose(np.diff(record.time), 0.01, atol=1e-9)
    # Whoever stands still comes to the spread of the curve at least.
    figures, still = measure(record), np.std(record.target[record.time >= 0])
    assert figures.correlation > 0.9
    assert figures.rmse < still / 2


def test_a_virtual_operator_does_not_make_up_for_lost_time() -> None:
    player = virtual(lambda: None)
    player.take(0.0)
    late = player.take(60.0)
    assert len(late) <= 22
    assert late[0].time >= 60.0 - 0.2
