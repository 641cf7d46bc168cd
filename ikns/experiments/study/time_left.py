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

#: Kind of a task: variation, and parts such as "person", "tracking", "picking".
Kind = tuple[str, tuple[str, ...]]
#: What a task still takes that takes longer than its like, as a share of their time.
_OVERDUE = 0.05


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
            running = self._running_left()
            waiting = self._whole() - sum(self._cost(kind) for kind, _ in self._running)
            if not running:
                return 0.0
            # The longest of the running tasks ends no sooner, whoever is idle.
            return max((waiting + sum(running)) / len(running), *running)

    def share(self) -> float:
        """Return what share of the work of this run is done, 0 to 1."""
        with self._lock:
            if not self._costs:
                return 0.0
            running = sum(self._cost(kind) for kind, _ in self._running)
            done = self._spent + running - sum(self._running_left())
            return done / max(self._spent + self._whole(), 1e-9)

    def _begin_tasks(self) -> None:
        while self._waiting and len(self._running) < max(self.workers, 1):
            self._running.append((self._waiting.popleft(), self._clock()))

    def _running_left(self) -> list[float]:
        """Return how long each running task takes from now, s; none ends unreported."""
        self._begin_tasks()  # by workers that came
        now = self._clock()
        costs = [(self._cost(kind), now - began) for kind, began in self._running]
        return [max(cost - since, _OVERDUE * cost) for cost, since in costs]

    def _whole(self) -> float:
        """Return what all tasks cost that are not done, s."""
        return sum(n * self._cost(kind) for kind, n in self._left.items())

    def _cost(self, kind: Kind) -> float:
        return sum(self._costs.mean((kind[0], part)) for part in kind[1])


class _Costs:
    """Mean costs of parts by (variation, part), s."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, str], tuple[float, int]] = {}

    def __bool__(self) -> bool:
        return bool(self._seen)

    def add(self, key: tuple[str, str], seconds: float) -> None:
        total, n = self._seen.get(key, (0.0, 0))
        self._seen[key] = total + seconds, n + 1

    def mean(self, key: tuple[str, str]) -> float:
        """Return the mean of a part, else of its like, else of all."""
        like = [key] if key in self._seen else [k for k in self._seen if k[1] == key[1]]
        seen = [self._seen[k] for k in like or self._seen]
        return sum(total for total, _ in seen) / sum(n for _, n in seen)
