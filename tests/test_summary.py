"""Tables from visits on disk, against what was put there."""

import csv
import io
import json
import pickle
import shutil
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import small_visits as small
from delayed_copy import DelayedCopy
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy import stats

from ikns.errors import FileError, InvalidInput
from ikns.experiments.study import init_study
from ikns.experiments.study.summary import (
    RunningError,
    condition_means,
    digest_visit,
    summarize,
)
from ikns.experiments.study.summary.answers import picking_answer, tracking_answer
from ikns.experiments.study.summary.numbers import error_csv, numbers, trials_csv
from ikns.experiments.tracking import (
    draw_profile,
    measure,
    schedule,
    virtual_step,
    virtual_trial,
)
from ikns.experiments.tracking.visit import Attempt
from ikns.experiments.visits import tracking_row
from ikns.simulation.operator import CONDITIONS, Delay, sample_abilities
from ikns.statistics import analyze_picking, analyze_tracking, equivalence, pair_trials

BOTH = [(c, t) for c in ("ikns", "gamepad") for t in small.TRAJECTORIES]


def group(study, *, simulated=True):
    (found,) = (g for g in summarize(study).groups if g.simulated == simulated)
    return found


def cell(found, condition, level=""):
    return next(c for c in found if (c.condition, c.level) == (condition, level))


def copied(study, who, operator, device):
    """Visit of one trial of a yardstick."""
    step = next(s for s in schedule(0, training=0) if s.kind == "trial")
    profile = draw_profile(step.profile, step.seed, seconds=step.seconds)
    record = virtual_trial(operator, device, profile)
    done = Attempt(step.key, "done", "", record)
    row = tracking_row(1, step, done, align=5.0, practised=0)
    return small.visit(study, who, "tracking", [row]), profile


def test_a_perfect_operator_has_no_error_in_the_report(tmp_path):
    copied(tmp_path, 1, DelayedCopy(0, rate=50), Delay(0, rate=50))
    found = group(tmp_path).tracking
    # 100 times the rounding of c, as without the disk between.
    assert found.table["rmse"][0] < 1e-12
    assert abs(found.table["lag"][0]) < 1e-6


def test_a_still_operator_has_the_target_s_own_spread_in_the_report(tmp_path):
    still = DelayedCopy(0, rate=50, gain=0.0, start=0.4)
    _, profile = copied(tmp_path, 1, still, Delay(0, rate=50))
    y = profile.at(np.arange(round(50 * profile.seconds) + 1) / 50)
    expected = np.sqrt(np.var(y) + (np.mean(y) - 40) ** 2)
    found = group(tmp_path).tracking
    assert found.table["rmse"][0] == pytest.approx(expected)
    assert np.isnan(found.table["lag"][0])
    assert "–" not in trials_csv(summarize(tmp_path), "tracking")


@pytest.mark.parametrize("delay", [0.1, 0.26, 0.5])
def test_a_known_delay_is_recovered_within_20_ms(tmp_path, delay):
    copied(tmp_path, 1, DelayedCopy(delay, rate=50), Delay(0, rate=50))
    found = group(tmp_path).tracking
    lag = cell(found.metrics["lag"], found.conditions[0]).over.mean
    assert abs(lag - delay) < 0.02


def test_tables_equal_a_direct_computation_on_virtual_operators(tmp_path):
    """The same trials, never on disk, through measure and analyze_tracking."""
    direct = {k: [] for k in ("subject", "condition", "trajectory", "trial", "RMSE")}
    lags = []
    for i in range(2):
        person = SimpleNamespace(
            number=i,
            seed=2,
            abilities={
                c: sample_abilities(2, seed=2, condition=c)[i] for c in CONDITIONS
            },
        )
        rows, done = [], Counter()
        steps = schedule(
            i, profiles=small.TRAJECTORIES, repeats=2, training=0, seconds=15
        )
        for step in steps:
            if step.kind == "rest":
                continue
            record = virtual_step(
                person,
                step,
                draw_profile(step.profile, step.seed, seconds=step.seconds),
                practised=done[step.condition],
                direct=True,
                rate=50.0,
            )
            rows.append(
                tracking_row(
                    len(rows) + 1,
                    step,
                    Attempt(step.key, "done", "", record),
                    align=5.0,
                    practised=done[step.condition],
                )
            )
            done[step.condition] += 1
            values = (
                f"{i + 1:02d}",
                step.condition,
                step.profile,
                done[step.condition],
            )
            found = measure(record)
            for name, value in zip(direct, (*values, found.rmse), strict=True):
                direct[name].append(value)
            lags.append(found.lag)
        small.visit(tmp_path, i + 1, "tracking", rows)
    table = {name: np.asarray(values) for name, values in direct.items()}
    summary = group(tmp_path).tracking
    assert summary.participants == ["01", "02"]
    for each in summary.rmse:
        rows = (table["condition"] == each.condition) & (
            (table["trajectory"] == each.level) | (each.level == "")
        )
        means = [
            table["RMSE"][rows & (table["subject"] == who)].mean()
            for who in summary.participants
        ]
        assert each.over.mean == np.mean(means)
        assert each.over.deviation == np.std(means, ddof=1)
        low, high = stats.t.interval(0.95, 1, np.mean(means), stats.sem(means))
        assert (each.over.low, each.over.high) == pytest.approx((low, high))
        assert (each.trials, each.over.subjects) == (rows.sum(), 2)
    assert summary.table["lag"].tolist() == lags
    (compared,) = summary.comparisons
    expected = analyze_tracking(
        table,
        margin=None,
        value="RMSE",
        unit="of 100",
        conditions=("ikns", "gamepad"),
    )
    assert compared.analysis.sentences() == expected.sentences()


def test_repeats_are_averaged_per_participant_before_participants_are(tmp_path):
    small.tracking(tmp_path, 1, {("ikns", "T1"): [1.0, 3.0], ("gamepad", "T1"): 2.0})
    small.tracking(tmp_path, 2, {("ikns", "T1"): 5.0, ("gamepad", "T1"): 2.5})
    found = group(tmp_path).tracking
    over = cell(found.rmse, "ikns", "T1").over
    assert over.mean == pytest.approx(3.5)  # of 2 and 5; the three trials' is 3
    assert over.deviation == pytest.approx(np.std([2, 5], ddof=1))
    assert cell(found.rmse, "ikns", "T1").trials == 3
    error = found.errors["ikns", "T1"]
    # Between frames the pointer is on the chord of a curve: 0.02^2 / 8 of the second
    # derivative, which a move of 20 in 1.1 s takes to 5.77 * 20 / 1.1^2 = 95 / s^2.
    assert error.mean == pytest.approx(np.full(len(error.time), 3.5), abs=0.005)
    assert error.count.tolist() == [2] * len(error.time)


def test_the_median_trial_is_read_from_disk_again(tmp_path):
    for who, size in enumerate((4.0, 1.0, 2.0), start=1):
        small.tracking(tmp_path, who, {("ikns", "T1"): size, ("gamepad", "T1"): 1.0})
    record, who, rmse = group(tmp_path).tracking.median_trial("ikns", "T1")
    assert (who, rmse) == ("03", pytest.approx(2.0))
    assert measure(record).rmse == rmse
    assert group(tmp_path).tracking.median_trial("mouse", "T1") is None


def test_what_does_not_count_is_counted_but_not_measured(tmp_path):
    rows = [
        small.attempt(1, "ikns", "T1", small.off_by(7), outcome="aborted", reason="x"),
        small.attempt(2, "ikns", "T1", small.off_by(6)),
        small.attempt(3, "ikns", "T1", small.off_by(6), outcome="again"),
        small.attempt(4, "ikns", "T1", small.off_by(2)),
        small.attempt(5, "ikns", "T3", small.off_by(6), outcome="skipped"),
        small.attempt(6, "ikns", "T3", small.off_by(3), repeat=1, practised=1),
        small.attempt(7, "gamepad", "T1", lambda p, t: np.full(len(t), np.nan)),
        small.attempt(8, "ikns", "T1", small.off_by(5), kind="training", repeat=9),
    ]
    small.visit(tmp_path, 1, "tracking", rows)
    found = group(tmp_path).tracking
    assert found.trials()["rmse"] == pytest.approx([2, 3])
    assert found.trials("training")["rmse"] == pytest.approx([5])
    assert found.attempts == {
        ("ikns", "trial", "aborted"): 1,
        ("ikns", "trial", "done"): 3,
        ("ikns", "trial", "again"): 1,
        ("ikns", "trial", "skipped"): 1,
        ("ikns", "training", "done"): 1,
        ("gamepad", "trial", "done"): 1,
    }
    assert found.unmeasured == ["01: gamepad/trial/T1/0"]


def test_people_and_simulated_participants_are_never_pooled(tmp_path):
    for who in (1, 2):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, 1.0), simulated=False)
    for who in (3, 4, 5):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, 5.0))
    first, second = summarize(tmp_path).groups
    assert (first.simulated, second.simulated) == (False, True)
    assert first.tracking.participants == ["01", "02"]
    assert second.tracking.participants == ["03", "04", "05"]
    assert cell(first.tracking.rmse, "ikns").over.mean == pytest.approx(1)
    assert cell(second.tracking.rmse, "ikns").over.mean == pytest.approx(5)
    rows = csv.DictReader(io.StringIO(error_csv(summarize(tmp_path))))
    for row in rows:
        size, n = {"no": (1, 2), "yes": (5, 3)}[row["simulated"]]
        assert float(row["mean"]) == pytest.approx(size, abs=0.005)
        assert int(row["n"]) == n
    lines = trials_csv(summarize(tmp_path), "tracking").splitlines()
    assert [line.split(",")[0] for line in lines] == [
        "simulated",
        *["no"] * 8,
        *["yes"] * 12,
    ]


def test_what_cannot_be_tested_says_why_and_the_rest_is_there(tmp_path):
    cases = {
        "one": ([dict.fromkeys(BOTH, 2.0)], "Not tested: one participant only."),
        "missing": (
            [{("ikns", "T1"): 2.0}, {("ikns", "T1"): 3.0}],
            "Not tested: no trial of condition gamepad was finished.",
        ),
        "apart": (
            [{("ikns", "T1"): 2.0}, {("gamepad", "T1"): 3.0}],
            "Not tested: no participant did both ikns and gamepad.",
        ),
        "alike": (
            [dict.fromkeys(BOTH, 2.0)] * 3,
            "Not tested: expected differences that vary",
        ),
    }
    for name, (visits, why) in cases.items():
        study = tmp_path / name
        init_study(study)
        for who, errors in enumerate(visits, start=1):
            small.tracking(study, who, errors)
        found = group(study).tracking
        (compared,) = found.comparisons
        assert compared.analysis is None
        assert compared.why.startswith(why)
        ((_, said),) = tracking_answer(found, simulated=True)
        assert said == [compared.why]
        assert np.isfinite(found.rmse[0].over.mean)


def test_a_study_in_which_nothing_was_finished_still_tells_what_was_done(tmp_path):
    rows = [small.attempt(1, "ikns", "T1", small.off_by(1), outcome="aborted")]
    for who in (1, 2):
        small.visit(tmp_path, who, "tracking", rows)
        small.visit(tmp_path, who, "picking", [])
    found = group(tmp_path)
    assert found.tracking.attempts == {("ikns", "trial", "aborted"): 2}
    assert found.tracking.conditions == ["ikns"]
    assert found.picking.cells == []
    assert np.isnan(found.tracking.rmse[0].over.mean)


def test_visits_that_cannot_be_used_are_left_out_with_their_reason(tmp_path):
    for who in (1, 2, 3):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, float(who)))
    newer = tmp_path / "visits" / "sub-02_tracking" / "visit.json"
    newer.write_text(newer.read_text().replace('"format": 1', '"format": 99'))
    again = small.tracking(tmp_path, 7, dict.fromkeys(BOTH, 9.0), participant="01")
    summary = summarize(tmp_path)
    reasons = {each.folder.name: each.reason for each in summary.left_out}
    assert set(reasons) == {"sub-02_tracking", again.name}
    assert "expected a visit of format 1, found 99" in reasons["sub-02_tracking"]
    assert "one visit of tracking of participant 01" in reasons[again.name]
    assert summary.visits == 2
    assert summary.groups[0].tracking.participants == ["01", "03"]
    for name in ("sub-01_tracking", "sub-03_tracking", again.name):
        (tmp_path / "visits" / name / "visit.json").write_text("{}")
    with pytest.raises(FileError, match=r"expected a visit .*and 3 more"):
        summarize(tmp_path)


def test_a_visit_that_is_empty_or_lost_its_attempts_is_named(tmp_path):
    for who in (1, 2, 3):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, float(who)))
    visits = tmp_path / "visits"
    (visits / "sub-02_tracking" / "attempts.parquet").unlink()
    (visits / "sub-04_tracking").mkdir()
    (visits / "gate" / "sub-01_picking").mkdir(parents=True)
    summary = summarize(tmp_path)
    reasons = {each.folder: each.reason for each in summary.left_out}
    assert set(reasons) == {
        visits / "sub-02_tracking",
        visits / "sub-04_tracking",
        visits / "gate" / "sub-01_picking",
    }
    for folder, reason in reasons.items():
        assert reason.startswith(f"{folder}: ")
        assert reason.endswith((" is missing.", "there are no attempts in this visit."))
    assert summary.groups[0].tracking.participants == ["01", "03"]
    for who in (1, 2, 3):
        shutil.rmtree(visits / f"sub-{who:02d}_tracking")
    with pytest.raises(FileError, match="sub-04_tracking: this is no visit"):
        summarize(tmp_path)


def test_a_visit_with_times_that_do_not_increase_is_excluded(tmp_path):
    good = small.attempt(1, "ikns", "T1", small.off_by(1))
    short = {**good, "c": good["c"][:-1]}
    back = {**good, "time": good["time"][::-1]}
    strange = {**good, "trajectory": "T9"}
    for who, row in enumerate((good, short, back, strange), start=1):
        small.visit(tmp_path, who, "tracking", [row])
    for who, time in ((1, np.nan), (2, -1.0)):
        rows = small.picking_rows({("ikns", "A"): ("success", time)})
        small.visit(tmp_path, who, "picking", rows)
    summary = summarize(tmp_path)
    assert summary.visits == 1
    assert len(summary.left_out) == 5
    for each in summary.left_out:
        assert each.reason.startswith(f"{each.folder}: ")


def test_trajectories_done_in_one_condition_only_are_counted(tmp_path):
    for who in (1, 2, 3):
        errors = {key: 1.0 + who for key in BOTH[: 4 - who // 2]}
        small.tracking(tmp_path, who, errors | {("gamepad", "T1"): 1.5})
    (compared,) = group(tmp_path).tracking.comparisons
    assert (compared.subjects, compared.alone) == (3, 2)
    assert compared.analysis.subjects.pairs == 3


def test_a_study_without_visits_is_refused(tmp_path):
    with pytest.raises(FileError, match="there are no visits in it"):
        summarize(tmp_path)
    with pytest.raises(FileError):
        summarize(tmp_path / "nowhere")


def test_one_visit_is_a_report_of_its_own(tmp_path):
    folder = small.tracking(tmp_path, 4, dict.fromkeys(BOTH, 2.0), simulated=False)
    summary = summarize(folder)
    (only,) = summary.groups
    assert (only.simulated, summary.visits) == (False, 1)
    assert only.tracking.participants == ["04"]
    assert only.tracking.comparisons[0].why == "Not tested: one participant only."


def test_the_margin_is_the_study_file_s_and_may_not_change_afterwards(tmp_path):
    study = small.small_study(init_study(tmp_path / "study").parent)
    found = group(study)
    table = found.tracking.trials()
    pairs = pair_trials(
        {**table, "RMSE": table["rmse"]},
        "RMSE",
        conditions=("ikns", "gamepad"),
        unit="of 100",
    )
    assert found.tracking.comparisons[0].analysis.equivalence == equivalence(
        pairs, margin=1.0
    )
    assert found.picking.comparisons[0].equivalence.margin == 2.0
    declared = study / "study.toml"
    declared.write_text(declared.read_text().replace("[tracking]", "[trakcing]"))
    with pytest.raises(InvalidInput, match="'tracking'"):
        summarize(study)


def test_variations_are_paired_over_the_participants_that_have_both(tmp_path):
    for who in (1, 2, 3):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, float(who)))
    for who, more in ((2, 1.0), (3, 2.0)):
        errors = dict.fromkeys(BOTH, who + more)
        small.tracking(tmp_path, who, errors, variation="late")
    found = group(tmp_path).tracking
    assert cell(found.rmse, "ikns").over.subjects == 3  # the study as planned alone
    plain, late = (v for v in found.varied if v.condition == "ikns")
    assert (plain.name, plain.against) == ("", None)
    assert (late.name, late.settings) == ("late", {"latency": 0.1})
    assert late.over.mean == pytest.approx(4)
    assert late.against.mean == pytest.approx(1.5)
    assert late.against.deviation == pytest.approx(np.std([1, 2], ddof=1))
    assert late.against.subjects == 2


def test_picking_equals_a_direct_computation(tmp_path):
    small.small_study(tmp_path)
    found = group(tmp_path).picking
    table = found.trials()
    expected = analyze_picking(table, limit=20.0, conditions=("ikns", "ring"))
    (compared,) = found.comparisons
    assert compared.analysis == expected
    b = next(c for c in found.cells if (c.condition, c.object) == ("ikns", "B"))
    assert (b.trials, b.succeeded, b.dropped, b.late) == (4, 0, 2, 2)
    assert (b.restricted, np.isnan(b.mean)) == (20.0, True)
    every = next(c for c in found.cells if (c.condition, c.object) == ("ikns", ""))
    good = table["success"] & (table["condition"] == "ikns")
    assert (every.succeeded, every.trials) == (8, 12)
    assert every.median == np.median(table["time"][good])
    assert every.restricted == pytest.approx((table["time"][good].sum() + 80) / 12)
    share = stats.binomtest(8, 12).proportion_ci(method="exact")
    assert (every.low, every.high) == (share.low, share.high)


def test_all_picks_failed_or_of_different_limits_is_said(tmp_path):
    things = [(c, o) for c in ("ikns", "ring") for o in "AB"]
    for who in (1, 2):
        rows = small.picking_rows(dict.fromkeys(things, ("dropped", 2.0)))
        small.visit(tmp_path / "failed", who, "picking", rows)
        rows = small.picking_rows(
            dict.fromkeys(things, ("success", 2.0)), limit=10.0 * who
        )
        small.visit(tmp_path / "limits", who, "picking", rows)
    (failed,) = group(tmp_path / "failed").picking.comparisons
    assert failed.success.succeeded == (0, 0)
    assert failed.why.startswith("Not tested: expected a successful trial")
    (limits,) = group(tmp_path / "limits").picking.comparisons
    assert limits.why == "Not tested: trials differ in their time limit."
    ((_, said),) = picking_answer(group(tmp_path / "failed").picking, simulated=True)
    assert said[0].startswith("A difference in success is not shown: 0 of 4")


def test_no_difference_found_is_never_called_equality(tmp_path):
    """The same spread around no difference, without a margin, too narrow, and wide."""
    shifts = (0.3, -0.3, 0.2, -0.2)
    said = {}
    for margin in (None, 0.05, 2.0):
        study = tmp_path / str(margin)
        init_study(study)
        declared = (study / "study.toml").read_text()
        line = next(row for row in declared.splitlines() if row.startswith("margin ="))
        new = "" if margin is None else f"margin = {margin}"
        (study / "study.toml").write_text(declared.replace(line, new))
        for who, shift in enumerate(shifts, start=1):
            errors = {("ikns", "T1"): 3 + shift, ("gamepad", "T1"): 3.0}
            small.tracking(study, who, errors)
        ((_, (said[margin], *_)),) = tracking_answer(
            group(study).tracking, simulated=True
        )
    assert said[None].startswith("Open: a difference in RMSE is not shown")
    assert "does not show that there is none" in said[None]
    assert said[0.05].startswith("Open: these data show neither a difference")
    assert said[2.0].startswith("No, within the margin of 2 of 100 declared beforehand")
    for sentence in said.values():
        assert "4 simulated participants" in sentence


def test_more_processes_give_the_same_numbers(tmp_path):
    for who in (1, 2, 3):
        small.tracking(tmp_path, who, dict.fromkeys(BOTH, float(who)))
    one, two = (json.dumps(numbers(summarize(tmp_path, workers=n))) for n in (1, 2))
    assert one == two


def test_memory_does_not_grow_with_the_traces(tmp_path, monkeypatch):
    """Twice the frames, the same size: 1000 participants need no more than numbers."""
    sizes = []
    for who, rate in ((1, 50.0), (2, 100.0)):
        monkeypatch.setattr(small, "RATE", rate)
        folder = small.tracking(tmp_path, who, dict.fromkeys(BOTH, 2.0))
        sizes.append(len(pickle.dumps(digest_visit(folder))))
    # A row of some 20 numbers and names a trial, 301 places of error a cell.
    assert sizes[1] == pytest.approx(sizes[0], abs=100)
    assert sizes[0] < 4 * (301 * 8 + 1000)
    frames = 4 * 16 * 100  # of the second, whose time and c would be 16 bytes each
    assert sizes[1] < 16 * frames / 5


def test_visits_are_read_one_at_a_time_however_many(tmp_path):
    for who in (1, 2):
        small.tracking(tmp_path, who, {("ikns", "T1"): 1.0})
    seen = []
    summarize(tmp_path, progress=lambda *step: seen.append(step))
    assert seen[:2] == [("reading visits", 1, 2), ("reading visits", 2, 2)]


@settings(max_examples=20)
@given(
    arrays.arrays(
        np.float64,
        st.tuples(st.integers(1, 30), st.just(3)),
        elements=st.floats(-99, 99) | st.just(np.nan),
    )
)
def test_running_error_equals_numpy_on_all_subjects_at_once(values):
    running = RunningError(np.arange(3.0))
    for row in values:
        running.add(row)
    found = running.result()
    for k in range(3):
        column = values[:, k][np.isfinite(values[:, k])]
        assert found.count[k] == len(column)
        if not len(column):
            assert np.isnan([found.mean[k], found.low[k]]).all()
            continue
        assert found.mean[k] == pytest.approx(column.mean(), abs=1e-9)
        if len(column) > 1:
            assert found.deviation[k] == pytest.approx(column.std(ddof=1), abs=1e-9)
        # The value below which the share lies, put anywhere within its bin of 0.5.
        for share, value in zip(
            (0.1, 0.5, 0.9), (found.low[k], found.middle[k], found.high[k]), strict=True
        ):
            exact = np.quantile(column, share, method="inverted_cdf")
            assert abs(value - exact) <= 0.5 + 1e-9


def test_running_error_refuses_another_length():
    with pytest.raises(InvalidInput, match="at 3 times"):
        RunningError(np.arange(3.0)).add(np.zeros(4))


def test_condition_means_of_a_hand_made_table():
    table = {
        "subject": np.array(["a", "a", "b"]),
        "condition": np.array(["x", "x", "x"]),
        "trajectory": np.array(["T1", "T2", "T1"]),
        "rmse": np.array([1.0, 5.0, 2.0]),
    }
    found = condition_means(
        table, "rmse", level="trajectory", conditions=["x", "y"], levels=["T1", "T2"]
    )
    means = {(c.condition, c.level): c.over.mean for c in found}
    assert means["x", "T1"] == 1.5
    assert means["x", "T2"] == 5
    assert means["x", ""] == 2.5  # of a's 3 and b's 2
    assert np.isnan(means["y", "T1"])


def test_metrics_come_from_attempts_and_not_from_stored_values(tmp_path: Path):
    """A metric that somebody wrote beside the attempts changes nothing."""
    folder = small.tracking(
        tmp_path, 1, dict.fromkeys(BOTH, 2.0), metrics={"rmse": 0.1}
    )
    (folder / "metrics.json").write_text('{"rmse": 0.1}')
    assert group(tmp_path).tracking.table["rmse"] == pytest.approx(np.full(4, 2.0))
