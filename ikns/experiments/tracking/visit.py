"""A subject's visit: the steps of the schedule, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from ikns.experiments.progress import Progress
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.schedule import Step
from ikns.experiments.tracking.trial import ALIGN, TrackingRecord, TrialMachine

__all__ = ["Attempt", "Visit"]


class Attempt(NamedTuple):
    """How a step went once.

    Parameters
    ----------
    key : str
        Of the step.
    outcome : {"done", "aborted", "skipped", "again"}
        An aborted trial comes again. "again": what was done before is to be repeated
        and does not count.
    reason : str
    record : TrackingRecord or None
        None where nothing was recorded or it was not kept in memory.
    """

    key: str
    outcome: Literal["done", "aborted", "skipped", "again"]
    reason: str = ""
    record: TrackingRecord | None = None


class Visit:
    """Where a subject is in the schedule. No screen, no clock, no disk.

    Parameters
    ----------
    steps : sequence of Step
        From :func:`ikns.experiments.tracking.schedule`.
    attempts : iterable of Attempt
        Of a visit that was broken off: it goes on where it stopped.
    align : float
        Time before each profile, s.

    Attributes
    ----------
    attempts : list of Attempt
        Everything that was tried, in order; nothing is ever taken out.
    trial : TrialMachine or None
        The trial that goes on.

    Examples
    --------
    >>> from ikns.experiments.tracking.schedule import schedule
    >>> visit = Visit(schedule(0, training=0))
    >>> trial = visit.begin(0.0)
    >>> visit.abort(2.0, "a marker fell off")
    >>> trial = visit.begin(60.0)
    >>> trial.check(90.0).state, visit.finish(), len(visit.remaining)
    ('done', True, 18)
    """

    def __init__(
        self,
        steps: Sequence[Step],
        attempts: Iterable[Attempt] = (),
        *,
        align: float = ALIGN,
    ) -> None:
        self._progress = Progress(steps, attempts, final=("done", "skipped"))
        self.steps, self.attempts = self._progress.steps, self._progress.attempts
        self.align = align
        self.trial: TrialMachine | None = None

    @property
    def ended(self) -> dict[str, Attempt]:
        """Last attempt at each step that counts as done or was skipped, by key."""
        return self._progress.ended

    @property
    def remaining(self) -> tuple[Step, ...]:
        """Steps still to do, the current one first."""
        return self._progress.remaining

    @property
    def current(self) -> Step | None:
        """What is to be done now; None when all is."""
        return self._progress.current

    def begin(self, now: float) -> TrialMachine:
        """Start the current trial.

        Raises
        ------
        InvalidInput
            When one goes on, a rest is due, or nothing is left.
        """
        step = self._progress.to_begin(going_on=self.trial is not None)
        profile = draw_profile(step.profile, step.seed, seconds=step.seconds)
        self.trial = TrialMachine(profile, align=self.align)
        self.trial.start(now)
        return self.trial

    def finish(self) -> bool:
        """Put down the trial if it has come to its end; say whether it had."""
        if self.trial is None or self.trial.state != "done":
            return False
        self._put("done", "")
        return True

    def abort(self, now: float, reason: str) -> None:
        """Break the trial off; it comes again at once."""
        if self.trial is not None:
            self.trial.abort(now, reason)
            self._put("done" if self.trial.state == "done" else "aborted", reason)

    def skip(self, now: float, reason: str) -> None:
        """Leave the current step out."""
        if self.trial is not None:
            self.trial.abort(now, reason)
        if self.current is not None and not self._progress.end_rest():
            self._put("skipped", reason)

    def repeat(self, reason: str) -> None:
        """Have the last finished or skipped step again; what it gave does not count."""
        key = self._progress.to_repeat(going_on=self.trial is not None)
        self.attempts.append(Attempt(key, "again", reason))

    def rest(self, now: float) -> float:
        """Time left of the rest that is due, s; 0 when none is, or it is over."""
        return self._progress.rest(now)

    def records(self) -> dict[str, TrackingRecord]:
        """Return the records that count, by key."""
        return {
            key: a.record
            for key, a in self.ended.items()
            if a.outcome == "done" and a.record is not None
        }

    def _put(self, outcome: Literal["done", "aborted", "skipped"], reason: str) -> None:
        step, record = self.current, None
        assert step is not None
        if self.trial is not None:
            record = self.trial.record
        self.attempts.append(Attempt(step.key, outcome, reason, record))
        self.trial = None
