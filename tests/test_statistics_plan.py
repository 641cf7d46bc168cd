"""What a plan takes a spread to be, and how power grows with participants."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.regression.mixed_linear_model import MixedLM

from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics import Design, Spread
from ikns.statistics.assumed_spread import paper_spread, pilot_spread
from ikns.statistics.plan import plan_participants


def pilot(spread, n, levels, repeats, *, seed=0, common=0.0):
    """Trials of n subjects with a planted spread; `common` is every level's own."""
    rng = np.random.default_rng(seed)
    rows = []
    for person in range(n):
        own = spread.subject * rng.standard_normal()
        skill = rng.standard_normal()
        for level in range(levels):
            d = own + spread.level * rng.standard_normal() + common * level
            for condition, _ in itertools.product(("ikns", "ring"), range(repeats)):
                value = skill + d * (condition == "ikns")
                value += spread.trial * rng.standard_normal()
                rows.append((f"s{person:03d}", condition, f"L{level}", value))
    names = ("subject", "condition", "level", "value")
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def found(table, **options):
    return pilot_spread(table, "value", level="level", **options)


def test_a_large_pilot_gives_back_the_spread_that_was_planted():
    planted = Spread(subject=0.8, level=0.5, trial=1.0)
    spread = found(pilot(planted, 400, 3, 3, common=2.0)).spread
    # A variance from f degrees has a standard error of sqrt(2 / f) of itself. Mean
    # squares over 399, 798 and 4800 degrees: of subjects 3 * 0.64 + 0.25 + 0.67 = 2.84,
    # +- 0.20, of the rest 0.92 +- 0.046, of trials 1 +- 0.02; their differences over 3
    # and over 1 have errors of 0.068, and of 0.048. Four of each.
    assert spread.subject**2 == pytest.approx(0.64, abs=4 * 0.068)
    assert spread.level**2 == pytest.approx(0.25, abs=4 * 0.048)
    assert spread.trial**2 == pytest.approx(1.0, abs=4 * 0.02)


@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 8),
    st.integers(1, 4),
    st.integers(1, 3),
)
@settings(max_examples=40, deadline=None)
def test_a_plan_like_the_pilot_has_the_spread_that_the_pilot_had(
    seed, n, levels, repeats
):
    table = pilot(Spread(1.0, 0.5, 0.7), n, levels, repeats, seed=seed)
    assumed = found(table)
    planned = assumed.spread.of_subject_mean(Design(n, levels, repeats))
    # Exact but where a part would be negative and counts as 0: then it is more.
    assert planned >= assumed.deviation * (1 - 1e-9)
    spread = assumed.spread
    if spread.subject > 0 and (spread.level > 0 or repeats == levels == 1):
        assert planned == pytest.approx(assumed.deviation)
    assert assumed.low < assumed.deviation < assumed.high
    assert assumed.subjects == n


def test_the_parts_are_those_of_a_mixed_model_by_restricted_likelihood():
    table = pilot(Spread(1.0, 0.6, 0.4), 12, 4, 2, seed=3)
    assumed = found(table)
    values = np.array(table["value"]).reshape(12, 4, 2, 2).mean(axis=3)
    d = values[..., 0] - values[..., 1]
    levels = np.tile(np.eye(4), (12, 1))
    fit = MixedLM(d.ravel(), levels, groups=np.repeat(np.arange(12), 4)).fit(reml=True)
    # Balanced, and no part negative: both are the same estimate. The optimizer stops
    # at a gradient of 1e-5 or so of a likelihood whose curvature is of order 10.
    assert assumed.spread.subject**2 == pytest.approx(fit.cov_re[0, 0], rel=1e-3)
    rest = assumed.spread.level**2 + assumed.spread.trial**2  # 2 / 2 repeats
    assert rest == pytest.approx(fit.scale, rel=1e-3)


def test_what_all_subjects_share_at_a_level_is_no_spread():
    plain = found(pilot(Spread(1.0, 0.5, 0.7), 6, 3, 2, seed=1)).spread
    shifted = found(pilot(Spread(1.0, 0.5, 0.7), 6, 3, 2, seed=1, common=9.0)).spread
    for name in ("subject", "level", "trial"):
        assert getattr(shifted, name) == pytest.approx(getattr(plain, name))


def test_the_interval_holds_the_true_spread_as_often_as_it_says():
    held = 0
    for seed in range(400):
        one = found(pilot(Spread(1.0), 5, 1, 1, seed=seed))
        held += one.low <= 1.0 <= one.high
    # 380 expected, standard deviation sqrt(400 * 0.95 * 0.05) = 4.4; four of them.
    assert abs(held - 380) <= 18


def test_who_did_not_do_everything_is_left_out_of_a_pilot():
    table = pilot(Spread(1.0, 0.5, 0.7), 6, 3, 2)
    keep = [
        not (who == "s002" and level == "L1")
        for who, level in zip(table["subject"], table["level"], strict=True)
    ]
    less = {k: list(itertools.compress(v, keep)) for k, v in table.items()}
    whole = [who != "s002" for who in table["subject"]]
    without = {k: list(itertools.compress(v, whole)) for k, v in table.items()}
    assert found(less) == found(without)
    assert found(less).subjects == 5


def test_pilots_that_tell_nothing_are_refused():
    with pytest.raises(NotEnoughData, match="at least 2 subjects .* found 1"):
        found(pilot(Spread(1.0), 1, 3, 2))
    same = pilot(Spread(1.0), 4, 1, 1)
    same["value"] = [1.0] * len(same["value"])
    with pytest.raises(NotEnoughData, match="differences that vary"):
        found(same)
    with pytest.raises(NotEnoughData, match="'gamepad'"):
        found(pilot(Spread(1.0), 4, 1, 1), conditions=("ikns", "gamepad"))


def test_the_paper_s_spread_is_what_its_figures_allow_at_most():
    # Subjects who spread as much, with the differences of the trajectories' means that
    # are printed: all that is not the trajectories' is the subjects', so the t-test
    # over all has the printed p.
    means = np.array([-0.78, 0.45, 0.35])
    subject = np.random.default_rng(2).normal(size=10)
    subject = (subject - subject.mean()) / subject.std(ddof=1)
    d = means[:, None] + subject * paper_spread("tracking").deviation
    assert stats.ttest_1samp(d.ravel(), 0).pvalue == pytest.approx(0.979, abs=1e-9)
    assert paper_spread("picking").deviation == pytest.approx(3.26 + 0.71)
    with pytest.raises(InvalidInput, match="'tracking' or 'picking'"):
        paper_spread("lifting")


# --- the plan -------------------------------------------------------------------------


def test_power_grows_with_participants_with_a_smaller_margin_and_with_repeats():
    options = {"margin": 1.0, "simulations": 600}
    plan = plan_participants(Spread(1.0, trial=1.0), levels=1, repeats=1, **options)
    share = [p.power for p in plan.curve]
    numbers = [p.design.subjects for p in plan.curve]
    assert numbers == sorted(set(numbers))
    # Each has an error of at most 1 / sqrt(4 * 600) = 0.0204; a difference of two, four
    # times.
    assert (np.diff(share) > -4 * math.sqrt(2) * 0.0204).all()
    assert share[-1] > 0.9 > share[0]

    def needed(**other):
        spread = other.pop("spread", Spread(1.0, trial=1.0))
        given = {"levels": 1, "repeats": 1} | options | other
        return plan_participants(spread, **given).size.subjects

    assert needed(margin=1.5) < needed() < needed(margin=0.75)
    assert needed(repeats=4) < needed()
    assert needed(spread=Spread(1.0)) < needed() < needed(spread=Spread(2.0))
    assert needed(difference=0.5) > needed()


def test_the_curve_goes_past_what_is_needed_and_holds_what_is_declared():
    plan = plan_participants(
        Spread(1.0), margin=1.0, participants=40, simulations=500, seed=5
    )
    numbers = [p.design.subjects for p in plan.curve]
    assert plan.size.subjects in numbers
    assert plan.declared in plan.curve
    assert plan.declared.design.subjects == 40 == max(numbers)
    # One number of participants has one power, wherever it is told.
    tried = {p.design.subjects: p for p in plan.size.tried}
    assert all(tried.get(p.design.subjects, p) == p for p in plan.curve)
    assert len(numbers) <= 17


def test_a_plan_that_no_participants_reach_says_so_and_still_has_a_curve():
    plan = plan_participants(Spread(9.0), margin=0.5, most=30, simulations=200)
    assert plan.size.subjects is None
    assert max(p.design.subjects for p in plan.curve) == 30
    assert plan.declared is None
    with pytest.raises(InvalidInput, match="at least 2 participants"):
        plan_participants(Spread(1.0), margin=1.0, participants=1)
