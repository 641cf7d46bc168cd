"""The person who picks: a state machine driven by what is seen and felt."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np

from ikns.errors import InvalidInput
from ikns.simulation.grasp.physics import Observation
from ikns.simulation.parameter_table import draw_parameters

Phase = Literal["opening", "reaching", "closing", "carrying", "placing", "releasing"]

#: The finger looks open below this flexion.
OPEN_FLEXION = 0.08
#: Share of the finger's full effort above which its pressing is felt.
PRESSING_LOAD = 0.25


@dataclass(frozen=True)
class Habits:
    """How a person picks; ``habits.toml`` has the sources of the numbers.

    Parameters
    ----------
    reaction : float
        Reaction time to something seen or felt, s.
    check : float
        Time to look before the next step, s.
    pace : float
        Duration of reaches, relative to the usual one.
    squeeze : float
        How far beyond the contact the command goes while holding, c.
    """

    reaction: float
    check: float
    pace: float
    squeeze: float

    def __post_init__(self) -> None:
        """Check that all numbers are possible."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value < math.inf or (field.name == "pace" and not value):
                raise InvalidInput(
                    f"expected a positive and finite {field.name}, found {value:g}."
                )

    def with_squeeze(self, squeeze: float) -> Habits:
        """Return the same person with another squeeze."""
        return replace(self, squeeze=squeeze)


@cache
def habit_table() -> dict[str, dict[str, Any]]:
    """Return the table of all numbers with unit, spread, limits and source."""
    text = files("ikns.simulation.grasp").joinpath("habits.toml").read_text("utf-8")
    return tomllib.loads(text)


def draw_habits(seed: int | np.random.SeedSequence) -> Habits:
    """Draw a person's habits.

    >>> draw_habits(0) == draw_habits(0)
    True
    """
    return Habits(**draw_parameters(habit_table(), np.random.default_rng(seed)))


class Person:
    """A person who goes through six phases in order.

    opening: wait until the finger looks open, the hand above the object. reaching: the
    hand moves down. closing: until pressing is felt. carrying: the hand moves to the
    goal. placing: check. releasing: the finger opens. For a pace of 1 the reaches take
    `down` and `across`, s. `place` is the position of the hand on its route (-1 above
    the object, 0 at it, 1 at the goal), `command` the intended one to the finger, 0 to
    1.
    """

    def __init__(self, habits: Habits, *, down: float, across: float) -> None:
        self.habits = habits
        self.phase: Phase = "opening"
        self.place, self.command = -1.0, 0.0
        self._times = {
            "reaching": down * habits.pace,
            "carrying": across * habits.pace,
        }
        self._since, self._began = math.nan, 0.0

    def step(self, now: float, seen: Observation) -> None:
        """Take what is seen and felt at a time (s); set `place` and `command`."""
        habits, phase = self.habits, self.phase
        if phase == "opening":
            if self._lasts(now, seen.flexion < OPEN_FLEXION, habits.reaction):
                self._begin(now, "reaching")
        elif phase == "reaching":
            self.place = self._progress(now) - 1.0
            if self._lasts(now, self.place >= 0.0, habits.check):
                self._begin(now, "closing")
                self.command = 1.0
        elif phase == "closing":
            presses = seen.load >= PRESSING_LOAD
            if self._lasts(now, presses, habits.reaction + habits.check):
                self._begin(now, "carrying")
                self.command = min(1.0, seen.flexion + habits.squeeze)
        elif phase == "carrying":
            self.place = self._progress(now)
            if self.place >= 1.0:
                self._begin(now, "placing")
        elif phase == "placing" and self._lasts(now, True, habits.check):
            self._begin(now, "releasing")
            self.command = 0.0

    def _progress(self, now: float) -> float:
        share = min((now - self._began) / self._times[self.phase], 1.0)
        return float(share**3 * (10 - 15 * share + 6 * share**2))

    def _begin(self, now: float, phase: Phase) -> None:
        self.phase, self._began, self._since = phase, now, math.nan

    def _lasts(self, now: float, true: bool, seconds: float) -> bool:
        if not true:
            self._since = math.nan
        elif math.isnan(self._since):
            self._since = now
        return true and now - self._since >= seconds
