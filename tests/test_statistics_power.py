"""Power by simulation against closed forms."""

import importlib
import math

import numpy as np
import pytest
from scipy import integrate, stats

from ikns.errors import InvalidInput
from ikns.statistics import Design, Spread, sample_size, simulated_power


def t_power(difference: float, deviation: float, n: int) -> float:
    """Two-sided paired t-test, by statsmodels."""
    power = importlib.import_module("statsmodels.stats.power").TTestPower()
    return float(power.power(difference / deviation, n, 0.05))


def tost_power(margin: float, difference: float, deviation: float, n: int) -> float:
    """Given the spread found, the mean is normal: integrated over the spread's chi."""
    error, quantile = deviation / math.sqrt(n), stats.t.isf(0.05, n - 1)

    def given(chi: float) -> float:
        slack = margin - quantile * error * chi / math.sqrt(n - 1)
        if slack <= 0:
            return 0.0
        z = np.array([slack - difference, -slack - difference]) / error
        return float(-np.diff(stats.norm.cdf(z))[0] * stats.chi.pdf(chi, n - 1))

    edge = margin / error * math.sqrt(n - 1) / quantile
    return integrate.quad(given, 0, min(edge, 12 + math.sqrt(n)))[0]


# Power has a binomial error; a seed is fixed, so 4 errors leave 1 in 16000 to chance.
def close(found: object, power: float, n: int) -> bool:
    return abs(found.power - power) < 4 * math.sqrt(power * (1 - power) / n) + 1e-12  # type: ignore[attr-defined]


@pytest.mark.parametrize("difference", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("n", [6, 20])
def test_simulated_power_is_the_closed_form(difference: float, n: int) -> None:
    spread, runs = Spread(subject=1.0), 4000
    one = Design(n, levels=1, repeats=1)
    found = simulated_power(one, spread, difference=difference, simulations=runs)
    assert close(found, t_power(difference, 1.0, n), runs)
    found = simulated_power(
        one, spread, difference=difference, margin=1.0, simulations=runs
    )
    assert close(found, tost_power(1.0, difference, 1.0, n), runs)
    assert found.error == math.sqrt(found.power * (1 - found.power) / runs)
    assert found.low <= found.power <= found.high


def test_trials_and_trajectories_shrink_their_own_noise_only() -> None:
    spread, design = Spread(subject=0.6, level=0.8, trial=1.2), Design(12, 3, 4)
    deviation = spread.of_subject_mean(design)
    assert deviation == pytest.approx(math.sqrt(0.36 + 0.64 / 3 + 2 * 1.44 / 12))
    found = simulated_power(design, spread, difference=0.6, simulations=4000)
    assert close(found, t_power(0.6, deviation, 12), 4000)
    endless = spread.of_subject_mean(Design(12, 10**6, 10**6))
    assert endless == pytest.approx(0.6, rel=1e-5)


def test_pooling_finds_differences_that_are_not_there() -> None:
    taste, design = Spread(subject=1.0, level=0.5), Design(10)
    right = simulated_power(design, taste, simulations=4000)
    assert close(right, 0.05, 4000)
    pooled = simulated_power(design, taste, simulations=4000, analysis="pooled")
    # 3 alike pairs a person: a t too long by about sqrt(1 + 2 r), r = 0.8 = 1/1.25,
    # so 1.96 / 1.61 = 1.22 of a normal: 0.22.
    assert pooled.low > 0.15
    assert "pooled" in pooled.sentence()


def test_edge_of_the_margin_is_passed_as_seldom_as_alpha() -> None:
    found = simulated_power(
        Design(10), Spread(0.3), difference=1.0, margin=1.0, simulations=4000
    )
    assert close(found, 0.05, 4000)


def test_sample_size_is_where_the_closed_form_crosses() -> None:
    for options, power in (
        ({"difference": 0.5}, lambda n: t_power(0.5, 1.0, n)),
        ({"margin": 0.6}, lambda n: tost_power(0.6, 0.0, 1.0, n)),
    ):
        exact = next(n for n in range(2, 200) if power(n) >= 0.8)
        found = sample_size(
            Spread(1.0), levels=1, repeats=1, simulations=4000, **options
        )
        # One subject more changes power by about 0.01; its error is 0.006.
        assert found.subjects is not None
        assert abs(found.subjects - exact) <= 2
        assert found.below is not None
        assert found.below.power < 0.8 <= found.found.power
        assert [p.design.subjects for p in found.tried] == sorted(
            p.design.subjects for p in found.tried
        )
        assert f"takes {found.subjects} subjects" in found.sentence()


def test_one_seed_one_answer() -> None:
    def run(seed: int) -> object:
        return simulated_power(
            Design(8), Spread(1.0), difference=0.5, simulations=500, seed=seed
        )

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_more_than_the_most_is_reported() -> None:
    found = sample_size(Spread(1.0), difference=0.1, most=10, simulations=500)
    assert found.subjects is None
    assert "takes more than 10 subjects" in found.sentence()


def test_what_no_study_can_show_gets_one_sentence() -> None:
    ten, one = Design(10), Spread(1.0)
    for call, words in (
        (lambda: Design(1), "at least 2 subjects"),
        (lambda: Design(3, levels=0), "1 level"),
        (lambda: Spread(0.0), "one above 0"),
        (lambda: Spread(-1.0), "0 or more"),
        (lambda: Spread(math.nan), "found nan"),
        (lambda: simulated_power(ten, one, margin=-1), "above 0"),
        (lambda: simulated_power(ten, one, alpha=0.5), "alpha"),
        (lambda: simulated_power(ten, one, simulations=0), "1 simulation"),
        (lambda: simulated_power(ten, one, difference=math.inf), "finite"),
        (lambda: simulated_power(ten, one, analysis="all"), "'all'"),  # type: ignore[arg-type]
        (lambda: sample_size(one), "other than 0"),
        (lambda: sample_size(one, margin=0.5, difference=0.5), "inside the margin"),
        (lambda: sample_size(one, difference=1, target=1.0), "found 1"),
        (lambda: sample_size(one, difference=1, most=1), "found 1"),
    ):
        with pytest.raises(InvalidInput, match=words) as found:
            call()
        assert str(found.value).endswith(".")
