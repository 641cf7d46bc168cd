"""A subject's tracking visit: the steps of the schedule in order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from ikns.experiments.progress import Progress
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.schedule import TrackingStep
from ikns.experiments.tracking.trial import ALIGN, TrackingRecord, TrackingTrial

#: Outcomes after which a step is not repeated.
FINAL = ("done", "skipped")


class Attempt(NamedTuple):
    """One attempt at a step.

    Parameters
    ----------
    key : str
        Of the step.
    outcome : {"done", "aborted", "skipped", "again"}
        An aborted trial is repeated. "again": the attempt before it does not count, and
        the step is repeated.
    reason : str
    record : TrackingRecord or None
        None where nothing was recorded, or the record is no longer in memory.
    """

    key: str
    outcome: Literal["done", "aborted", "skipped", "again"]
    reason: str = ""
    record: TrackingRecord | None = None


class Visit:
    """Progress of a subject through the schedule; without screen, clock or disk.

    Parameters
    ----------
    steps : sequence of TrackingStep
        From :func:`ikns.experiments.tracking.schedule`.
    attempts : iterable of Attempt
        Of earlier runs of the visit: it continues where it stopped.
    align : float
        Time before each profile, s.

    Attributes
    ----------
    attempts : list of Attempt
        All attempts in order; none is ever removed.
    trial : TrackingTrial or None
        The running trial.

    Examples
    --------
    >>> from ikns.experiments.tracking.schedule import schedule
    >>> visit = Visit(schedule(0, training=0))
    >>> trial = visit.begin(0.0)
    >>> visit.abort(2.0, "a marker fell off")
    >>> trial = visit.begin(60.0)
    >>> trial.update(90.0).state, visit.finish(), len(visit.remaining)
    ('done', True, 18)
    """

    def __init__(
        self,
        steps: Sequence[TrackingStep],
        attempts: Iterable[Attempt] = (),
        *,
        align: float = ALIGN,
    ) -> None:
        self._progress = Progress(steps, attempts, final=FINAL)
        self.steps, self.attempts = self._progress.steps, self._progress.attempts
        self.align = align
        self.trial: TrackingTrial | None = None

    @property
    def ended(self) -> dict[str, Attempt]:
        """Final attempt at each step that was done or skipped, by key."""
        return self._progress.ended

    @property
    def remaining(self) -> tuple[TrackingStep, ...]:
        """Steps still to do, the current one first."""
        return self._progress.remaining

    @property
    def current(self) -> TrackingStep | None:
        """Current step; None when all are done."""
        return self._progress.current

    def begin(self, now: float) -> TrackingTrial:
        """Start the current trial.

        Raises
        ------
        InvalidInput
            When a trial is running, a rest is due, or nothing is left.
        """
        step = self._progress.next_trial(running=self.trial is not None)
        profile = draw_profile(step.profile, step.seed, seconds=step.seconds)
        self.trial = TrackingTrial(profile, align=self.align)
        self.trial.start(now)
        return self.trial

    def finish(self) -> bool:
        """Add the attempt if the trial has ended; say whether it had."""
        if self.trial is None or self.trial.state != "done":
            return False
        self._add_attempt("done", "")
        return True

    def abort(self, now: float, reason: str) -> None:
        """Abort the trial; it is repeated at once."""
        if self.trial is not None:
            self.trial.abort(now, reason)
            self._add_attempt(
                "done" if self.trial.state == "done" else "aborted", reason
            )

    def skip(self, now: float, reason: str) -> None:
        """Skip the current step."""
        if self.trial is not None:
            self.trial.abort(now, reason)
        if self.current is not None and not self._progress.end_rest():
            self._add_attempt("skipped", reason)

    def repeat(self, reason: str) -> None:
        """Repeat the last finished or skipped step; that attempt does not count."""
        key = self._progress.key_to_repeat(running=self.trial is not None)
        self.attempts.append(Attempt(key, "again", reason))

    def rest(self, now: float) -> float:
        """Return the time left of the current rest, s; 0 without one or at its end."""
        return self._progress.rest(now)

    def records(self) -> dict[str, TrackingRecord]:
        """Return the records that count, by key."""
        return {
            key: a.record
            for key, a in self.ended.items()
            if a.outcome == "done" and a.record is not None
        }

    def _add_attempt(
        self, outcome: Literal["done", "aborted", "skipped"], reason: str
    ) -> None:
        step, record = self.current, None
        assert step is not None
        if self.trial is not None:
            record = self.trial.record
        self.attempts.append(Attempt(step.key, outcome, reason, record))
        self.trial = None
