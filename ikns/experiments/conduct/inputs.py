"""What drives the pointer, as a conductor takes it: samples since it asked last."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from ikns.experiments.tracking.profiles import Profile
from ikns.live.stream.delays import Delays
from ikns.simulation.operator import Delay, Operator

__all__ = ["Driver", "HeldInput", "Sample", "Samples", "VirtualInput"]

#: A page that says nothing for longer than this has no control signal, s: at 60 per
#: second twelve messages in a row are missing.
STALE = 0.2


class Sample(NamedTuple):
    """A control signal at a time.

    Parameters
    ----------
    time : float
        On this machine's monotonic clock, s.
    c : float
        NaN where there is none.
    """

    time: float
    c: float


class Samples:
    """Samples on their way from the thread that makes them to the one that takes them.

    Examples
    --------
    >>> way = Samples()
    >>> way.put(Sample(10.0, 0.25))
    >>> way.take(10.1), way.take(10.2), way.take(10.3)
    ([Sample(time=10.0, c=0.25)], [], [Sample(time=10.3, c=nan)])
    """

    def __init__(self) -> None:
        self._queue: deque[Sample] = deque(maxlen=10_000)
        self._last = -math.inf

    def put(self, sample: Sample) -> None:
        """Send one, from any thread."""
        self._queue.append(sample)

    def take(self, now: float) -> list[Sample]:
        """Return those since the last call; one without a signal if none come."""
        samples = []
        while self._queue:
            samples.append(self._queue.popleft())
        if samples:
            self._last = samples[-1].time
        elif now - self._last > STALE:
            samples.append(Sample(now, math.nan))
        return samples


class Driver(Protocol):
    """Something that makes a control signal.

    Attributes
    ----------
    fault : str
        Why it does so no more; empty while it does.
    """

    @property
    def fault(self) -> str:
        """Why it does so no more."""

    def take(self, now: float) -> Sequence[Sample]:
        """Return what came since the last call, in order."""

    def facts(self) -> dict[str, Any]:
        """Return what the panel shows of it."""

    def halt(self) -> None:
        """Let nothing move any more, at once; called from any thread."""

    def mark(self, name: str, text: str, now: float) -> None:
        """Write down what happened, where it keeps a record of its own."""


class HeldInput:
    """A control signal that is told from elsewhere and holds until it is told again.

    :meth:`put` may be called from any thread.

    Parameters
    ----------
    stale : float
        Without news for longer than this there is no signal, s.

    Examples
    --------
    >>> stick = HeldInput()
    >>> stick.put(10.0, 0.25)
    >>> stick.take(10.1), stick.take(10.3)
    ([Sample(time=10.1, c=0.25)], [Sample(time=10.3, c=nan)])
    """

    fault = ""

    def __init__(self, *, stale: float = STALE) -> None:
        self._stale = stale
        self._newest = Sample(-math.inf, math.nan)
        self._lock = threading.Lock()
        self._delays, self._count = Delays(), 0

    def put(self, now: float, c: float, *, round_trip: float = math.nan) -> None:
        """Tell the signal.

        Parameters
        ----------
        now : float
            When it was received, s.
        c : float
            Anything beyond 0 to 1 is cut off.
        round_trip : float
            From what was shown to what was answered, s, where it is known.
        """
        c = min(max(c, 0.0), 1.0) if math.isfinite(c) else math.nan
        with self._lock:
            self._newest = Sample(now, c)
            self._count += 1
            if math.isfinite(round_trip) and round_trip >= 0:
                self._delays.add(round_trip)

    def lose(self) -> None:
        """Forget the signal: whoever told it has gone."""
        with self._lock:
            self._newest = Sample(-math.inf, math.nan)
            self._delays = Delays()

    def take(self, now: float) -> list[Sample]:
        """Return the signal that holds now."""
        told, c = self._newest
        return [Sample(now, c if now - told <= self._stale else math.nan)]

    def facts(self) -> dict[str, Any]:
        """Return how often it was told, and how late answers are, s."""
        with self._lock:
            late = self._delays.percentile(99)
        return {"kind": "page", "told": self._count, "round_trip": late}

    def halt(self) -> None:
        """Nothing moves here."""

    def mark(self, name: str, text: str, now: float) -> None:
        """Count delays anew with each trial; nothing else is kept."""
        if name == "trial begins":
            with self._lock:
                self._delays = Delays()


class VirtualInput:
    """A simulated operator that sees the trial and steers, in real time.

    Parameters
    ----------
    operator : Operator
        Sets the rate.
    device : Delay
        What it holds.
    trial : callable
        Profile of the trial that goes on and when it began or begins (s, of the clock
        that :meth:`take` is asked by), or None: the operator then rests in the middle.
    """

    fault = ""

    def __init__(
        self,
        operator: Operator,
        device: Delay,
        trial: Callable[[], tuple[Profile, float] | None],
    ) -> None:
        self._operator, self._device, self._trial = operator, device, trial
        self._next = math.nan
        self._c = device.step(operator.place)

    def take(self, now: float) -> list[Sample]:
        """Let the operator act until now."""
        if math.isnan(self._next):
            self._next = now
        # Whoever was not asked for long does not catch up.
        self._next = max(self._next, now - STALE)
        trial, samples = self._trial(), []
        while self._next <= now:
            target = 0.5
            if trial is not None:
                profile, began = trial
                ahead = self._next - began + self._operator.preview
                target = float(profile.at(ahead)) / 100
            self._c = self._device.step(self._operator.step(target, self._c))
            samples.append(Sample(self._next, self._c))
            self._next += 1 / self._operator.rate
        return samples

    def facts(self) -> dict[str, Any]:
        """Say that nobody is there."""
        return {"kind": "virtual"}

    def halt(self) -> None:
        """Nothing moves here."""

    def mark(self, name: str, text: str, now: float) -> None:
        """Nothing is kept here."""
