"""Sources of a control signal: they hand over the samples since the last call."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from ikns.experiments.tracking.profiles import Profile
from ikns.live.stream.delays import Delays

if TYPE_CHECKING:
    from ikns.simulation.operator import Delay, Operator

#: Without a sample for longer than this there is no control signal, s: of the 60 per
#: second that a page sends, twelve in a row are missing.
TIMEOUT = 0.2


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


class SampleQueue:
    """Samples from the thread that makes them to the thread that takes them.

    Examples
    --------
    >>> queue = SampleQueue()
    >>> queue.put(Sample(10.0, 0.25))
    >>> queue.take(10.1), queue.take(10.2), queue.take(10.3)
    ([Sample(time=10.0, c=0.25)], [], [Sample(time=10.3, c=nan)])
    """

    def __init__(self) -> None:
        self._queue: deque[Sample] = deque(maxlen=10_000)
        self._last = -math.inf

    def put(self, sample: Sample) -> None:
        """Add a sample, from any thread."""
        self._queue.append(sample)

    def take(self, now: float) -> list[Sample]:
        """Return the samples since the last call; after a timeout one with c NaN."""
        samples = []
        while self._queue:
            samples.append(self._queue.popleft())
        if samples:
            self._last = samples[-1].time
        elif now - self._last > TIMEOUT:
            samples.append(Sample(now, math.nan))
        return samples


class Driver(Protocol):
    """A source of a control signal.

    Attributes
    ----------
    fault : str
        Why it has ended; empty while it runs.
    """

    @property
    def fault(self) -> str:
        """Why it has ended."""

    def take(self, now: float) -> Sequence[Sample]:
        """Return the samples since the last call, in order."""

    def status(self) -> dict[str, Any]:
        """Return what the panel shows of it."""

    def halt(self) -> None:
        """Stop all motion at once; called from any thread."""

    def arm(self) -> None:
        """Let a finger that is in its safe state follow again; from any thread."""

    def log_event(self, name: str, text: str, now: float) -> None:
        """Record an event, if it keeps a recording of its own."""


class HeldInput:
    """A control signal that is sent from elsewhere and held until the next one.

    :meth:`put` may be called from any thread.

    Parameters
    ----------
    timeout : float
        Without news for longer than this there is no signal, s.

    Examples
    --------
    >>> stick = HeldInput()
    >>> stick.put(10.0, 0.25)
    >>> stick.take(10.1), stick.take(10.3)
    ([Sample(time=10.1, c=0.25)], [Sample(time=10.3, c=nan)])
    """

    fault = ""

    def __init__(self, *, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._newest = Sample(-math.inf, math.nan)
        self._lock = threading.Lock()
        self._delays, self._count = Delays(), 0
        self._device = ""

    def put(
        self,
        now: float,
        c: float,
        *,
        round_trip: float = math.nan,
        device: str = "",
    ) -> None:
        """Set the signal.

        Parameters
        ----------
        now : float
            When it was received, s.
        c : float
            Clipped to 0 to 1.
        round_trip : float
            From sending a state to the page to this answer, s, where it is known.
        device : str
            Which device and control the signal is from, or why there is none.
        """
        c = min(max(c, 0.0), 1.0) if math.isfinite(c) else math.nan
        with self._lock:
            self._newest = Sample(now, c)
            self._device = device
            self._count += 1
            if math.isfinite(round_trip) and round_trip >= 0:
                self._delays.add(round_trip)

    def clear(self) -> None:
        """Forget the signal: its sender is gone."""
        with self._lock:
            self._newest = Sample(-math.inf, math.nan)
            self._delays, self._device = Delays(), ""

    def take(self, now: float) -> list[Sample]:
        """Return the signal that holds now."""
        received, c = self._newest
        return [Sample(now, c if now - received <= self._timeout else math.nan)]

    def status(self) -> dict[str, Any]:
        """Return device, count of signals, and 99th percentile of round trips, s."""
        with self._lock:
            delay, device = self._delays.percentile(99), self._device
        return {
            "kind": "page",
            "device": device,
            "received": self._count,
            "round_trip": delay,
        }

    def halt(self) -> None:
        """Do nothing: nothing moves here."""

    def arm(self) -> None:
        """Do nothing: nothing moves here."""

    def log_event(self, name: str, text: str, now: float) -> None:
        """Start measuring round trips anew with each trial; record nothing."""
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
        Device that the operator holds.
    trial : callable
        Returns the profile of the running trial and when the profile begins (s, on the
        clock of :meth:`take`), or None: the operator then rests in the middle.
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
        self._c = device.step(operator.limb)

    def take(self, now: float) -> list[Sample]:
        """Let the operator act until now."""
        if math.isnan(self._next):
            self._next = now
        # After a long gap, the missed time is not made up for.
        self._next = max(self._next, now - TIMEOUT)
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

    def status(self) -> dict[str, Any]:
        """Say that the operator is virtual."""
        return {"kind": "virtual"}

    def halt(self) -> None:
        """Do nothing: nothing moves here."""

    def arm(self) -> None:
        """Do nothing: nothing moves here."""

    def log_event(self, name: str, text: str, now: float) -> None:
        """Do nothing: nothing is recorded here."""
