"""A subject's visit: the objects of the schedule, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from ikns.experiments.picking.schedule import PickStep
from ikns.experiments.picking.trial import PickMachine, PickRecord
from ikns.experiments.progress import Progress

__all__ = ["PickAttempt", "PickVisit"]

#: A drop and a time-out are results, not reasons to try again.
FINAL = ("success", "dropped", "timeout", "skipped")


class PickAttempt(NamedTuple):
    """How a step went once.

    Parameters
    ----------
    key : str
        Of the step.
    outcome : {"success", "dropped", "timeout", "aborted", "skipped", "again"}
        An aborted trial comes again. "again": what was done before is to be repeated
        and does not count.
    reason : str
    record : PickRecord or None
        None where nothing was recorded or it was not kept in memory.
    """

    key: str
    outcome: Literal["success", "dropped", "timeout", "aborted", "skipped", "again"]
    reason: str = ""
    record: PickRecord | None = None


class PickVisit:
    """Where a subject is in the schedule. No screen, no clock, no disk.

    Parameters
    ----------
    steps : sequence of PickStep
        From :func:`ikns.experiments.picking.pick_schedule`.
    attempts : iterable of PickAttempt
        Of a visit that was broken off: it goes on where it stopped.

    Attributes
    ----------
    attempts : list of PickAttempt
        Everything that was tried, in order; nothing is ever taken out.
    trial : PickMachine or None
        The trial that goes on, or waits for its start.

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
        self.trial: PickMachine | None = None

    @property
    def ended(self) -> dict[str, PickAttempt]:
        """Last attempt at each step that counts or was skipped, by key."""
        return self._progress.ended

    @property
    def remaining(self) -> tuple[PickStep, ...]:
        """Steps still to do, the current one first."""
        return self._progress.remaining

    @property
    def current(self) -> PickStep | None:
        """What is to be done now; None when all is."""
        return self._progress.current

    def begin(self, now: float | None = None) -> PickMachine:
        """Make the current trial ready, and start it when a time is given.

        Without, the trial waits for its ``start``: the participant's own key.

        Raises
        ------
        InvalidInput
            When one goes on, a rest is due, or nothing is left.
        """
        step = self._progress.to_begin(going_on=self.trial is not None)
        trial = PickMachine(step)
        if now is not None:
            trial.start(now)
        self.trial = trial
        return trial

    def finish(self) -> bool:
        """Put down the trial if it has come to its end; say whether it had."""
        if self.trial is None or self.trial.state in ("waiting", "running"):
            return False
        self._put(self.trial.record)
        return True

    def abort(self, now: float, reason: str) -> None:
        """Break the trial off; it comes again at once."""
        if self.trial is not None:
            self.trial.abort(now, reason)
            self._put(self.trial.record, reason)

    def skip(self, now: float, reason: str) -> None:
        """Leave the current step out."""
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
        """Have the last finished or skipped step again; what it gave does not count."""
        key = self._progress.to_repeat(going_on=self.trial is not None)
        self.attempts.append(PickAttempt(key, "again", reason))

    def rest(self, now: float) -> float:
        """Time left of the rest that is due, s; 0 when none is, or it is over."""
        return self._progress.rest(now)

    def records(self) -> dict[str, PickRecord]:
        """Return the records that count, by key."""
        return {
            key: a.record
            for key, a in self.ended.items()
            if a.outcome != "skipped" and a.record is not None
        }

    def _put(self, record: PickRecord, reason: str = "") -> None:
        reason = reason or record.reason
        attempt = PickAttempt(record.step.key, record.outcome, reason, record)
        self.attempts.append(attempt)
        self.trial = None
