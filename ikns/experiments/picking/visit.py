"""A subject's pick and place visit: the steps of the schedule in order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from ikns.experiments.picking.schedule import PickStep
from ikns.experiments.picking.trial import PickRecord, PickTrial
from ikns.experiments.progress import Progress

#: Outcomes after which a step is not repeated: a drop and a timeout are results.
FINAL = ("success", "dropped", "timeout", "skipped")


class PickAttempt(NamedTuple):
    """One attempt at a step.

    Parameters
    ----------
    key : str
        Of the step.
    outcome : {"success", "dropped", "timeout", "aborted", "skipped", "again"}
        An aborted trial is repeated. "again": the attempt before it does not count, and
        the step is repeated.
    reason : str
    record : PickRecord or None
        None where nothing was recorded, or the record is no longer in memory.
    """

    key: str
    outcome: Literal["success", "dropped", "timeout", "aborted", "skipped", "again"]
    reason: str = ""
    record: PickRecord | None = None


class PickVisit:
    """Progress of a subject through the schedule; without screen, clock or disk.

    Parameters
    ----------
    steps : sequence of PickStep
        From :func:`ikns.experiments.picking.pick_schedule`.
    attempts : iterable of PickAttempt
        Of earlier runs of the visit: it continues where it stopped.

    Attributes
    ----------
    attempts : list of PickAttempt
        All attempts in order; none is ever removed.
    trial : PickTrial or None
        The trial that is running, or ready to start.

    Examples
    --------
    >>> from ikns.experiments.picking.schedule import pick_schedule
    >>> visit = PickVisit(pick_schedule(0, training=0))
    >>> trial = visit.begin(0.0)
    >>> visit.abort(2.0, "the strap came loose")
    >>> trial = visit.begin(60.0)
    >>> trial.stop(68.0, "dropped").state, visit.finish(), len(visit.remaining)
    ('dropped', True, 22)
    """

    def __init__(
        self, steps: Sequence[PickStep], attempts: Iterable[PickAttempt] = ()
    ) -> None:
        self._progress = Progress(steps, attempts, final=FINAL)
        self.steps, self.attempts = self._progress.steps, self._progress.attempts
        self.trial: PickTrial | None = None

    @property
    def ended(self) -> dict[str, PickAttempt]:
        """Final attempt at each step that was done or skipped, by key."""
        return self._progress.ended

    @property
    def remaining(self) -> tuple[PickStep, ...]:
        """Steps still to do, the current one first."""
        return self._progress.remaining

    @property
    def current(self) -> PickStep | None:
        """Current step; None when all are done."""
        return self._progress.current

    def begin(self, now: float | None = None) -> PickTrial:
        """Make the current trial ready, and start it when a time is given.

        Without a time, the trial waits for ``start``: the participant's own key.

        Raises
        ------
        InvalidInput
            When a trial is running, a rest is due, or nothing is left.
        """
        step = self._progress.next_trial(running=self.trial is not None)
        trial = PickTrial(step)
        if now is not None:
            trial.start(now)
        self.trial = trial
        return trial

    def finish(self) -> bool:
        """Add the attempt if the trial has ended; say whether it had."""
        if self.trial is None or self.trial.state in ("waiting", "running"):
            return False
        self._add_attempt(self.trial.record)
        return True

    def abort(self, now: float, reason: str) -> None:
        """Abort the trial; it is repeated at once."""
        if self.trial is not None:
            self.trial.abort(now, reason)
            self._add_attempt(self.trial.record, reason)

    def skip(self, now: float, reason: str) -> None:
        """Skip the current step."""
        step = self.current
        if self.trial is not None:
            self.trial.abort(now, reason)
            record = self.trial.record
            self.attempts.append(
                PickAttempt(record.step.key, "skipped", reason, record)
            )
            self.trial = None
        elif step is not None and not self._progress.end_rest():
            self.attempts.append(PickAttempt(step.key, "skipped", reason))

    def repeat(self, reason: str) -> None:
        """Repeat the last finished or skipped step; that attempt does not count."""
        key = self._progress.key_to_repeat(running=self.trial is not None)
        self.attempts.append(PickAttempt(key, "again", reason))

    def rest(self, now: float) -> float:
        """Return the time left of the current rest, s; 0 without one or at its end."""
        return self._progress.rest(now)

    def records(self) -> dict[str, PickRecord]:
        """Return the records that count, by key."""
        return {
            key: a.record
            for key, a in self.ended.items()
            if a.outcome != "skipped" and a.record is not None
        }

    def _add_attempt(self, record: PickRecord, reason: str = "") -> None:
        reason = reason or record.reason
        attempt = PickAttempt(record.step.key, record.outcome, reason, record)
        self.attempts.append(attempt)
        self.trial = None
