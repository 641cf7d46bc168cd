"""One tracking trial: align, then track. It has no clock: each call gives the time."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.experiments.tracking.profiles import Profile

State = Literal["waiting", "align", "track", "done", "aborted"]

#: Time to bring the pointer to the start of the profile, s (the paper's).
ALIGN = 5.0
#: Tolerance for a sample at the very end, s: large clock times round.
_ROUNDING = 1e-6


class TrackingView(NamedTuple):
    """What a screen shows of the trial.

    Parameters
    ----------
    state : {"waiting", "align", "track", "done", "aborted"}
    time : float
        Since the profile began, s; negative while aligning.
    x : float
        Horizontal position of the pointer, 0 to 1, at constant speed.
    y : float
        Height of the pointer, 100 c, 0 to 100; NaN before the first c.
    target : float
        Height of the profile.
    """

    state: State
    time: float
    x: float
    y: float
    target: float


@dataclass(frozen=True, eq=False)
class TrackingRecord:
    """The recording of a trial.

    Parameters
    ----------
    profile : Profile
    time : (T,) array
        Since the profile began, s, increasing; negative while aligning.
    target : (T,) array
        0 to 100.
    c : (T,) array
        As received: not clipped, NaN where there was none.
    state : {"done", "aborted"}
    reason : str
        Why it was aborted.
    """

    profile: Profile
    time: Array
    target: Array
    c: Array
    state: State
    reason: str = ""

    @property
    def y(self) -> Array:
        """Height of the pointer: 100 c clipped to 0 to 100, held where c is NaN."""
        known = np.isfinite(self.c)
        last = np.maximum.accumulate(np.where(known, np.arange(len(self.c)), -1))
        return np.where(last < 0, np.nan, 100.0 * np.clip(self.c[last], 0.0, 1.0))


class TrackingTrial:
    """A running trial, as a state machine.

    Parameters
    ----------
    profile : Profile
        Curve to follow.
    align : float
        Time before the profile begins, s.

    Attributes
    ----------
    state : str

    Examples
    --------
    >>> from ikns.experiments.tracking.profiles import draw_profile
    >>> trial = TrackingTrial(draw_profile("T1", seed=0))
    >>> trial.start(100.0)
    >>> for k in range(3001):
    ...     view = trial.add_sample(100.0 + k / 100, c=0.5)
    >>> trial.state, view.y, round(view.x, 9)
    ('done', 50.0, 1.0)
    """

    def __init__(self, profile: Profile, *, align: float = ALIGN) -> None:
        if not 0 <= align < math.inf:
            raise InvalidInput(f"expected a time to align from 0 s, found {align:g} s.")
        self.profile, self.align = profile, align
        self.state: State = "waiting"
        self._zero = self._now = -math.inf
        self._y = math.nan
        self._reason = ""
        self._rows: list[tuple[float, float]] = []

    def start(self, now: float) -> None:
        """Begin with the alignment.

        Raises
        ------
        InvalidInput
            When it was started already, or the time is not finite.
        """
        if self.state != "waiting" or not math.isfinite(now):
            raise InvalidInput(
                f"expected to start a waiting trial at a finite time, found it "
                f"{self.state} at {now:g} s."
            )
        self._now, self._zero = now, now + self.align
        self.state = "align" if self.align else "track"

    def add_sample(self, now: float, c: float) -> TrackingView:
        """Take the control signal at a time; NaN where there is none.

        A sample that is not later than the last one is not recorded.
        """
        self._take(now, c)
        return self._view()

    def add_samples(self, times: Iterable[float], c: Iterable[float]) -> None:
        """Take many samples, for which no one looks at the screen."""
        for now, each in zip(times, c, strict=True):
            self._take(now, each)

    def update(self, now: float) -> TrackingView:
        """Let time pass without a sample."""
        self._advance(now)
        return self._view()

    def _take(self, now: float, c: float) -> None:
        before = self._rows[-1][0] if self._rows else -math.inf
        running = self.state in ("align", "track")
        time = self._advance(now)
        if not running or time > self.profile.seconds + _ROUNDING:
            return
        if math.isfinite(c):
            self._y = 100.0 * min(max(c, 0.0), 1.0)
        if time > before:
            self._rows.append((time, float(c)))

    def _advance(self, now: float) -> float:
        """Let time pass; return the time since the profile began, s."""
        if now > self._now and self.state in ("align", "track"):
            self._now = now
            time = now - self._zero
            if time >= self.profile.seconds:
                self.state = "done"
            elif time >= 0:
                self.state = "track"
        return self._now - self._zero if self.state != "waiting" else -self.align

    def _view(self) -> TrackingView:
        time = self._now - self._zero if self.state != "waiting" else -self.align
        seconds = self.profile.seconds
        return TrackingView(
            self.state,
            time,
            min(max(time / seconds, 0.0), 1.0),
            self._y,
            float(self.profile.at(time)),
        )

    def abort(self, now: float, reason: str) -> None:
        """End the trial early; what was recorded is kept."""
        if self.state in ("waiting", "align", "track"):
            self.update(now)
        if self.state in ("waiting", "align", "track"):
            self.state, self._reason = "aborted", reason

    @property
    def record(self) -> TrackingRecord:
        """The recording of a trial that has ended.

        Raises
        ------
        InvalidInput
            While the trial is running.
        """
        if self.state not in ("done", "aborted"):
            raise InvalidInput(f"expected a trial that ended, found it {self.state}.")
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 2)
        return TrackingRecord(
            profile=self.profile,
            time=rows[:, 0],
            target=self.profile.at(rows[:, 0]),
            c=rows[:, 1],
            state=self.state,
            reason=self._reason,
        )
