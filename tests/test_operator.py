"""Virtual operators: linear parts against transfer functions, noise by theory."""

import tomllib
from dataclasses import fields, replace
from importlib.resources import files

import numpy as np
import pytest
from delayed_copy import DelayedCopy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from ikns.errors import InvalidInput
from ikns.experiments.tracking import CHARACTERS, draw_profile, measure, virtual_trial
from ikns.simulation.operator import (
    CONDITIONS,
    Ability,
    Delay,
    Operator,
    phase_margin,
    sample_abilities,
    track,
    typical,
)
from ikns.simulation.operator.ability import LEAST_MARGIN, parameters
from ikns.simulation.operator.model import discrete_step

#: Nothing is cut off.
FREE = (-np.inf, np.inf)
able = typical().noiseless()


def open_loop(ability, omega, *, latency=0.0):
    """Transfer function of person and device, from error to pointer."""
    s = 1j * omega
    w, z = ability.limb_frequency, ability.limb_damping
    limb = w**2 / (s**2 + 2 * z * w * s + w**2)
    return ability.crossover / s * limb * np.exp(-(ability.delay + latency) * s)


def closed_loop(ability, omega, *, latency=0.0):
    """Transfer function from target to pointer: ``L exp(preview s) / (1 + L)``."""
    L = open_loop(ability, omega, latency=latency)
    return L * np.exp(1j * ability.preview * omega) / (1 + L)


def response(ability, omega, rate, *, latency=0.0):
    """Steady response to a sinusoid: what comes out over what goes in, complex."""
    operator = Operator(ability, rate=rate, seed=0, start=0.0, limits=FREE)
    # 30 s to settle (the slowest pole is faster than 1/s), then whole periods.
    periods = max(2, round(omega * 20 / (2 * np.pi)))
    end = 30.0 + periods * 2 * np.pi / omega
    done = track(
        operator,
        lambda t: np.sin(omega * np.asarray(t)),
        Delay(latency, rate=rate),
        start=0.0,
        end=end,
    )
    late = done.time >= 30.0
    columns = np.exp(1j * omega * done.time[late])
    basis = np.column_stack([columns.real, columns.imag])
    (cosine, sine), *_ = np.linalg.lstsq(basis, done.c[late], rcond=None)
    return complex(sine, cosine)  # of sin(wt + phase): gain exp(i phase)


@pytest.mark.parametrize("omega", [0.3, 1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("delay", [0.2, 0.1234])
def test_the_closed_loop_responds_as_its_transfer_function_says(omega, delay):
    ability = replace(able, delay=delay)
    wanted = closed_loop(ability, omega)
    found = response(ability, omega, 100.0)
    # The error is taken straight between samples, twice where the delay falls between
    # them: each is off by (w dt)^2 / 8 of the open loop at most, so the closed loop by
    # 2 (w dt)^2 / 8 / |1 + L| of itself.
    off = 2 * (omega / 100) ** 2 / 8 / abs(1 + open_loop(ability, omega))
    assert abs(found - wanted) < off * abs(wanted) + 1e-6


def test_latency_of_the_device_is_part_of_the_loop():
    found = response(able, 2.0, 100.0, latency=0.05)
    # As above, and one sample less does not pass: exp(0.02 j) is off by 2 %.
    assert abs(found - closed_loop(able, 2.0, latency=0.05)) < 1e-3


@pytest.mark.parametrize("omega", [1.0, 5.0, 20.0])
@pytest.mark.parametrize("rate", [25.0, 100.0])
def test_the_discrete_system_is_exact(omega, rate):
    """Against the z-transform of limb and delay, written down independently."""
    ability = replace(able, delay=0.21, preview=0.3)
    A, B0, B1 = discrete_step(ability, rate)
    z = np.exp(1j * omega / rate)
    limb = np.linalg.solve(z * np.eye(3) - A, B0 + B1 * z)[1]
    whole = int(0.21 * rate)
    part = 0.21 * rate - whole
    late = (1 - part) * z**-whole + part * z ** -(whole + 1)
    L = limb * late
    wanted = L * np.exp(1j * omega * 0.3) / (1 + L)
    assert abs(response(ability, omega, rate) - wanted) < 1e-8


def test_the_step_is_exact_for_a_straight_error():
    rate, w, z = 20.0, able.limb_frequency, able.limb_damping
    A, B0, B1 = discrete_step(able, rate)
    x = np.zeros(3)
    for k in range(400):
        x = A @ x + B0 * (1 + 0.5 * k / rate) + B1 * (1 + 0.5 * (k + 1) / rate)
    t = 400 / rate
    # du/dt = g (1 + t / 2): u = g (t + t^2 / 4). The limb follows a parabola, once its
    # own swing has died out, behind by 2 z / w of its speed and so on.
    g, b, c = able.crossover, 2 * z / w, 1 / w**2
    u, du, ddu = g * (t + t**2 / 4), g * (1 + t / 2), g / 2
    p = u - b * du + (b**2 - c) * ddu
    np.testing.assert_allclose(x, [u, p, du - b * ddu], rtol=1e-9)


def test_a_still_target_is_reached_and_a_ramp_is_followed_at_the_distance_of_theory():
    operator = Operator(able, rate=100, seed=0, start=0.0, limits=FREE)
    slope = 0.1
    done = track(operator, lambda t: slope * t, Delay(0, rate=100), start=0.0, end=40.0)
    # Error of the ramp: du/dt = slope = g e, seen with the preview added.
    wanted = slope / able.crossover - slope * able.preview
    assert done.target[-1] - done.c[-1] == pytest.approx(wanted, abs=1e-6)


def test_remnant_has_the_stated_size_and_bandwidth():
    ability = replace(able, remnant=0.03)
    operator = Operator(ability, rate=50, seed=3, start=0.0, limits=FREE)
    still = track(operator, lambda t: 0 * t, Delay(0, rate=50), start=0, end=1000.0)

    def power(omega):
        noise = 2 * 0.03**2 * 3.0 / (omega**2 + 3.0**2)
        to_pointer = open_loop(replace(ability, delay=1e-12), omega)
        return noise * abs(to_pointer / (1 + open_loop(ability, omega))) ** 2

    variance = quad(power, 1e-6, 100, limit=500)[0] / np.pi
    # Over 1000 s with a correlation time of about a second the standard deviation is
    # known to 1 / sqrt(2 * 1000) = 2.2 %; four of them.
    assert still.c.std() == pytest.approx(np.sqrt(variance), rel=0.09)


def test_signal_dependent_noise_is_absent_at_rest_and_grows_with_the_command():
    ability = replace(able, signal_noise=0.2)

    def spread(slope):
        operator = Operator(ability, rate=100, seed=1, start=0.0, limits=FREE)
        noisy = track(
            operator, lambda t: slope * t, Delay(0, rate=100), start=0, end=60
        )
        return np.std((noisy.target - noisy.c)[noisy.time > 20])

    assert spread(0.0) == 0
    one, two = spread(0.05), spread(0.1)
    assert one > 0
    # Everything is proportional to the command, in the same draws.
    assert two / one == pytest.approx(2, rel=1e-9)


def test_noise_does_not_depend_on_the_sampling():
    ability = replace(able, remnant=0.03)
    sizes = []
    for rate in (25.0, 75.0):
        operator = Operator(ability, rate=rate, seed=3, limits=FREE)
        done = track(operator, lambda t: 0 * t, Delay(0, rate=rate), start=0, end=500)
        sizes.append(done.c.std())
    # 3.2 % each as above; straight for 40 ms, noise of 3 rad/s loses 2 %.
    assert sizes[0] == pytest.approx(sizes[1], rel=4 * np.hypot(0.032, 0.032) + 0.02)


@given(st.integers(0, 10**6), st.sampled_from(sorted(CHARACTERS)))
@settings(max_examples=5)
def test_who_looks_ahead_less_is_behind_by_as_much(seed, name):
    profile = draw_profile(name, seed)
    found = []
    for preview in (0.25, 0.10):
        operator = Operator(replace(able, preview=preview), rate=50, seed=0)
        record = virtual_trial(operator, Delay(0, rate=50), profile)
        found.append(measure(record).lag)
    # The loop is the same, only later. 20 ms are asked for.
    assert found[1] - found[0] == pytest.approx(0.15, abs=0.02)


@given(st.integers(0, 10**6), st.sampled_from(sorted(CHARACTERS)), st.integers(0, 40))
@settings(max_examples=10)
def test_a_delayed_copy_has_no_error_but_its_delay(seed, name, samples):
    profile = draw_profile(name, seed)
    delay = samples / 50
    record = virtual_trial(DelayedCopy(delay, rate=50), Delay(0, rate=50), profile)
    found = measure(record)
    late = profile.at(np.arange(1251) / 50 - delay)
    wanted = np.sqrt(np.mean((late - profile.at(np.arange(1251) / 50)) ** 2))
    assert found.rmse == pytest.approx(wanted, abs=1e-9)
    assert found.lag == pytest.approx(delay, abs=0.02)


def test_an_operator_that_keeps_still_has_the_target_s_own_root_mean_square():
    profile = draw_profile("T2", 8)
    still = DelayedCopy(0.0, rate=50, gain=0.0, start=0.4)
    found = measure(virtual_trial(still, Delay(0, rate=50), profile))
    y = profile.at(np.arange(1251) / 50)
    assert found.rmse == pytest.approx(np.sqrt(np.mean((y - 40) ** 2)))


def test_what_is_not_seen_stands_still_and_limits_are_kept():
    operator = Operator(able, rate=100, seed=0, start=0.5)
    places = [operator.step(3.0, np.nan if k % 2 else 0.5) for k in range(500)]
    assert max(places) == 1.0
    assert min(places) >= 0.5 - 1e-9
    # The wish did not wind up: back within the delay, the limb and 0.05 of slack.
    back = [operator.step(0.0, 1.0) for _ in range(60)]
    assert back[-1] < 1.0
    blind = Operator(able, rate=100, seed=0, start=0.5)
    assert [blind.step(0.9, np.nan) for _ in range(100)] == pytest.approx([0.5] * 100)


def test_same_seed_same_noise():
    def one(seed):
        operator = Operator(typical(), rate=50, seed=seed)
        return [operator.step(0.6, 0.5) for _ in range(50)]

    assert one(1) == one(1) != one(2)


# --- ability --------------------------------------------------------------------------


def test_every_parameter_has_unit_limits_and_source():
    table = parameters()
    assert set(table) == {field.name for field in fields(Ability)}
    for row in table.values():
        assert row["low"] <= row["mean"] <= row["high"]
        assert row["unit"]
        assert any(w in row["source"] for w in ("recalled", "stated", "assumption"))
    text = files("ikns.simulation.operator").joinpath("parameters.toml").read_text()
    assert set(tomllib.loads(text)) == set(table) | {"gamepad"}


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_cohort_lies_in_the_limits_and_keeps_its_phase_margin(condition):
    table = parameters(condition)
    cohort = sample_abilities(300, seed=0, condition=condition)
    for name, row in table.items():
        values = np.array([getattr(person, name) for person in cohort])
        assert (values >= row["low"]).all()
        assert (values <= row["high"]).all()
        assert np.std(values) > 0 or row["sd"] == 0
    margins = [phase_margin(person, latency=0.05) for person in cohort]
    assert min(margins) >= LEAST_MARGIN
    assert sample_abilities(3, seed=0, condition=condition) == cohort[:3]


def test_a_person_keeps_the_rank_with_another_device():
    elbow, stick = (
        np.array([p.remnant for p in sample_abilities(200, seed=4, condition=c)])
        for c in CONDITIONS
    )
    # The same luck unless a draw was repeated for one device alone.
    assert np.corrcoef(elbow, stick)[0, 1] > 0.6


def test_the_phase_margin_is_where_the_loop_crosses_one():
    omega = np.linspace(0.5, 8, 200001)
    L = open_loop(able, omega, latency=0.03)
    at = np.argmin(np.abs(np.abs(L) - 1))
    margin = np.pi + np.unwrap(np.angle(L))[at]
    # The grid: 4e-5 rad/s times a group delay of 0.4 s.
    assert phase_margin(able, latency=0.03) == pytest.approx(margin, abs=1e-4)


def test_practice_reduces_noise_exponentially():
    person = typical()
    extra = [person.practised(k).remnant / person.remnant - 1 for k in (0, 6, 12)]
    assert extra == pytest.approx([0.3, 0.3 / np.e, 0.3 / np.e**2])
    assert person.practised(1e3).remnant == pytest.approx(person.remnant)


@pytest.mark.parametrize(
    "wrong", [{"crossover": 0.0}, {"delay": -0.1}, {"remnant": np.nan}]
)
def test_impossible_people_are_refused(wrong):
    with pytest.raises(InvalidInput, match=next(iter(wrong))):
        replace(able, **wrong)


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInput, match="rate"):
        Operator(able, rate=4.0, seed=0)
    with pytest.raises(InvalidInput, match="condition"):
        typical("mouse")
    with pytest.raises(InvalidInput, match="delay"):
        Delay(-1.0, rate=100)
    with pytest.raises(InvalidInput, match="end"):
        track(
            Operator(able, rate=100, seed=0), np.sin, Delay(0, rate=100), start=0, end=0
        )
    with pytest.raises(InvalidInput, match="latency"):
        sample_abilities(1, seed=0, latency=2.0)
