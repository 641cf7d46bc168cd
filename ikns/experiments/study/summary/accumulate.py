"""Collects the visits of one experiment, one after the other."""

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

#: Parts of ``visit.json`` that the methods text needs, and how many different ones.
_SETTINGS, _MAX_SETTINGS = ("design", "versions", "input", "training", "parameters"), 10


class VisitAccumulator:
    """Trials and settings of the visits of one experiment.

    It keeps a row of numbers per trial, and per condition and trajectory a running mean
    over time, but no traces. The error over time is that of the first variation only.

    Parameters
    ----------
    experiment : {"tracking", "picking"}
    simulated : bool
        Whether the visits are of people or of simulated participants.

    Attributes
    ----------
    folders : dict of (variation, participant) to Path
    columns : dict of str to list
    attempts : Counter
        By (condition, kind, outcome).
    settings : list of dict
        Design, versions, inputs and simulation parameters of the visits, the first ten
        that differ.
    unmeasured : list of str
        Trials without a second of control signal.
    sessions : dict of (variation, participant) to str
        Of visits that recorded one, relative to the visit.
    faults : list of str
        Why virtual persons could not take part.
    redrawn : int
        Persons who were replaced because they could not do the protocol.
    variations : dict of str to dict
        Settings by variation, in the order in which they came.
    """

    def __init__(self, experiment: str, *, simulated: bool) -> None:
        self.experiment, self.simulated = experiment, simulated
        self.columns: dict[str, list[Any]] = {
            name: [] for name in (TRACKING if experiment == "tracking" else PICKING)
        }
        self.folders: dict[tuple[str, str], Path] = {}
        self.attempts: Counter[tuple[str, str, str]] = Counter()
        self.settings: list[dict[str, Any]] = []
        self.unmeasured: list[str] = []
        self.sessions: dict[tuple[str, str], str] = {}
        self.faults: list[str] = []
        self.redrawn = 0
        self.variations: dict[str, dict[str, Any]] = {}
        self._errors: dict[tuple[str, str, float], RunningError] = {}

    def add(self, digest: Digest) -> str:
        """Add a visit; return why not if its participant had one already."""
        about, who = digest.about, str(digest.about["participant"])
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
        if isinstance(about.get("session"), str):
            self.sessions[key] = about["session"]
        if about.get("reason"):
            self.faults.append(f"{who}: {about['reason']}")
        self.redrawn += int(about.get("redrawn") or 0)
        self.variations.setdefault(
            digest.variation, dict(about.get("variation_settings") or {})
        )
        settings = {name: about[name] for name in _SETTINGS if name in about}
        if settings not in self.settings and len(self.settings) < _MAX_SETTINGS:
            self.settings.append(settings)
        if digest.variation == self.base:
            for at, error in digest.errors.items():
                if at not in self._errors:
                    self._errors[at] = RunningError(np.arange(len(error)) / RATE)
                self._errors[at].add(error)
        return ""

    @property
    def base(self) -> str:
        """First variation: the one without a name if there is one."""
        return next(iter(self.variations), "")

    def table(self) -> dict[str, NDArray[Any]]:
        """Return all trials by column."""
        # Types are given so that they are right even without any trial.
        kind = dict.fromkeys(TEXTS, np.str_) | dict.fromkeys(WHOLE, np.int64)
        return {
            name: np.asarray(values, dtype=kind.get(name, np.float64))
            for name, values in self.columns.items()
        }

    def error_over_time(self) -> dict[tuple[str, str], ErrorOverTime]:
        """By condition and trajectory, of the length that most subjects had."""
        found: dict[tuple[str, str], ErrorOverTime] = {}
        for (condition, trajectory, _), running in self._errors.items():
            result, key = running.result(), (condition, trajectory)
            if key not in found or result.count.max() > found[key].count.max():
                found[key] = result
        return found

    def summary_fields(self) -> dict[str, Any]:
        """Return what the summaries of both experiments have in common."""
        base = self.base
        return {
            "simulated": self.simulated,
            "participants": list(
                dict.fromkeys(who for name, who in self.folders if name == base)
            ),
            "base": base,
            "attempts": self.attempts,
            "settings": self.settings,
            "redrawn": self.redrawn,
            "faults": self.faults,
            "sessions": self.sessions,
            "folders": self.folders,
        }
