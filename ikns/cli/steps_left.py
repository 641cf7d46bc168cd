"""How far a command of several steps is, and how long the rest of it takes.

Steps differ in cost, and most do not say how far they are. What each costs was measured
once, in proportion to the others; how fast this machine is today is seen in the steps
that are done.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Iterable
from itertools import accumulate
from typing import Any, NamedTuple

#: What a step still takes that takes longer than it should, as a share of its cost.
_OVERDUE = 0.05


Report = Callable[[str, int, int], None]


class _Reached(NamedTuple):
    step: int  # which one was reported last
    cost: float  # of all that is done, the reported part of this step included
    at: float  # s, when that was reported


class StepsLeft:
    """One estimate for all steps of a command, by their costs.

    Parameters
    ----------
    steps : iterable of (str, float)
        Name and cost of each step, in the order in which they begin. A name may come
        back.
    clock : callable
        Time in s.

    Examples
    --------
    >>> now = [0.0]
    >>> left = StepsLeft([("reading", 1.0), ("fitting", 3.0)], clock=lambda: now[0])
    >>> now[0] = 10.0
    >>> left.report("fitting", 0, 1)
    >>> left.share(), left.seconds()
    (0.25, 30.0)
    >>> now[0] = 25.0
    >>> left.share(), left.seconds()
    (0.625, 15.0)
    """

    def __init__(
        self,
        steps: Iterable[tuple[str, float]],
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._names, costs = zip(*steps, strict=True)
        self._begins = (0.0, *accumulate(costs))
        self._clock = clock
        self._began = clock()
        # Replaced as a whole, as a bar asks from a thread of its own.
        self._reached = _Reached(0, 0.0, self._began)

    def report(self, step: str, done: int, total: int) -> None:
        """Take note that a step began, or of how much of it is done.

        What is not among the steps, or comes a second time, is ignored.
        """
        before, share = self._reached, done / max(total, 1)
        k = before.step
        if self._names[k] != step or self._cost(k, share) < before.cost:
            later = self._names[k + 1 :]
            if step not in later:
                return
            k += 1 + later.index(step)
        self._reached = _Reached(k, self._cost(k, share), self._clock())

    def share(self) -> float:
        """Return what share of the work is done, 0 to 1."""
        return self._now()[0] / self._begins[-1]

    def seconds(self) -> float | None:
        """Return how long the rest takes, s; None before anything is done."""
        cost, pace = self._now()
        return None if pace is None else pace * (self._begins[-1] - cost)

    def _cost(self, step: int, share: float) -> float:
        first, last = self._begins[step : step + 2]
        return first + share * (last - first)

    def _now(self) -> tuple[float, float | None]:
        """Cost that is done, between two reports by the time; and s per cost."""
        step, cost, at = self._reached
        if cost <= 0:
            return 0.0, None
        pace = (at - self._began) / cost
        since = self._clock() - at
        step = max(step, bisect_right(self._begins, cost) - 1)
        end = self._begins[min(step + 1, len(self._begins) - 1)]
        most = (end - cost) * (1 - _OVERDUE)
        if pace * most < since:  # slower than it was: the pace of all so far
            pace = (at - self._began + since) / (cost + most)
            return cost + most, pace
        return cost + (since / pace if pace > 0 else 0.0), pace


def one_bar(
    name: str,
    steps: Iterable[tuple[str, float]],
    report: Report,
    estimates: dict[str, Any],
) -> Report:
    """Show all steps of a command in one bar; return what takes their reports.

    `report` and `estimates` are those of :func:`ikns.cli.output.progress`.
    """
    estimates[name] = left = StepsLeft(steps)
    report(name, 0, 1)
    return left.report
