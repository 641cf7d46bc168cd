"""Faults through the whole chain, and whether the safety page tells the truth."""

import importlib
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.finger import SAFE_STATES, Limiter, Limits, Safety, SimulatedFinger

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

# Imported by name: the benchmarks are no package of ours.
chain = importlib.import_module("live.chain")
person = importlib.import_module("live.person")
PLACES = {
    name: importlib.import_module(f"live.{name}_faults")
    for name in ("stream", "servo", "process")
}
sys.path.remove(str(ROOT / "benchmarks"))

SAFETY = (ROOT / "SAFETY.md").read_text(encoding="utf-8")


# --- the safety page -----------------------------------------------------------------


def test_every_test_that_the_safety_page_names_exists() -> None:
    named = re.findall(r"`(test_\w+\.py)::(test_\w+)`", SAFETY)
    assert len(named) > 20
    for file, name in named:
        text = (ROOT / "tests" / file).read_text(encoding="utf-8")
        assert re.search(rf"^ *def {name}\(", text, re.MULTILINE), f"{file}::{name}"


def test_every_hazard_has_a_mitigation_a_place_and_a_test() -> None:
    table = SAFETY.partition("## Hazards")[2].partition("## Not covered")[0]
    rows = [line for line in table.splitlines() if line.startswith("| ")][1:]
    assert len(rows) > 10
    for row in rows:
        hazard, mitigation, where, test = row.strip("| ").split(" | ")
        assert hazard
        assert mitigation
        assert "](" in where
        assert "::test_" in test


def test_every_file_that_the_safety_page_names_exists() -> None:
    for path in re.findall(r"\]\(([^)#:]+)\)", SAFETY):
        assert (ROOT / path).exists(), path


def test_the_safety_page_says_what_this_is_not() -> None:
    assert "research software, not a medical device" in SAFETY


# --- what counts as beyond a limit ---------------------------------------------------

LIMITS = Limits(rate=2.0, acceleration=20.0)


def told(times: list[float], sent: list[float]) -> list:
    return [chain.Told(t, t, s, np.nan) for t, s in zip(times, sent, strict=True)]


@given(
    st.lists(
        st.tuples(st.floats(-0.5, 1.5) | st.just(np.nan), st.floats(1e-4, 0.3)),
        min_size=1,
        max_size=60,
    )
)
def test_what_the_limiter_sends_counts_as_within_limits(steps) -> None:
    limiter = Limiter(LIMITS, 0.5)
    now, times, sent = 0.0, [0.0], [0.5]
    for target, dt in steps:
        times.append(now + dt)
        # As the finger sees it, rounded where times are large.
        sent.append(limiter.step(target, times[-1] - now))
        now = times[-1]
    assert chain.violations(told(times, sent), LIMITS, 0.0) == 0


@given(
    st.sampled_from(SAFE_STATES),
    st.lists(
        st.tuples(
            st.floats(0, 1) | st.just(np.nan),
            st.floats(1e-4, 0.3),
            st.floats(1e-4, 0.05),
            st.booleans(),
        ),
        min_size=1,
        max_size=60,
    ),
)
def test_what_a_finger_does_counts_as_within_limits(safe_state, steps) -> None:
    # It moves when asked for its state, too, while it opens or holds.
    now = 0.0
    safety = Safety(limits=LIMITS, safe_state=safe_state)
    with SimulatedFinger(safety=safety, flexion=0.5, clock=lambda: now) as finger:
        record = []
        for flexion, dt, wait, fails in steps:
            now += dt
            if fails:
                finger.make_safe("a fault")
            sent, then = finger.command(flexion), now
            now += wait
            record.append(chain.Told(then, then, sent, finger.state().flexion))
    assert chain.violations(record, LIMITS, 0.0, between=True) == 0


@pytest.mark.parametrize(
    ("sent", "beyond"),
    [
        ([0.0, 0.0, 1.1], "range"),
        # 2 per second are 0.02 in 10 ms.
        ([0.0, 0.0, 0.021], "rate"),
        # From rest 20 per second squared reach 0.2 per second in 10 ms, 0.002.
        ([0.0, 0.0, 0.0021], "acceleration"),
        ([0.5, 0.52, 0.54, 0.54], "braking"),
    ],
)
def test_what_is_beyond_a_limit_is_counted(sent, beyond) -> None:
    times = [0.01 * k for k in range(len(sent))]
    assert chain.violations(told(times, sent), LIMITS, 0.0) > 0, beyond


def test_what_is_far_beyond_is_counted_whatever_happens_between() -> None:
    # In 15 ms 20 per second squared reach 0.3 per second, 0.003 in 10 ms.
    for last in (0.0031, 0.021, 1.1):
        record = told([0.0, 0.01, 0.02], [0.0, 0.0, last])
        assert chain.violations(record, LIMITS, 0.0, between=True) > 0


# --- the chain -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("live")
    person.make(place, 1, point_seconds=1.0)
    return place


@pytest.mark.parametrize(
    ("place", "fault"),
    [
        ("stream", "silence, 1 s"),
        ("stream", "frozen picture, 1 s"),
        ("stream", "a marker 1 m astray, 1 s"),
        ("stream", "device time missing, 1 s"),
        ("servo", "servo silent, 1 s"),
        ("servo", "hardware alert"),
        ("process", "exception in a callback"),
    ],
)
def test_a_fault_anywhere_in_the_chain_ends_as_stated(folder, place, fault) -> None:
    outcome = PLACES[place].strike(fault, 0, folder)
    assert outcome.violated == 0
    assert outcome.session == ""
    assert outcome.remarks == ()
    assert outcome.ended == outcome.expected
    # How late a busy machine may be is for the benchmark to tell.
    for name, stated in outcome.promised.items():
        assert outcome.seconds[name] < stated + 0.5
