"""The ends of a sweep with noise: those of the motion, whatever the noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ikns.errors import InvalidInput
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import IntentMap
from ikns.nullspace.readout.ends import local_quadratic, robust_mean, swept_ends

CORNERS = 0.3 * np.array(list(np.ndindex(2, 2, 2))) + [0.1, -0.3, 0.0]
TIME = np.arange(500) / 100


def sweep(rng: np.random.Generator) -> np.ndarray:
    """A sine of two to four periods in 5 s that does not turn at its edges."""
    hertz = rng.integers(2, 5) / 5
    return np.sin(2 * np.pi * hertz * TIME + rng.uniform(-0.5, 0.5))


@given(st.integers(0, 1000), st.floats(0.01, 0.1))
@settings(max_examples=40)
def test_noise_moves_the_ends_by_little(seed, noise):
    rng = np.random.default_rng(seed)
    found = swept_ends(sweep(rng) + noise * rng.normal(size=500), TIME)
    # 31 samples a window leave 9 / (4 * 31) of the variance, 0.27 of the noise; two to
    # eight turning points scatter by that, and the larger of them counts: 4 of it.
    assert abs(found.upper - 1) < 4 * 0.27 * noise + 1e-3
    assert abs(found.lower + 1) < 4 * 0.27 * noise + 1e-3
    # 500 residuals: the median deviation is known to some 5 %.
    assert np.isclose(found.noise, noise, rtol=0.25)


def test_the_width_is_right_on_average_where_extremes_are_not():
    rng = np.random.default_rng(0)
    honest, plain = [], []
    for _ in range(40):
        noisy = sweep(rng) + 0.1 * rng.normal(size=500)
        found = swept_ends(noisy, TIME)
        honest.append((found.upper - found.lower) / 2)
        plain.append(np.ptp(noisy) / 2)
    # A gain of 0.97 to 1.03 was asked for; extremes of 500 samples have 0.8.
    assert abs(np.mean(honest) - 1) < 0.02
    assert np.mean(plain) > 1.15


@given(st.integers(0, 1000), st.floats(0.1, 10), st.floats(-5, 5))
@settings(max_examples=20)
def test_ends_follow_a_shift_and_a_scale(seed, scale, shift):
    rng = np.random.default_rng(seed)
    values = sweep(rng) + 0.1 * rng.normal(size=500)
    found, other = swept_ends(values, TIME), swept_ends(scale * values + shift, TIME)
    assert np.allclose(other[:2], scale * np.array(found[:2]) + shift, atol=1e-6)
    # The draws of noise are not mirrored: what they say of 40 differs.
    mirrored = swept_ends(-values, TIME)
    assert np.allclose(mirrored[:2], [-found.upper, -found.lower], atol=0.03)


@given(
    arrays(float, st.integers(1, 40), elements=st.floats(-1e3, 1e3)),
    st.sampled_from([0.01, 0.1, 1.0]),
)
@settings(max_examples=40)
def test_whatever_comes_has_finite_ends(values, step):
    found = swept_ends(values, step * np.arange(len(values)))
    assert np.isfinite(found).all()
    assert found.lower <= found.upper
    assert found.noise >= 0


@given(st.integers(0, 1000))
def test_a_quadratic_stays_what_it_is_gaps_or_not(seed):
    rng = np.random.default_rng(seed)
    time = TIME[np.sort(rng.choice(500, 300, replace=False))]
    values = rng.normal(size=3) @ [time**0, time, time**2]
    smooth, share = local_quadratic(values, time)
    assert np.allclose(smooth, values, atol=1e-6)  # sums of terms up to 25 * 3
    assert ((share > 0) & (share <= 1 + 1e-9)).all()


def test_a_jump_of_a_frame_is_no_end():
    rng = np.random.default_rng(1)
    values = sweep(rng) + 0.01 * rng.normal(size=500)
    jumped = np.array(values)
    jumped[[100, 333]] = [5.0, -7.0]
    assert np.allclose(swept_ends(jumped, TIME)[:2], [-1, 1], atol=0.03)


def test_few_samples_are_their_own_ends():
    assert swept_ends([0.3, 0.1, 0.2], [0.0, 1.0, 2.0]) == (0.1, 0.3, 0.0)
    assert swept_ends([0.3], [0.0]) == (0.3, 0.3, 0.0)


@pytest.mark.parametrize(
    ("values", "time"),
    [([], []), ([1.0], [1.0, 2.0]), ([1.0, 2.0], [1.0, 1.0]), ([np.nan, 1], [0.0, 1])],
)
def test_what_is_no_series_is_refused(values, time):
    with pytest.raises(InvalidInput, match="expected"):
        swept_ends(values, time)


def test_intent_has_gain_one_where_times_are_known():
    rng = np.random.default_rng(3)
    wrist = np.repeat(CORNERS, 500, axis=0) + rng.normal(scale=2e-3, size=(4000, 3))
    true = np.concatenate([0.6 * sweep(rng) for _ in CORNERS])
    measured = NaturalPosture.of_people().swivel(wrist) + true
    measured += 0.05 * rng.normal(size=4000)
    time, places = np.arange(4000) / 100, np.repeat(np.arange(8), 500)
    c = {}
    for name, known in (("honest", {"time": time}), ("plain", {})):
        intent = IntentMap(8).fit(wrist, measured, groups=places, **known)
        c[name] = np.polyfit(
            (true + 0.6) / 1.2, intent.control_signal(measured[:, None], wrist), 1
        )
    # Of 16 ends each is off by some 0.02 of 1.2; what was asked is 0.03.
    assert abs(c["honest"][0] - 1) < 0.02
    assert abs(c["honest"][1]) < 0.01
    assert c["plain"][0] < 0.9
    with pytest.raises(InvalidInput, match="4000 finite times"):
        IntentMap(8).fit(wrist, measured, time=time[:5])


@given(st.integers(0, 1000), st.floats(-1e3, 1e3))
@settings(max_examples=30)
def test_the_mean_over_places_forgets_one_that_is_far_off(seed, far):
    rng = np.random.default_rng(seed)
    agreeing = rng.normal(size=9)
    found = robust_mean([*agreeing, 100.0 + abs(far)])
    assert np.isclose(found, robust_mean([*agreeing, 1e6]), atol=1e-9)
    # Nine normal values: their mean is known to a third, twice to be safe, and the
    # median beside it.
    assert abs(found - agreeing.mean()) < 1.0


@given(arrays(float, st.integers(1, 12), elements=st.floats(-1e3, 1e3)))
def test_the_robust_mean_lies_among_the_values_and_moves_with_them(values):
    found = robust_mean(values)
    assert values.min() - 1e-9 <= found <= values.max() + 1e-9
    assert np.isclose(robust_mean(values + 5.0), found + 5.0, atol=1e-6) or (
        # Rounding may turn a spread of exactly zero into one that is not.
        np.median(np.abs(values - np.median(values))) < 1e-9
    )
    assert robust_mean([values[0]] * 3) == values[0]
