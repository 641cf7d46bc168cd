"""Counts agree with a brute-force count, however a stream is torn."""

import math
from collections.abc import Sequence
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.live.stream import Continuity, Frame
from ikns.live.stream.lsl_numbers import Numbers

PERIOD = 0.01


def frame(number: int, delay: float = 0.0, *, content: float | None = None) -> Frame:
    at = number * PERIOD
    markers = np.full((2, 3), float(number) if content is None else content)
    return Frame(number, at, at + delay, markers)


def watched(frames: Sequence[Frame], **options: float) -> Continuity:
    continuity = Continuity(1 / PERIOD, **options)
    for each in frames:
        continuity.add(each)
    return continuity


@st.composite
def torn(draw: st.DrawFn) -> list[int]:
    """Numbers of a stream: some dropped, some repeated, all shuffled a little."""
    start = draw(st.integers(-5, 5))
    kept = draw(st.lists(st.integers(0, 3), min_size=1, max_size=60))
    numbers = [start + k for k, copies in enumerate(kept) for _ in range(copies)]
    return draw(st.permutations(numbers)) if draw(st.booleans()) else numbers


@given(torn())
def test_counts_equal_those_of_all_numbers_seen_at_once(numbers: list[int]) -> None:
    counts = watched([frame(n) for n in numbers]).counts
    distinct = set(numbers)
    span = max(distinct) - min(distinct) + 1 if numbers else 0
    highest, late_comers, seen = -math.inf, 0, set[int]()
    for n in numbers:
        late_comers += n not in seen and n < highest
        highest = max(highest, n)
        seen.add(n)
    assert counts.received == len(numbers)
    assert counts.dropped == span - len(distinct)
    assert counts.repeated == len(numbers) - len(distinct)
    assert counts.out_of_order == late_comers
    assert counts.restarts == 0


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=100))
def test_lateness_is_the_delay_above_the_smallest_so_far(delays: list[float]) -> None:
    counts = watched([frame(n, d) for n, d in enumerate(delays)], late_after=0.5).counts
    # The delay is recovered from sums of numbers below 2, hence within a few 1e-16.
    lateness = np.array(delays) - np.minimum.accumulate(delays)
    sure = (lateness > 0.5 + 1e-14).sum(), (lateness > 0.5 - 1e-14).sum()
    assert sure[0] <= counts.late <= sure[1]
    assert counts.jitter["largest"] == pytest.approx(lateness.max(), abs=1e-14)
    # Percentiles are upper edges of bins 6 % wide, not below 1 us.
    median = np.percentile(lateness, 50, method="inverted_cdf")
    assert counts.jitter["p50"] >= median - 1e-14
    assert counts.jitter["p50"] <= max(1.06 * median, 1e-6)


def test_clocks_that_drift_apart_make_no_frame_late() -> None:
    # 100 ppm for 300 s is 30 ms, three periods; within the window of 60 s it is 6 ms.
    there = np.zeros((1, 3))
    frames = [Frame(n, n * PERIOD, n * PERIOD * 1.0001, there) for n in range(30_000)]
    counts = watched(frames).counts
    assert counts.late == 0
    assert counts.jitter["largest"] < 60 * 1e-4 + 1e-9


def test_memory_does_not_grow_with_the_holes() -> None:
    continuity = watched([frame(n) for n in range(0, 20_000, 2)])
    assert continuity.counts.dropped == 9_999
    assert len(continuity._gaps) <= 256


def test_a_device_that_counts_anew_starts_a_new_section() -> None:
    # Ten seconds at the 100 frames per second of these tests, and a bit over one.
    for back in (1000, 101):
        numbers = [*range(5000, 5010), *range(5009 - back, 5019 - back)]
        counts = watched([frame(n) for n in numbers]).counts
        assert (counts.restarts, counts.dropped, counts.out_of_order) == (1, 0, 0)
        assert (counts.received, counts.repeated) == (20, 0)


def test_same_markers_under_a_new_number_are_frozen_and_unseen_ones_are_not() -> None:
    frames = [frame(0), frame(1, content=7.0), frame(2, content=7.0), frame(3)]
    assert watched(frames).counts.frozen == 1
    unseen = [frame(n, content=math.nan) for n in range(5)]
    assert watched(unseen).counts.frozen == 0


def test_at_no_pace_nothing_is_late() -> None:
    counts = watched([frame(n, delay=n) for n in range(100)], speed=0).counts
    assert counts.late == 0
    assert math.isnan(counts.jitter["p99"])


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf])
def test_a_stream_must_have_a_rate(rate: float) -> None:
    with pytest.raises(InvalidInput, match="rate above 0"):
        Continuity(rate)


@given(torn(), st.floats(50, 1000), st.randoms(use_true_random=False))
def test_stamps_on_the_beat_give_the_numbers(
    numbers: list[int], rate: float, rng: Random
) -> None:
    # Two stamps each off by 12 % of a period are apart by less than 25 % off.
    stamps = [1e5 + (n + rng.uniform(-0.12, 0.12)) / rate for n in numbers]
    made = Numbers(rate)
    assert [made.next(s) for s in stamps] == [n - numbers[0] for n in numbers]
    assert not made.uneven


def test_stamps_off_the_beat_are_counted_until_they_are_on_it_again() -> None:
    rng = np.random.default_rng(2)
    made = Numbers(100)
    at = (np.arange(500) + rng.uniform(0, 0.9, 500)) / 100
    assert [made.next(s) for s in at] == list(range(500))
    assert made.uneven
    steady = 6 + np.arange(200) / 100
    before = [made.next(s) for s in steady]
    assert not made.uneven
    assert made.next(steady[-1] + 0.03) == before[-1] + 3
    assert made.next(steady[-1] + 5.03) == before[-1] + 503


def test_a_frame_without_time_is_counted_but_neither_late_nor_on_time() -> None:
    frames = [frame(0), frame(1), frame(2)]
    nowhere = Frame(3, math.nan, 0.03, np.ones((2, 3)))
    counts = watched([*frames, nowhere, frame(4)]).counts
    assert (counts.received, counts.dropped, counts.late) == (5, 0, 0)
    assert counts.jitter["largest"] == 0.0
