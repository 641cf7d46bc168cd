"""The time left of a study, against what then happens, on a clock that we turn."""

import heapq
from typing import NamedTuple

from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.experiments.study.time_left import Kind, TimeLeft


class Sample(NamedTuple):
    """What the bar said at a time, and how long it took from there."""

    share_of_time: float
    share: float
    said: float | None
    took: float


def watch(
    tasks: list[tuple[Kind, dict[str, float]]], workers: int, *, steps: int = 40
) -> list[Sample]:
    """Do tasks of known cost, each by the first worker that is free, and watch."""
    free = [(0.0, k) for k in range(workers)]
    ends = []
    for number, (_, costs) in enumerate(tasks):
        begun, who = heapq.heappop(free)
        end = begun + sum(costs.values())
        heapq.heappush(free, (end, who))
        ends.append((end, number))
    last = max(ends)[0]
    now = 0.0
    left = TimeLeft((kind for kind, _ in tasks), clock=lambda: now)
    left.take_workers(workers)
    events = sorted([*ends, *((last * k / steps, -1) for k in range(steps))])
    said = []
    for time, number in events:
        now = time
        if number >= 0:
            left.done(*tasks[number])
        said.append((time, left.share(), left.seconds()))
    return [Sample(t / last, share, s, last - t) for t, share, s in said]


def wrong(samples: list[Sample], slack: float = 0.0) -> list[Sample]:
    """From 20 % on, by the bar and by the clock, said to be off by more than twice.

    A task that is nearly over is said to take a twentieth of its time: `slack`.
    """
    return [
        s
        for s in samples
        if min(s.share, s.share_of_time) >= 0.2
        and s.took > 1e-9
        and (s.said is None or not s.took / 2 <= s.said <= 2 * s.took + slack)
    ]


def study(
    people: int, costs: dict[str, dict[str, float]], *, half: bool = False
) -> list[tuple[Kind, dict[str, float]]]:
    """Tasks as a study orders them, one of each kind first.

    Of `half` the people tracking is there already.
    """
    tasks = []
    for number in range(people):
        for variation, parts in costs.items():
            own = dict(parts)
            if half and number < people // 2:
                own.pop("tracking", None)
            tasks.append(((variation, tuple(own)), own))
    first = {kind: number for number, (kind, _) in reversed(list(enumerate(tasks)))}
    ahead = sorted(first.values())
    return [tasks[k] for k in [*ahead, *sorted({*range(len(tasks))} - {*ahead})]]


#: So many tasks for each worker that one of every kind is done in a fifth of the time:
#: before, nobody can know what it costs.
COST = st.floats(0.5, 20.0)
PARTS = st.fixed_dictionaries({"person": COST, "tracking": COST, "picking": COST})


@settings(max_examples=50, deadline=None)
@given(
    parts=PARTS,
    rounds=st.integers(10, 25),
    workers=st.integers(1, 4),
    half=st.booleans(),
)
def test_time_left_is_right_within_a_factor_of_two_from_a_fifth_on(
    parts: dict[str, float], rounds: int, workers: int, half: bool
) -> None:
    samples = watch(study(rounds * workers, {"": parts}, half=half), workers)
    assert wrong(samples, sum(parts.values()) / 20) == []
    assert samples[-1].share == 1.0
    assert samples[-1].said == 0.0


@settings(max_examples=30, deadline=None)
@given(usual=PARTS, dear=PARTS, rounds=st.integers(10, 25), workers=st.integers(1, 3))
def test_so_it_is_where_a_variation_costs_more_than_the_rest(
    usual: dict[str, float], dear: dict[str, float], rounds: int, workers: int
) -> None:
    more = {part: 5 * cost for part, cost in dear.items()}
    samples = watch(study(rounds * workers, {"": usual, "rate": more}), workers)
    assert wrong(samples, sum(more.values()) / 20) == []


def test_the_count_of_visits_alone_would_be_wrong() -> None:
    """The oracle sees a bad bar: one that takes all parts for equally long."""
    tasks = study(10, {"": {"person": 1.0, "tracking": 1.0, "picking": 20.0}})
    cheap = [(("", ("tracking",)), {"tracking": 1.0})] * 10
    last = sum(sum(costs.values()) for _, costs in [*cheap, *tasks])
    by_count, done = [], 0.0
    for number, (_, costs) in enumerate([*cheap, *tasks], start=1):
        done += sum(costs.values())
        said = done / number * (20 - number)
        by_count.append(Sample(done / last, 1.0, said, last - done))
    assert len(wrong(by_count)) > 1


def test_workers_that_come_and_go_are_counted() -> None:
    now = 0.0
    kinds: list[Kind] = [("", ("person",))] * 20
    left = TimeLeft(kinds, clock=lambda: now)
    left.take_workers(4)
    now = 10.0
    for _ in range(4):
        left.done(kinds[0], {"person": 10.0})
    assert left.seconds() == 40.0
    left.take_workers(1)
    assert left.seconds() == 160.0
    left.take_workers(8)
    assert left.seconds() == 20.0
