"""Visits of one experiment added up, one after the other: people, or simulated ones."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.experiments.study.summary.digest import (
    PICKING,
    RATE,
    TEXTS,
    TRACKING,
    WHOLE,
    Digest,
)
from ikns.experiments.study.summary.running_error import ErrorOverTime, RunningError

__all__ = ["Gathered"]

#: What visits say of themselves that the methods tell, and of how many that differ.
_SAID, _MOST_SAID = ("design", "versions", "input", "training", "parameters"), 10


class Gathered:
    """What is kept of the visits of one experiment.

    Per trial a row of numbers, per condition and trajectory a running mean over time;
    no traces. Error over time is that of the first variation only.

    Attributes
    ----------
    folders : dict of (variation, participant) to Path
    columns : dict of str to list
    attempts : Counter
        By (condition, kind, outcome).
    abouts : list of dict
        What visits say of design, versions, input and simulation, once each; the first
        ten.
    unmeasured : list of str
    sessions : dict of (variation, participant) to str
        Of visits that recorded one, relative to the visit.
    faults : list of str
        Why virtual persons could not take part.
    """

    def __init__(self, experiment: str, *, simulated: bool) -> None:
        self.experiment, self.simulated = experiment, simulated
        self.columns: dict[str, list[Any]] = {
            name: [] for name in (TRACKING if experiment == "tracking" else PICKING)
        }
        self.folders: dict[tuple[str, str], Path] = {}
        self.attempts: Counter[tuple[str, str, str]] = Counter()
        self.abouts: list[dict[str, Any]] = []
        self.unmeasured: list[str] = []
        self.sessions: dict[tuple[str, str], str] = {}
        self.faults: list[str] = []
        self.redrawn = 0
        self.planned: dict[str, dict[str, Any]] = {}
        self._errors: dict[tuple[str, str, float], RunningError] = {}

    def add(self, digest: Digest) -> str:
        """Take a visit in; say why not where its participant was there already."""
        who = str(digest.about["participant"])
        key = (digest.variation, who)
        if key in self.folders:
            return (
                f"expected one visit of {self.experiment} of participant {who}, found "
                f"another in {self.folders[key].name}"
            )
        self.folders[key] = digest.folder
        for name, values in self.columns.items():
            values.extend(digest.table[name])
        self.attempts += digest.attempts
        self.unmeasured += [f"{who}: {name}" for name in digest.unmeasured]
        if isinstance(digest.about.get("session"), str):
            self.sessions[key] = digest.about["session"]
        if digest.about.get("reason"):
            self.faults.append(f"{who}: {digest.about['reason']}")
        self.redrawn += int(digest.about.get("redrawn") or 0)
        self.planned.setdefault(
            digest.variation, dict(digest.about.get("variation_settings") or {})
        )
        said = {name: digest.about[name] for name in _SAID if name in digest.about}
        if said not in self.abouts and len(self.abouts) < _MOST_SAID:
            self.abouts.append(said)
        if digest.variation == self.base:
            for at, error in digest.errors.items():
                if at not in self._errors:
                    self._errors[at] = RunningError(np.arange(len(error)) / RATE)
                self._errors[at].add(error)
        return ""

    @property
    def base(self) -> str:
        """First variation: that without a name where there is one."""
        return next(iter(self.planned), "")

    @property
    def variations(self) -> list[str]:
        """In the order in which they came."""
        return list(self.planned)

    def participants(self, variation: str | None = None) -> list[str]:
        """Who came, in order; of one variation or any."""
        who = [p for v, p in self.folders if variation is None or v == variation]
        return list(dict.fromkeys(who))

    def table(self) -> dict[str, NDArray[Any]]:
        """Trials by column."""
        # Of a type of its own even where there is no trial.
        kind = dict.fromkeys(TEXTS, np.str_) | dict.fromkeys(WHOLE, np.int64)
        return {
            name: np.asarray(values, dtype=kind.get(name, np.float64))
            for name, values in self.columns.items()
        }

    def error_over_time(self) -> dict[tuple[str, str], ErrorOverTime]:
        """By condition and trajectory; of the length that most subjects had."""
        found: dict[tuple[str, str], ErrorOverTime] = {}
        for (condition, trajectory, _), running in self._errors.items():
            result, key = running.result(), (condition, trajectory)
            if key not in found or result.count.max() > found[key].count.max():
                found[key] = result
        return found
