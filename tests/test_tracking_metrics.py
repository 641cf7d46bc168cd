"""Metrics of a tracking trial against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import InvalidInput, NotEnoughData
from ikns.experiments.tracking import (
    CHARACTERS,
    Profile,
    TrackingRecord,
    draw_profile,
    error_over_time,
    lag,
    measure,
    overshoot,
    spectral_arc_length,
)

names = st.sampled_from(sorted(CHARACTERS))
seeds = st.integers(0, 10**6)
#: Each example is a whole trial.
few = settings(max_examples=12)


def record(profile, y, *, rate=100.0):
    """Trial in which the pointer's height is a function of time."""
    time = np.arange(-round(5 * rate), round(25 * rate) + 1) / rate
    return TrackingRecord(profile, time, profile.at(time), y(time) / 100, "done")


@given(names, seeds)
@few
def test_a_perfect_pointer_has_no_error_no_lag_and_the_target_s_smoothness(name, seed):
    profile = draw_profile(name, seed)
    found = measure(record(profile, profile.at))
    assert found.rmse < 1e-12  # 100 times the rounding of c
    assert found.mae < 1e-12
    assert abs(found.lag) < 1e-6
    assert found.correlation == pytest.approx(1)
    assert found.overshoot < 1e-12
    # Gradients of samples are off by 1e-4 / 6 of the third derivative.
    assert found.smoothness == pytest.approx(found.target_smoothness, abs=0.02)
    assert found.unseen == 0


@given(names, seeds, st.floats(0, 100))
@few
def test_a_still_pointer_has_the_target_s_own_root_mean_square(name, seed, level):
    profile = draw_profile(name, seed)
    found = measure(record(profile, lambda t: 0 * t + level))
    y = profile.at(np.arange(2501) / 100)
    variance, offset = np.var(y), np.mean(y) - level
    assert found.rmse == pytest.approx(np.sqrt(variance + offset**2))
    assert found.mae == pytest.approx(np.mean(np.abs(y - level)))
    assert np.isnan(found.lag)
    assert np.isnan(found.smoothness)


@given(names, seeds, st.floats(-0.3, 0.9), st.sampled_from([50.0, 100.0, 120.0]))
@few
def test_the_lag_of_a_delayed_copy_is_recovered(name, seed, delay, rate):
    profile = draw_profile(name, seed)
    found = measure(record(profile, lambda t: profile.at(t - delay), rate=rate))
    # Asked for: 20 ms. Near its peak the correlation is a parabola up to fourth order:
    # the peak between samples is right to a small part of a sample.
    assert found.lag == pytest.approx(delay, abs=2e-3)
    assert found.correlation > 0.999


@given(names, seeds, st.floats(0.05, 0.4))
@few
def test_the_lag_is_recovered_from_noise_and_from_a_pointer_of_another_gain(
    name, seed, delay
):
    profile = draw_profile(name, seed)
    noise = np.random.default_rng(seed).normal(0, 2, 3001)
    found = measure(record(profile, lambda t: 20 + 0.6 * profile.at(t - delay) + noise))
    # White noise of variance s^2 moves the peak by s sqrt(dt / sum of speed^2), of the
    # pointer: the slowest profile has a speed of 3 / s in root mean square over 25 s,
    # here times 0.6, so 2 * sqrt(0.01 / (3.24 * 25)) = 0.022 s at most; T2 and T3 have
    # a third of it. Five of a hundred thousand are beyond four of them.
    assert found.lag == pytest.approx(delay, abs=0.09)


@given(st.floats(0.5, 3.0), st.floats(-0.9, 0.9), st.floats(0, 6.28))
@few
def test_the_lag_of_a_sinusoid_is_its_phase(omega, part, phase):
    time = np.arange(2501) / 100
    half = np.pi / omega  # a period away it fits as well
    behind = part * half
    target, follower = (np.sin(omega * (time - b) + phase) for b in (0, behind))
    found, r = lag(target, follower, rate=100, longest=half)
    assert found == pytest.approx(behind, abs=2e-3)
    assert r == pytest.approx(1, abs=1e-3)


def test_signals_of_different_length_are_refused():
    with pytest.raises(InvalidInput):
        lag(np.arange(5.0), np.arange(6.0), rate=100)


def test_overshoot_after_each_move_is_recovered():
    profile = Profile(
        "T1",
        0,
        25.0,
        np.array([20.0, 60.0, 30.0, 80.0]),
        np.array([2.0, 9.0, 16.0]),
        np.array([3.0, 3.0, 3.0]),
    )
    time = np.arange(2501) / 100
    y = profile.at(time)
    for end, size in ((5.0, 7.0), (12.0, -4.0)):
        y += size * np.exp(-(((time - end - 1.0) / 0.3) ** 2))
    # The bump is one at a sample; its tail at the next move is exp(-100).
    assert overshoot(profile, time, y) == pytest.approx([7, 4, 0], abs=1e-9)
    late = profile.at(time - 0.4)
    assert overshoot(profile, time, late) == pytest.approx([0, 0, 0], abs=1e-9)


def gaussian_arc(width):
    """Arc length of the spectrum exp(-(2 pi f s)^2 / 2) down to 0.05."""
    highest = np.sqrt(2 * np.log(1 / 0.05)) / (2 * np.pi * width)
    f = np.linspace(0, highest, 100001)
    slope = (
        -((2 * np.pi * width) ** 2) * f * np.exp(-((2 * np.pi * f * width) ** 2) / 2)
    )
    return -np.trapezoid(np.sqrt(1 / highest**2 + slope**2), f)


@given(st.floats(0.1, 0.5), st.floats(0.1, 50.0))
def test_the_arc_length_of_a_gaussian_speed_is_that_of_its_spectrum(width, size):
    time = np.arange(1001) / 100 - 5.0
    speed = size * np.exp(-((time / width) ** 2) / 2)
    found = spectral_arc_length(speed, rate=100)
    # The spectrum's grid of 100 / 16384 Hz decides where it falls below 0.05: half of
    # a step out of at least 0.78 Hz, of a length of 1.4.
    assert found == pytest.approx(gaussian_arc(width), abs=0.01)


def test_a_movement_in_two_parts_is_less_smooth_than_one_and_sign_does_not_matter():
    time = np.arange(1001) / 100 - 5.0
    one = np.exp(-((time / 0.3) ** 2))
    two = one + np.roll(one, 150)
    assert spectral_arc_length(two, rate=100) < spectral_arc_length(one, rate=100)
    same = spectral_arc_length(-one, rate=100)
    assert same == spectral_arc_length(one, rate=100)


def test_errors_of_trials_come_on_one_time_axis():
    profile = draw_profile("T3", 1)
    trials = [
        record(profile, lambda t, b=bias: profile.at(t) + b, rate=rate)
        for bias, rate in ((1.0, 100.0), (-2.0, 60.0))
    ]
    time, error = error_over_time(trials)
    assert (time[0], time[-1], error.shape) == (0.0, 25.0, (2, 501))
    # Between samples 1/60 s apart: h^2 / 8 of an acceleration of at most
    # 5.77 * 60 / (3.5 s)^2 per s^2.
    np.testing.assert_allclose(error[0], 1.0, atol=1e-3)
    np.testing.assert_allclose(error[1], -2.0, atol=1e-2)


def test_a_trial_broken_off_has_no_error_afterwards_and_no_metrics_if_too_short():
    profile = draw_profile("T3", 1)
    whole = record(profile, profile.at)

    def first(n):
        return TrackingRecord(
            profile, whole.time[:n], whole.target[:n], whole.c[:n], "aborted"
        )

    _, error = error_over_time([first(1001)])
    assert np.isfinite(error[0, :101]).all()
    assert np.isnan(error[0, 101:]).all()
    assert measure(first(1001)).samples == 501
    for n in (0, 1, 550):
        with pytest.raises(NotEnoughData):
            measure(first(n))
    with pytest.raises(InvalidInput):
        error_over_time([])


def test_what_was_not_seen_is_counted():
    profile = draw_profile("T1", 1)
    whole = record(profile, profile.at)
    c = np.where((whole.time >= 5) & (whole.time < 10), np.nan, whole.c)
    gap = TrackingRecord(profile, whole.time, whole.target, c, "done")
    assert measure(gap).unseen == 500 / 2501
    assert measure(gap).samples == 2501
