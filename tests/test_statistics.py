"""Paired tests, equivalence, effects and success, against published examples."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from ikns.errors import InvalidInput, NotEnoughData
from ikns.statistics import (
    cohens_dz,
    effect_sizes,
    equivalence,
    exact_sign,
    hedges_g_av,
    hodges_lehmann,
    normality,
    pair_arrays,
    pair_trials,
    pooled_t,
    signed_rank,
    subject_means_t,
    success_pairs,
    success_test,
    within_subject_anova,
)
from ikns.statistics.pairs import Pairs

# Darwin's corn: differences in height of 15 pairs, the example of scipy's `wilcoxon`.
CORN = np.array([6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75.0])
# statsmodels' own test data of `ttost_paired`: the first two variables of the clinic
# data, subjects 1 to 15 against 16 to 30; its figures are those of R's equivalence.
CLINIC = {
    1: (
        [2.84, 2.51, 2.41, 2.95, 3.14, 3.79, 4.14, 3.85, 3.02, 3.45, 5.37, 3.81, 4.19]
        + [3.16, 3.84],
        [2.60, 2.82, 2.18, 3.46, 4.01, 3.04, 3.47, 4.06, 2.91, 3.59, 4.51, 3.16, 3.86]
        + [3.31, 3.02],
    ),
    2: (
        [4.00, 3.26, 4.14, 3.42, 3.25, 4.34, 4.97, 4.31, 3.11, 3.41, 5.02, 4.21, 4.59]
        + [5.30, 4.32],
        [3.76, 3.66, 3.65, 3.60, 3.48, 2.87, 3.24, 3.92, 3.99, 4.21, 4.21, 3.31, 3.61]
        + [2.97, 2.73],
    ),
}
# scipy's example of `shapiro`: weights of men in lbs (Shapiro and Wilk 1965).
WEIGHTS = np.array([148, 154, 158, 160, 161, 162, 166, 170, 182, 195, 236.0])


def noisy(seed: int, subjects: int = 10, levels: int = 3) -> Pairs:
    """Pairs of subjects x levels that differ in everything."""
    rng = np.random.default_rng(seed)
    who = np.repeat(np.arange(subjects), levels)
    skill, taste = rng.normal(size=(2, subjects))
    first = 5 + skill[who] + 0.7 * taste[who] + rng.normal(size=len(who))
    second = 5 + skill[who] + rng.normal(size=len(who))
    return pair_arrays(
        first, second, subjects=who, levels=np.tile(np.arange(levels), subjects)
    )


def test_the_tests_are_those_of_scipy_on_its_own_examples() -> None:
    pairs = pair_arrays(100 + CORN, np.full(15, 100.0))
    ranks = signed_rank(pairs)
    # Printed in scipy's documentation.
    assert (ranks.statistic, ranks.p) == (24.0, 0.041259765625)
    w = normality(pair_arrays(WEIGHTS, np.zeros(11)))
    assert w.statistic == pytest.approx(0.7888147, abs=1e-7)  # printed there
    t = pooled_t(pairs)
    # Fisher 1935, Design of experiments, section 17: t = 2.148 with 14 degrees.
    assert round(t.t, 3) == 2.148
    assert t.degrees == 14


def test_equivalence_is_that_of_statsmodels_own_example() -> None:
    # Printed in statsmodels/stats/tests/test_tost.py, from R: eps 0.6.
    for variable, difference, p, low, high in (
        (1, 0.1646666666666667, 0.003166881489265, -0.0744336620516, 0.4037669953849),
        (2, 0.5626666666666665, 0.441203404601758, 0.1261653305099, 0.9991680028234),
    ):
        found = equivalence(pair_arrays(*CLINIC[variable]), margin=0.6)
        assert found.difference == pytest.approx(difference, abs=1e-12)
        assert found.p == pytest.approx(p, abs=1e-12)
        assert (found.low, found.high) == pytest.approx((low, high), abs=1e-12)


def test_equivalence_holds_exactly_when_the_interval_is_inside_the_margin() -> None:
    for seed, margin in product(range(15), (0.2, 0.5, 0.9)):
        found = equivalence(noisy(seed), margin=margin)
        inside = -margin < found.low and found.high < margin
        assert inside == (found.p < 0.05) == found.verdict.startswith("equivalent")
        different = found.low > 0 or found.high < 0  # of 90 %, so weaker than p < 0.05
        assert different or found.p_difference >= 0.05


def test_all_four_verdicts_occur_and_say_no_more_than_they_know() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=10)
    noise = (noise - noise.mean()) / noise.std(ddof=1)  # so t = 3.16 x shift / spread
    base = rng.normal(5.0, 1.0, 10)
    for shift, spread, verdict in (
        (0.0, 0.3, "equivalent"),
        (0.5, 0.3, "equivalent though different"),
        (2.0, 0.3, "different"),
        (0.0, 5.0, "undecided"),
    ):
        found = equivalence(pair_arrays(base + shift + spread * noise, base), margin=1)
        assert found.verdict == verdict
        claims = "are equivalent within" in found.sentence()
        assert claims == (verdict == "equivalent")


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_no_sentence_takes_a_difference_not_found_for_equality(seed: int) -> None:
    pairs = noisy(seed)
    for test in (pooled_t(pairs), subject_means_t(pairs), exact_sign(pairs)):
        said = test.sentence().lower()
        assert not any(
            word in said
            for word in ("equivalent", "no difference", "the same", "comparable")
        )
        assert (test.p < 0.05) == ("not shown" not in said)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_exchanging_the_conditions_flips_signs_and_nothing_else(seed: int) -> None:
    pairs = noisy(seed)
    back = replace(
        pairs, first=pairs.second, second=pairs.first, names=pairs.names[::-1]
    )
    # Sums in another order differ in the last digits.
    for make in (pooled_t, subject_means_t):
        one, other = make(pairs), make(back)
        assert (one.t, one.low, one.p) == pytest.approx(
            (-other.t, -other.high, other.p), rel=1e-9
        )
    one, other = exact_sign(pairs), exact_sign(back)
    assert (one.positive, one.negative) == (other.negative, other.positive)
    assert one.p == other.p
    for make in (cohens_dz, hodges_lehmann):
        one, other = make(pairs), make(back)
        assert (one.value, one.low, one.high) == pytest.approx(
            (-other.value, -other.high, -other.low), rel=1e-6, abs=1e-9
        )
    one, other = (equivalence(p, margin=0.5) for p in (pairs, back))
    assert one.p == pytest.approx(other.p, rel=1e-9)
    assert one.verdict == other.verdict


def test_pooling_counts_pairs_and_subject_means_count_people() -> None:
    pairs = noisy(1)
    assert (pooled_t(pairs).degrees, subject_means_t(pairs).degrees) == (29, 9)
    assert "30 pairs of 10 subjects as independent" in pooled_t(pairs).sentence()
    assert "over 10 subjects" in subject_means_t(pairs).sentence()
    assert "as the paper did it" not in subject_means_t(pairs).sentence()


def test_sign_test_counts_halves_of_the_binomial() -> None:
    pairs = pair_arrays([2.0, 3, 4, 5, 6, 0, 1], [1.0, 1, 1, 1, 1, 1, 1])
    found = exact_sign(pairs)
    assert (found.positive, found.negative, found.ties) == (5, 1, 1)
    assert found.p == pytest.approx(2 * (1 + 6) / 2**6)
    assert exact_sign(pair_arrays([1.0, 2], [1.0, 2])).p == 1.0


def test_paired_error_of_the_first_kind_is_what_it_claims() -> None:
    rng = np.random.default_rng(3)
    n = 200
    rejected = sum(
        subject_means_t(pair_arrays(*rng.normal(size=(2, 10)))).p < 0.05
        for _ in range(n)
    )
    # Binomial: outside these with a chance of 0.001.
    low, high = stats.binom.ppf([0.0005, 0.9995], n, 0.05)
    assert low <= rejected <= high


def test_dz_interval_ends_where_the_t_found_is_a_tail() -> None:
    pairs = noisy(2)
    found = cohens_dz(pairs)
    t = subject_means_t(pairs).t
    assert found.value == pytest.approx(t / math.sqrt(10))
    for end, share in ((found.low, 0.975), (found.high, 0.025)):
        # scipy's inverse (cdflib) and its distribution (Boost) differ by up to 4e-5
        # over 20000 random cases.
        assert stats.nct.cdf(t, 9, end * math.sqrt(10)) == pytest.approx(
            share, abs=1e-4
        )


def test_g_av_is_dz_for_uncorrelated_conditions_of_one_spread() -> None:
    # With s1 = s2 = s and correlation r: dz = g_av / J / sqrt(2 (1 - r)).
    a = np.array([1.0, -1.0, 1.0, -1.0])
    b = np.array([1.0, 1.0, -1.0, -1.0])
    pairs = pair_arrays(a + 0.5, b)
    correction = math.gamma(3) / (math.sqrt(3) * math.gamma(2.5))  # 6 degrees
    found = hedges_g_av(pairs, resamples=99)
    assert found.value == pytest.approx(
        correction * math.sqrt(2) * cohens_dz(pairs).value
    )
    again = hedges_g_av(noisy(1), resamples=99, seed=4)
    assert again == hedges_g_av(noisy(1), resamples=99, seed=4)


def test_hodges_lehmann_interval_holds_the_shifts_not_rejected() -> None:
    pairs = noisy(5, subjects=12, levels=1)
    found = hodges_lehmann(pairs)
    tiny = 1e-9
    for shift, inside in (
        (found.low - tiny, False),
        (found.low + tiny, True),
        (found.high - tiny, True),
        (found.high + tiny, False),
    ):
        p = stats.wilcoxon(pairs.differences - shift).pvalue
        assert (p > 0.05) == inside
    i, j = np.triu_indices(12)
    walsh = (pairs.differences[i] + pairs.differences[j]) / 2
    assert found.value == pytest.approx(np.median(walsh))
    # Five differences: even the rarest ranks have p = 2/32 > 0.05.
    assert hodges_lehmann(noisy(5, subjects=5)).low == -math.inf


def test_effects_of_ten_subjects_come_with_intervals_around_them() -> None:
    for effect in effect_sizes(noisy(6)):
        assert effect.low < effect.value < effect.high
        assert "10 subjects" in effect.sentence()


def test_anova_of_the_condition_is_the_subject_means_t_squared() -> None:
    pairs = noisy(7)
    effects = {name: rest for name, *rest in within_subject_anova(pairs).effects}
    F, degrees, p = effects["condition"]
    t = subject_means_t(pairs)
    assert (F, p) == pytest.approx((t.t**2, t.p), rel=1e-9)
    assert degrees == (1, 9)
    # The interaction is the one-way analysis of the differences over levels.
    d = pairs.differences.reshape(10, 3)
    rows, columns = d.mean(axis=1, keepdims=True), d.mean(axis=0)
    across = 10 * np.sum((columns - d.mean()) ** 2) / 2
    rest = np.sum((d - rows - columns + d.mean()) ** 2) / 18
    assert effects["condition x level"][0] == pytest.approx(across / rest, rel=1e-9)
    with pytest.raises(NotEnoughData, match="at each of at least 2 levels"):
        within_subject_anova(noisy(7, levels=1))


def test_anova_is_that_of_statsmodels_own_example() -> None:
    # statsmodels/stats/tests/test_anova_rm.py, two factors, from R's ezANOVA.
    first = [[7, 3, 6, 6, 5, 8, 6, 7], [7, 11, 9, 11, 10, 10, 11, 11]]
    first += [[8, 14, 10, 11, 12, 10, 11, 12]]
    second = [[16, 7, 11, 9, 10, 11, 8, 8], [16, 10, 13, 10, 10, 14, 11, 12]]
    second += [[24, 29, 10, 22, 25, 28, 22, 24]]
    pairs = pair_arrays(
        np.ravel(first),
        np.ravel(second),
        subjects=np.tile(np.arange(8), 3),
        levels=np.repeat(["a", "b", "c"], 8),
    )
    for effect, printed in zip(
        within_subject_anova(pairs).effects,
        (
            ((1, 7), 40.14159, 3.905263e-04),
            ((2, 14), 29.21739, 1.007549e-05),
            ((2, 14), 17.10545, 1.741322e-04),
        ),
        strict=True,
    ):
        _, F, degrees, p = effect
        assert (degrees, F, p) == (
            printed[0],
            pytest.approx(printed[1], abs=5e-6),
            pytest.approx(printed[2], rel=1e-6),
        )


def test_mcnemar_is_the_binomial_of_one_sided_pairs() -> None:
    a = [1] * 88 + [0] * 12
    found = success_test(pair_arrays(a, [1] * 100, subjects=np.arange(100) // 10))
    assert (found.only_first, found.only_second) == (0, 12)
    assert found.p == pytest.approx(2 * 0.5**12)
    # Failures of two persons only: 10 and 2. Their signs can be flipped in four ways.
    assert found.p_subjects == pytest.approx(0.5)
    # statsmodels/stats/tests/test_contingency_tables.py, 23, 15, 19, 31, from R.
    a = [1] * 38 + [0] * 50
    b = [1] * 23 + [0] * 15 + [1] * 19 + [0] * 31
    assert success_test(pair_arrays(a, b)).p == pytest.approx(0.60759136127308)
    equal = success_test(pair_arrays([1, 1, 0], [1, 1, 0]))
    assert (equal.p, equal.p_subjects, equal.low, equal.high) == (1.0, 1.0, 0.0, 1.0)


def test_trials_become_pairs_of_means() -> None:
    table = {
        "subject": ["b", "b", "a", "a", "a", "a"],
        "condition": ["x", "y", "x", "x", "y", "y"],
        "trajectory": ["T1"] * 6,
        "rmse": [4.0, 3.0, 1.0, 3.0, 5.0, 9.0],
    }
    pairs = pair_trials(table, "rmse")
    assert pairs.subjects.tolist() == ["a", "b"]
    assert pairs.differences.tolist() == [-5.0, 1.0]
    turned = pair_trials(table, "rmse", conditions=("y", "x"))
    assert turned.differences.tolist() == [5.0, -1.0]
    shorter = {name: values[:-1] for name, values in table.items()}
    with pytest.raises(InvalidInput, match="found 2 and 1 of subject 'a' at"):
        pair_trials(shorter, "rmse")
    kept = pair_trials(shorter, "rmse", unequal="keep")
    assert kept.differences.tolist() == [-3.0, 1.0]


def _bad() -> dict[str, tuple[object, type[Exception], str]]:
    one = {
        "subject": ["a", "a"],
        "condition": ["x", "y"],
        "trajectory": ["T1", "T1"],
        "rmse": [1.0, 2.0],
    }
    pairs = pair_arrays([1.0, 2.0, 4.0], [0.0, 0.0, 0.0])
    same = pair_arrays([1.1, 2.2, 3.3], [0.1, 1.2, 2.3])
    alone = pair_arrays([1.0, 2.0], [2.0, 4.0], subjects=["a", "a"])
    return {
        "lengths": (lambda: pair_arrays([1.0, 2.0], [1.0]), InvalidInput, "2 and 1"),
        "nan": (lambda: pair_arrays([1.0, np.nan], [1, 2]), InvalidInput, "nan in row"),
        "one pair": (lambda: pair_arrays([1.0], [2.0]), NotEnoughData, "at least 2"),
        "one trial": (lambda: pair_trials(one, "rmse"), NotEnoughData, "2 pairs"),
        "text": (lambda: pair_arrays(["a", "b"], [1, 2]), InvalidInput, "numbers"),
        "missing": (lambda: pair_arrays([1, None], [1, 2]), InvalidInput, "nan in row"),
        "axes": (lambda: pair_arrays([[1.0]], [[2.0]]), InvalidInput, "shape"),
        "subjects": (
            lambda: pair_arrays([1, 2], [2, 1], subjects=["a"]),
            InvalidInput,
            "2 subjects",
        ),
        "constant": (lambda: pooled_t(same), NotEnoughData, "3 times 1"),
        "constant, ranks": (lambda: signed_rank(same), NotEnoughData, "vary"),
        "constant, effect": (lambda: effect_sizes(same), NotEnoughData, "vary"),
        "one subject": (lambda: subject_means_t(alone), NotEnoughData, "2 subjects"),
        "two for W": (lambda: normality(alone), NotEnoughData, "at least 3 pairs"),
        "margin": (lambda: equivalence(pairs, margin=0), InvalidInput, "above 0"),
        "margin nan": (
            lambda: equivalence(pairs, margin=math.nan),
            InvalidInput,
            "found nan",
        ),
        "alpha": (lambda: equivalence(pairs, margin=1, alpha=1), InvalidInput, "alpha"),
        "column": (lambda: pair_trials(one, "mae"), InvalidInput, "'mae', found"),
        "conditions": (
            lambda: pair_trials(one, "rmse", conditions=("x", "z")),
            NotEnoughData,
            "'z'",
        ),
        "one condition": (
            lambda: pair_trials(one, "rmse", conditions=("x", "x")),
            InvalidInput,
            "two conditions",
        ),
        "ragged": (
            lambda: pair_trials({**one, "rmse": [1.0]}, "rmse"),
            InvalidInput,
            "one length",
        ),
        "success": (lambda: success_test(pairs), InvalidInput, "0 or 1"),
        "success nan": (
            lambda: success_pairs({**one, "success": [1, np.nan]}, level=None),
            InvalidInput,
            "found nan",
        ),
    }


@pytest.mark.parametrize("case", _bad())
def test_bad_input_gets_one_sentence(case: str) -> None:
    call, error, words = _bad()[case]
    with pytest.raises(error, match=words) as found:
        call()  # type: ignore[operator]
    said = str(found.value)
    assert said.endswith(".")
    assert ". " not in said
