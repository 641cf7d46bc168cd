"""Attempts of a running visit: each is logged and measured the moment it ends."""

from __future__ import annotations

import math
from typing import Any

from ikns.experiments.conduct.experiment import Experiment
from ikns.experiments.conduct.screen import attempt_facts
from ikns.experiments.conduct.visit_log import VisitLog

#: Attempts that could not be written are tried again this often, s.
_RETRY_INTERVAL = 2.0
#: Outcomes of a trial that ran to its end.
_FINISHED = ("done", "success", "dropped", "timeout")


class AttemptRecorder:
    """Moves attempts from an experiment to the visit's log.

    Parameters
    ----------
    experiment : Experiment
    log : VisitLog

    Attributes
    ----------
    results : list of dict
        Each attempt with its metrics, those of earlier runs without.
    """

    def __init__(self, experiment: Experiment, log: VisitLog) -> None:
        self._experiment, self._log = experiment, log
        self._last_write = math.nan
        self.results: list[dict[str, Any]] = [attempt_facts(r) for r in log.attempts]

    def record(self, now: float) -> list[str]:
        """Log attempts that are new; return a line about each."""
        attempts, lines = self._experiment.visit.attempts, []
        for k in range(len(self.results), len(attempts)):
            attempt = attempts[k]
            practised = self._practised(attempt.key)
            row = self._experiment.row(k + 1, attempt, practised=practised)
            self._log.append(row)
            self.results.append(attempt_facts(row) | self._experiment.metrics(attempt))
            lines.append(f"{k + 1} {attempt.key} {attempt.outcome}")
            # The record is on disk; it need not stay in memory.
            attempts[k] = attempt._replace(record=None)
            self._last_write = now
        return lines

    def retry(self, now: float) -> None:
        """Try again, now and then, to write attempts that could not be written."""
        if self._log.fault and not now - self._last_write < _RETRY_INTERVAL:
            self._last_write = now
            self._log.flush()

    def _practised(self, key: str) -> int:
        """Count the trials so far that ran to their end in the condition of a step."""
        condition = key.partition("/")[0]
        return sum(
            row["condition"] == condition and row["outcome"] in _FINISHED
            for row in self._log.attempts
        )
