"""People drawn from the tables are as varied as the people measured, and plausible."""

import math

import numpy as np
import pytest

from ikns.body.anthropometry import (
    LIMB_SEGMENTS,
    SEXES,
    expected_lengths,
    length_uncertainty,
    row,
    sample_adults,
    segments,
    table,
)

N_PEOPLE = 20_000
# Seeds are fixed, so a bound that fails one draw in 10^5 is only about being honest.
SIGMAS = 4.5
# Standard deviation of a normal deviate that is redrawn beyond 3:
# f^2 = 1 - 2 * 3 * phi(3) / (2 * Phi(3) - 1).
_PHI = math.exp(-4.5) / math.sqrt(2 * math.pi)
TRUNCATED_SD = math.sqrt(1 - 6 * _PHI / math.erf(3 / math.sqrt(2)))
SAMPLED = ("biacromial_breadth", "acromion_radiale", "radiale_stylion", "hand_length")


@pytest.fixture(scope="module", params=SEXES)
def people(request):
    return request.param, sample_adults(N_PEOPLE, seed=7, sex=request.param)


def test_the_same_seed_gives_the_same_people():
    assert sample_adults(50, seed=3) == sample_adults(50, seed=3)
    assert sample_adults(50, seed=np.random.default_rng(3)) == sample_adults(50, seed=3)
    assert sample_adults(50, seed=3) != sample_adults(50, seed=4)
    assert sample_adults(0, seed=3) == []


def test_without_a_sex_about_half_of_the_people_are_women():
    women = sum(a.sex == "female" for a in sample_adults(N_PEOPLE, seed=1))
    # Binomial: SD = sqrt(n) / 2.
    assert abs(women - N_PEOPLE / 2) <= SIGMAS * math.sqrt(N_PEOPLE) / 2


@pytest.mark.parametrize("name", ["stature", *SAMPLED, "body_mass"])
def test_samples_have_the_moments_of_the_table(people, name):
    sex, adults = people
    published = row("ansur2", name, sex=sex)
    values = _values(adults, name)
    unit = "kg" if name == "body_mass" else "mm"
    mean, sd = published[f"mean_{unit}"], published[f"sd_{unit}"]
    # SE of a mean: sd / sqrt(n). Truncating the log of mass pulls its mean by
    # sigma^2 (1 - f^2) / 2 = 0.04 %.
    pull = 0.0004 * mean if name == "body_mass" else 0.0
    assert values.mean() == pytest.approx(
        mean, abs=SIGMAS * sd / math.sqrt(N_PEOPLE) + pull
    )
    # SE of a deviation: sd sqrt((kurtosis - 1) / 4n), kurtosis 3 for a normal and
    # 3 + 16 (sd/mean)^2 = 3.45 for the log-normal mass. Truncation multiplies by f;
    # what is cut off matters a little more in the long tail of mass (0.5 %), and the
    # joint truncation of correlated residuals cuts 0.2 % more. sd from r and SEE is
    # right to their rounding, 0.005 sd r + 0.05 mm.
    error = SIGMAS * sd * math.sqrt(2.45 / (4 * N_PEOPLE)) + 0.005 * sd
    if name in SAMPLED:
        error += 0.005 * sd * published["r"] + 0.05
    assert values.std() == pytest.approx(TRUNCATED_SD * sd, abs=error)


@pytest.mark.parametrize("name", [*SAMPLED, "body_mass"])
def test_samples_correlate_with_stature_as_in_the_table(people, name):
    sex, adults = people
    r = row("ansur2", name, sex=sex)["r"]
    found = np.corrcoef(_values(adults, "stature"), _values(adults, name))[0, 1]
    # SE of r: (1 - r^2) / sqrt(n); the table's r and SEE are rounded: r to 0.005, and
    # SEE to 0.05 mm of 7 mm, 0.7 % of it, moves r by r (1 - r^2) * 0.7 % < 0.003.
    assert found == pytest.approx(
        r, abs=SIGMAS * (1 - r**2) / math.sqrt(N_PEOPLE) + 0.005 + 0.003
    )


def test_forearm_and_hand_residuals_correlate_as_the_table_says(people):
    sex, adults = people
    stature = _values(adults, "stature")
    residuals = []
    for name in ("radiale_stylion", "hand_length"):
        values = _values(adults, name)
        residuals.append(values - np.polyval(np.polyfit(stature, values, 1), stature))
    rho = table("ansur2")["residual_correlation"]["radiale_stylion"]["hand_length"]
    # SE (1 - rho^2) / sqrt(n); truncating both at 3 lowers a correlation of 0.4 by
    # less than the share of variance that it cuts, 2.7 %.
    assert np.corrcoef(residuals)[0, 1] == pytest.approx(
        rho, abs=SIGMAS * (1 - rho**2) / math.sqrt(N_PEOPLE) + 0.027 * rho
    )


def test_no_one_is_implausible(people):
    sex, adults = people
    stature = row("ansur2", "stature", sex=sex)
    heights = _values(adults, "stature")
    assert np.abs(heights - stature["mean_mm"]).max() <= 3 * stature["sd_mm"]
    for name in SAMPLED:
        measure = row("ansur2", name, sex=sex)
        # At most 3 deviations by stature and 3 by the residual.
        most = 3 * (measure["r"] * measure["sd_mm"] + measure["see_mm"])
        off = np.abs(_values(adults, name) - measure["mean_mm"]).max()
        assert off <= most * (1 + 1e-12)
    bmi = _values(adults, "body_mass") / (heights / 1000) ** 2
    # The extremes of stature and residual together: 16.8 and 42.9 kg/m^2.
    assert bmi.min() > 16.5
    assert bmi.max() < 43.0
    for adult in adults[:200]:
        assert set(adult.lengths_m) == set(LIMB_SEGMENTS)
        body = segments(
            adult.stature_m, adult.mass_kg, adult.sex, lengths=adult.lengths_m
        )
        assert body["hand"].length_m == adult.lengths_m["hand"]


def test_people_of_one_stature_differ_by_the_stated_uncertainty(people):
    sex, adults = people
    spread = length_uncertainty(sex)
    offset = row("shoulder", "acromion_to_glenohumeral", sex=sex)["sd"]
    offset *= row("ansur2", "stature", sex=sex)["mean_mm"] / 1000
    count = 2000
    means = [expected_lengths(a.stature_m, sex) for a in adults[:count]]
    for name in LIMB_SEGMENTS:
        stated = spread[name]
        if name == "clavicle":
            # The unknown offset is the same for everybody, so it does not spread them;
            # it acts along the lateral part of the reach, more than 95 % of it.
            stated = math.sqrt(stated**2 - (0.975 * offset) ** 2)
        off = [
            adult.lengths_m[name] - mean[name]
            for adult, mean in zip(adults, means, strict=False)
        ]
        # SE of a deviation of `count`; lengths grow with stature (3.9 % SD, so 0.1 % in
        # quadrature); the clavicle's lateral share varies by less than 2 %.
        error = SIGMAS / math.sqrt(2 * count) + 0.02
        assert np.std(off) == pytest.approx(TRUNCATED_SD * stated, rel=error)
        assert np.mean(off) == pytest.approx(0, abs=SIGMAS * stated / math.sqrt(count))


def _values(adults, name):
    """One number of each adult, in the units of the table."""
    if name == "body_mass":
        return np.array([a.mass_kg for a in adults])
    if name == "stature":
        return 1000 * np.array([a.stature_m for a in adults])
    return 1000 * np.array([a.measures_m[name] for a in adults])
