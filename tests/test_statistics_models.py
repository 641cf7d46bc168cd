"""Mixed model, times with a limit, learning curves, and all of them together."""

import ast
import importlib
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from ikns import statistics
from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics import (
    analyze_picking,
    analyze_tracking,
    learning_curves,
    mixed_model,
    pair_trials,
    restricted_mean,
    subject_means_t,
    time_test,
)

TRAJECTORIES = ("T1", "T2", "T3")


def tracking(
    seed: int, *, slope: float = 1.0, learned: float = 0.0, swapped: bool = False
) -> dict[str, list[object]]:
    """10 subjects x 2 conditions x 3 trajectories x 3 repeats."""
    rng = np.random.default_rng(seed)
    rows = []
    for who in range(10):
        skill, taste = rng.normal(0, (1.0, slope))
        for sign, name in ((0.5, "IKNS"), (-0.5, "gamepad")):
            for k in range(9):
                place = (k + who) % 3
                y = 6 + skill + sign * (0.4 + taste) + 0.7 * place
                y += learned * math.exp(-k / 2) + rng.normal(0, 0.5)
                rows.append((who, name, TRAJECTORIES[place], k + 1, y))
    names = ("subject", "condition", "trajectory", "trial", "rmse")
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def test_balanced_mixed_model_is_the_paired_t_of_subject_means() -> None:
    table = tracking(0)
    found = mixed_model(table, "rmse")
    t = subject_means_t(pair_trials(table, "rmse"))
    assert found.condition is not None
    assert found.message == ""
    # Estimated by an optimizer that stops at a gradient of 1e-5 or so; the error is
    # flat around its minimum.
    assert found.condition.estimate == pytest.approx(t.difference, rel=1e-6)
    assert found.condition.error == pytest.approx(t.difference / t.t, rel=1e-3)
    assert found.condition.p == pytest.approx(t.p, rel=5e-3)
    assert found.condition.degrees == 9


def test_mixed_model_is_the_one_of_statsmodels_formulas() -> None:
    table = tracking(1, learned=1.0)
    found = mixed_model(table, "rmse", trial="trial")
    frame = importlib.import_module("pandas").DataFrame(table)
    library = importlib.import_module("statsmodels.regression.mixed_linear_model")
    frame["x"] = np.where(frame["condition"] == "IKNS", 0.5, -0.5)
    fit = library.MixedLM.from_formula(
        "rmse ~ x * C(trajectory, Sum) + trial",
        groups="subject",
        re_formula="~x",
        data=frame,
    ).fit()
    assert found.condition is not None
    assert found.trial is not None
    # Two starts of one optimizer, on values scaled and not.
    assert found.condition.estimate == pytest.approx(fit.fe_params["x"], rel=1e-4)
    assert found.condition.error == pytest.approx(fit.bse_fe["x"], rel=2e-3)
    assert found.trial.estimate == pytest.approx(fit.fe_params["trial"], rel=1e-4)
    assert found.noise_deviation**2 == pytest.approx(fit.scale, rel=2e-3)
    assert found.slope_deviation**2 == pytest.approx(fit.cov_re.iloc[1, 1], rel=1e-2)
    names = [n for n in fit.fe_params.index if "x:" in n]
    wald = fit.wald_test(
        np.array([[float(n == m) for n in fit.params.index] for m in names]),
        scalar=True,
    )
    assert stats.f.isf(found.interaction_p, *found.interaction_degrees) == (
        pytest.approx(wald.statistic / 2, rel=1e-2)
    )


def test_unit_and_order_change_only_what_they_should() -> None:
    table = tracking(2)
    one = mixed_model(table, "rmse", conditions=("IKNS", "gamepad"))
    scaled = {**table, "rmse": [1000 * float(v) + 5 for v in table["rmse"]]}  # type: ignore[arg-type]
    other = mixed_model(scaled, "rmse", conditions=("gamepad", "IKNS"))
    assert one.condition is not None
    assert other.condition is not None
    assert other.condition.estimate == pytest.approx(
        -1000 * one.condition.estimate, rel=1e-5
    )
    assert other.condition.p == pytest.approx(one.condition.p, rel=1e-2)


def test_a_model_that_does_not_converge_says_so_and_becomes_simpler() -> None:
    structures = set()
    # No subject differs in taste: the likelihood has its maximum at the edge, where the
    # optimizer stops in vain for some of these.
    for seed in (14, 18):
        table = tracking(seed, slope=0.0)
        model = mixed_model(table, "rmse")
        structures.add(model.structure)
        assert model.condition is not None
        full = model.structure == "random intercept and condition per subject"
        assert bool(model.message) != full
        assert ("did not converge" in model.sentence()) != full
        # A simpler model is never surer than the subjects' means are: 1 % for where
        # the optimizer stops.
        t = subject_means_t(pair_trials(table, "rmse"))
        assert model.condition.error > 0.99 * abs(t.difference / t.t)
    assert len(structures) > 1


def test_mixed_model_takes_trials_that_are_missing() -> None:
    table = tracking(3)
    fewer = {name: values[:-2] for name, values in table.items()}
    with pytest.raises(InvalidInput, match="as many trials"):
        pair_trials(fewer, "rmse")
    found = mixed_model(fewer, "rmse")
    assert (found.trials, found.subjects) == (178, 10)


def picking(seed: int, fail: float = 0.1) -> dict[str, list[object]]:
    """10 subjects x 2 conditions x 10 objects; the first condition fails at times."""
    rng = np.random.default_rng(seed)
    rows = []
    for who in range(10):
        for name in ("IKNS", "ring"):
            for thing in "ABCDEFGHIL":
                time = float(rng.gamma(6, 1.4 if name == "IKNS" else 1.0))
                good = time < 20 and not (name == "IKNS" and rng.random() < fail)
                rows.append((who, name, thing, time if good else math.nan, good))
    names = ("subject", "condition", "object", "time", "success")
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_with_failures_at_the_limit_the_curve_has_the_area_of_a_mean(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = rng.uniform(1, 30, 12)
    done = times < 20
    # Without censoring before the limit, Kaplan-Meier is the empirical distribution.
    assert restricted_mean(np.minimum(times, 20.0), done, 20.0) == pytest.approx(
        np.minimum(times, 20).mean()
    )


def test_restricted_mean_of_a_curve_drawn_by_hand() -> None:
    # Success at 1, watching ended at 2, success at 4: 1 until 1, 2/3 until 4, then 0.
    times, done = np.array([1.0, 2.0, 4.0]), np.array([True, False, True])
    assert restricted_mean(times, done, 10.0) == pytest.approx(1 + 3 * 2 / 3)
    assert restricted_mean(times, done, 3.0) == pytest.approx(1 + 2 * 2 / 3)
    assert restricted_mean(times, ~done & done, 10.0) == 10.0


def test_log_rank_stratified_by_pair_asks_who_was_done_first() -> None:
    found = time_test(picking(0), limit=20.0)
    one, other = found.first_sooner, found.second_sooner
    # Each pair adds 1 - 1/2 or -1/2 with variance 1/4.
    assert found.chi2 == pytest.approx((one - other) ** 2 / (one + other))
    assert found.p_exact == stats.binomtest(one, one + other).pvalue
    assert one + other <= found.pairs == 100


def test_a_failure_counts_at_the_limit_and_dropping_it_favors_who_fails() -> None:
    table = picking(1)
    found = time_test(table, limit=20.0)
    good = np.array(table["success"], dtype=bool)
    side = np.array(table["condition"])
    times = np.where(good, np.array(table["time"], dtype=float), 20.0)
    means = tuple(times[side == name].mean() for name in ("IKNS", "ring"))
    assert found.restricted_means == pytest.approx(means)
    assert found.over_subjects is not None
    assert found.over_subjects.difference == pytest.approx(means[0] - means[1])
    assert found.failed_pairs > 0
    assert found.survivors[0] - found.survivors[1] < means[0] - means[1]
    assert "favors the condition that fails more" in found.sentence()


def test_a_success_at_the_limit_comes_before_a_failure() -> None:
    table = {
        "subject": ["a", "a", "b", "b"],
        "condition": ["x", "y", "x", "y"],
        "object": ["A"] * 4,
        "time": [20.0, math.nan, 5.0, 6.0],
        "success": [True, False, True, True],
    }
    found = time_test(table, limit=20.0)
    assert (found.first_sooner, found.second_sooner) == (2, 0)
    assert found.chi2 == pytest.approx(2.0)
    failed = {**table, "success": [False] * 4}
    with pytest.raises(NotEnoughData, match="none of 4"):
        time_test(failed, limit=20.0)
    for bad, words in (
        ({"limit": 0.0}, "above 0 s"),
        ({"limit": 5.5}, "found 20"),
    ):
        with pytest.raises(InvalidInput, match=words):
            time_test(table, **bad)
    with pytest.raises(InvalidInput, match="numbers as time, found 'soon'"):
        time_test({**table, "time": ["soon"] * 4}, limit=20.0)
    lost = {**table, "time": [20.0, 1.0, 5.0, math.nan]}
    with pytest.raises(InvalidInput, match="time of successful trials"):
        time_test(lost, limit=20.0)
    again = {name: values * 2 for name, values in table.items()}
    with pytest.raises(InvalidInput, match="one trial per subject"):
        time_test(again, limit=20.0)


K = np.arange(1.0, 10.0)


@pytest.mark.parametrize(
    ("model", "shape", "rate"),
    [("exponential", np.exp(-(K - 1) / 2.5), 2.5), ("power law", K**-1.3, 1.3)],
)
@pytest.mark.parametrize("per_person", [False, True])
def test_planted_learning_is_found(
    model: str, shape: np.ndarray, rate: float, per_person: bool
) -> None:
    rng = np.random.default_rng(0)
    noise = 0.02
    y = [4 + who + 3 * shape + noise * rng.normal(size=9) for who in range(4)]
    found = learning_curves(
        {
            "subject": np.repeat(np.arange(4), 9),
            "trial": np.tile(K, 4),
            "rmse": np.concatenate(y),
        },
        "rmse",
        per_person=per_person,
    )
    assert found.best == model
    assert sum(found.weights.values()) == pytest.approx(1.0)
    fits = [c for c in found.curves if c.model == model]
    assert len(fits) == (4 if per_person else 1)
    for curve in fits:
        # Errors of some noise / gain; the derivative by the rate is about 0.3 here, and
        # 5 standard errors of the worst conditioned fit are 0.6.
        assert curve.rate == pytest.approx(rate, abs=0.6 if per_person else 0.3)
    assert np.median([c.gain for c in fits]) == pytest.approx(3.0, abs=0.3)


def test_curve_fit_and_aicc_are_those_of_scipy_and_the_textbook() -> None:
    optimize = importlib.import_module("scipy.optimize")
    rng = np.random.default_rng(1)
    y = 4 + 2 * np.exp(-(K - 1) / 2) + 0.1 * rng.normal(size=9)
    table = {"subject": ["a"] * 9, "trial": K, "rmse": y}
    curve = learning_curves(table, "rmse").curves[1]
    (a, b, tau), _ = optimize.curve_fit(
        lambda k, a, b, tau: a + b * np.exp(-(k - 1) / tau), K, y, p0=(4, 2, 2)
    )
    # Both stop where the squared sum changes by less than 1e-8 of itself.
    assert (curve.final, curve.gain, curve.rate) == pytest.approx((a, b, tau), rel=1e-4)
    left = np.sum((y - a - b * np.exp(-(K - 1) / tau)) ** 2)
    aic = 9 * math.log(left / 9) + 2 * 4
    assert curve.aicc == pytest.approx(aic + 2 * 4 * 5 / (9 - 4 - 1), rel=1e-9)


def test_noise_alone_is_no_learning() -> None:
    rng = np.random.default_rng(2)
    table = {
        "subject": np.repeat(np.arange(10), 9),
        "trial": np.tile(K, 10),
        "rmse": rng.normal(4, 0.5, 90),
    }
    found = learning_curves(table, "rmse")
    assert found.best == "constant"
    assert "better than a constant" in found.sentence()


def test_learning_needs_six_trials_that_vary() -> None:
    table = {"subject": ["a"] * 9, "trial": K, "rmse": K}
    for change, error, words in (
        ({"trial": K - 1}, InvalidInput, "counted from 1"),
        ({"trial": np.ones(9)}, NotEnoughData, "6 trials of subject 'a', found 1"),
        ({"rmse": np.ones(9)}, NotEnoughData, "9 times 1"),
        ({"rmse": np.full(9, math.nan)}, InvalidInput, "finite rmse"),
    ):
        with pytest.raises(error, match=words):
            learning_curves({**table, **change}, "rmse")


def test_a_tracking_study_is_analyzed_in_sentences() -> None:
    found = analyze_tracking(tracking(4, learned=3.0), margin=1.0)
    said = found.sentences()
    assert said[0].startswith("Paired t-test as the paper did it")
    assert (found.paper[0].degrees, found.subjects.degrees) == (29, 9)
    assert found.equivalence is not None
    assert found.anova is not None
    assert set(found.learning) == {"IKNS", "gamepad"}
    assert all(c.best != "constant" for c in found.learning.values())
    assert all(line.endswith(".") for line in said)
    silent = analyze_tracking(tracking(4), margin=None, trial=None)
    assert silent.equivalence is None
    assert "No margin was declared" in " ".join(silent.sentences())
    assert not any("equivalent" in line for line in silent.sentences())


def test_a_pick_and_place_study_is_analyzed_in_sentences() -> None:
    table = picking(2)
    found = analyze_picking(table, limit=20.0, conditions=("IKNS", "ring"))
    good = np.array(table["success"], dtype=bool).reshape(10, 2, 10).all(axis=1)
    assert found.paper is not None
    assert found.paper.positive + found.paper.negative == good.sum()
    assert found.paper_left_out == 100 - good.sum()
    assert all(line.endswith(".") for line in found.sentences())
    assert "left out, as the paper did" in found.sentences()[0]


def test_a_lost_trial_is_refused_or_counted() -> None:
    table = picking(4)
    fewer = {name: values[1:] for name, values in table.items()}
    with pytest.raises(InvalidInput, match="found 0 and 1 of subject '0' at object"):
        analyze_picking(fewer, limit=20.0)
    found = analyze_picking(fewer, limit=20.0, unequal="keep")
    assert (found.success.pairs, found.time.pairs) == (99, 99)


def test_a_condition_that_never_succeeds_is_compared_all_the_same() -> None:
    table = picking(3)
    side, good = np.array(table["condition"]), np.array(table["success"], dtype=bool)
    found = analyze_picking({**table, "success": good & (side == "ring")}, limit=20.0)
    assert found.paper is None
    assert found.success.succeeded == (0, 100)
    assert found.time.restricted_means[0] == 20.0
    assert math.isnan(found.time.survivors[0])
    assert "would leave none" in found.time.sentence()
    alike = {**table, "time": [5.0] * 200, "success": [True] * 200}
    even = analyze_picking(alike, limit=20.0)
    assert (even.time.p, even.success.p, even.effects) == (1.0, 1.0, ())


def test_statsmodels_and_pandas_are_loaded_only_when_asked() -> None:
    files = sorted(Path(statistics.__file__).parent.glob("*.py"))
    assert len(files) > 10
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                text = ast.unparse(node)
                assert "pandas" not in text
                assert "import statsmodels." not in text
                assert "from statsmodels" not in text


def test_without_statsmodels_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "statsmodels.regression.mixed_linear_model", None)
    with pytest.raises(InvalidInput, match=r"pip install 'ikns\[study\]' brings.$"):
        mixed_model(tracking(0), "rmse")


def test_impossible_tables_get_one_sentence() -> None:
    table = tracking(5)
    rows = np.array(table["subject"]) == 0
    one = {name: np.array(values)[rows] for name, values in table.items()}
    lone = np.array(table["condition"]) == "IKNS"
    single = {name: np.array(values)[lone] for name, values in table.items()}
    hole = ~(lone & (np.array(table["trajectory"]) == "T2"))
    holed = {name: np.array(values)[hole] for name, values in table.items()}
    n = len(rows)
    for bad, options, words in (
        (one, {}, "2 subjects, found 1"),
        (single, {}, "two conditions"),
        (holed, {}, "trials of IKNS at trajectory 'T2'"),
        ({**table, "rmse": np.ones(n)}, {}, "180 times 1"),
        ({**table, "trial": np.ones(n)}, {"trial": "trial"}, "trial that changes"),
        ({**table, "rmse": np.full(n, np.inf)}, {}, "finite rmse"),
    ):
        with pytest.raises((InvalidInput, NotEnoughData), match=words) as found:
            mixed_model(bad, "rmse", **options)  # type: ignore[arg-type]
        assert str(found.value).endswith(".")
