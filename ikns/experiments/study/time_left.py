"""How much of a study is done and how long the rest takes, from what it took so far.

Parts of a task differ in cost: picking takes longer than tracking, and a variation may
take longer than the study as planned. What each kind of part costs is the mean of those
that were simulated in this run; before one was, that of its like.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from heapq import heapify, heapreplace
from itertools import islice

#: Kind of a task: variation, and parts such as "person", "tracking", "picking".
Kind = tuple[str, tuple[str, ...]]
#: What a task still takes that takes longer than its like, as a share of their time.
_OVERDUE = 0.05
#: So many tasks, before the last one, are given to workers one by one.
_FEW = 200


class TimeLeft:
    """Estimates what share of the work is done, and how long the rest takes.

    Parameters
    ----------
    tasks : iterable of Kind
        Of all tasks to do, in the order in which they are begun.
    clock : callable
        Time in s.

    Attributes
    ----------
    workers : int
        Number of tasks at a time.

    Examples
    --------
    >>> now = [0.0]
    >>> kinds = [("", ("tracking",)), ("", ("picking",))] * 2
    >>> left = TimeLeft(kinds, clock=lambda: now[0])
    >>> left.seconds() is None
    True
    >>> now[0] = 5.0
    >>> left.done(kinds[0], {"tracking": 5.0})
    >>> now[0] = 25.0
    >>> left.done(kinds[1], {"picking": 20.0})
    >>> left.seconds(), left.share()
    (25.0, 0.5)
    >>> now[0] = 27.0
    >>> left.seconds(), left.share()
    (23.0, 0.54)
    """

    def __init__(
        self, tasks: Iterable[Kind], *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.workers = 1
        self._clock = clock
        self._lock = threading.RLock()  # a bar asks from a thread of its own
        self._waiting = deque(tasks)
        self._left = Counter(self._waiting)
        self._costs = _Costs()
        self._spent = 0.0
        #: Tasks that are computed now, as far as one can tell, and since when.
        self._running: list[tuple[Kind, float]] = []
        self._begin_tasks()

    def take_workers(self, n: int) -> None:
        """Take note of how many tasks are computed at a time."""
        with self._lock:
            self.workers = n
            while len(self._running) > max(n, 1):  # back to those that wait
                self._waiting.appendleft(self._running.pop()[0])
            self._begin_tasks()

    def done(self, kind: Kind, seconds: Mapping[str, float]) -> None:
        """Take note of a finished task and what its parts took, s."""
        with self._lock:
            self._left[kind] -= 1
            for part, took in seconds.items():
                self._costs.add((kind[0], part), took)
            self._spent += sum(seconds.values())
            like = [task for task in self._running if task[0] == kind]
            if like:
                self._running.remove(like[0])
            elif kind in self._waiting:
                self._waiting.remove(kind)
            self._begin_tasks()

    def seconds(self) -> float | None:
        """Return how long the rest takes, s; None before anything is done."""
        with self._lock:
            if not self._costs:
                return None
            cost = self._costs_now()
            free = self._running_left(cost)
            if not free:
                return 0.0
            few = list(islice(self._waiting, _FEW))
            many = sum(n * cost[kind] for kind, n in self._left.items())
            for kind in [*few, *(kind for kind, _ in self._running)]:
                many -= cost[kind]
            # The first ones are of no matter but for their sum; then each task goes to
            # the worker that is free first.
            free = [each + max(many, 0.0) / len(free) for each in free]
            heapify(free)
            for kind in few:
                heapreplace(free, free[0] + cost[kind])
            return max(free)

    def share(self) -> float:
        """Return what share of the work of this run is done, 0 to 1."""
        with self._lock:
            if not self._costs:
                return 0.0
            cost = self._costs_now()
            whole = sum(n * cost[kind] for kind, n in self._left.items())
            running = sum(cost[kind] for kind, _ in self._running)
            done = self._spent + running - sum(self._running_left(cost))
            return done / max(self._spent + whole, 1e-9)

    def _begin_tasks(self) -> None:
        while self._waiting and len(self._running) < max(self.workers, 1):
            self._running.append((self._waiting.popleft(), self._clock()))

    def _running_left(self, cost: Mapping[Kind, float]) -> list[float]:
        """Return how long each running task takes from now, s; none ends unreported."""
        now = self._clock()
        tasks = [(cost[kind], now - began) for kind, began in self._running]
        return [max(each - since, _OVERDUE * each) for each, since in tasks]

    def _costs_now(self) -> dict[Kind, float]:
        """Return what a task of each kind costs, s."""
        self._begin_tasks()  # of workers that came
        now, since = self._clock(), dict[Kind, float]()
        for kind, began in self._running:
            since[kind] = max(since.get(kind, 0.0), now - began)
        # A kind of which none is done takes no less than its running tasks already did.
        return {
            kind: max(self._costs.of(kind), 0.0 if known else since.get(kind, 0.0))
            for kind, known in ((k, self._costs.know(k)) for k in self._left)
        }


class _Costs:
    """Mean costs of parts by (variation, part), s."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, str], tuple[float, int]] = {}

    def __bool__(self) -> bool:
        return bool(self._seen)

    def add(self, key: tuple[str, str], seconds: float) -> None:
        total, n = self._seen.get(key, (0.0, 0))
        self._seen[key] = total + seconds, n + 1

    def know(self, kind: Kind) -> bool:
        """Whether every part of a kind was seen."""
        return all((kind[0], part) in self._seen for part in kind[1])

    def of(self, kind: Kind) -> float:
        """Return the sum of a kind's parts."""
        return sum(self._mean((kind[0], part)) for part in kind[1])

    def _mean(self, key: tuple[str, str]) -> float:
        """Return the mean of a part, else of its like, else of all."""
        like = [key] if key in self._seen else [k for k in self._seen if k[1] == key[1]]
        seen = [self._seen[k] for k in like or self._seen]
        return sum(total for total, _ in seen) / sum(n for _, n in seen)
