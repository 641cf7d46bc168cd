"""The person who picks: what to do next, decided by what is seen and felt."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np

from ikns.errors import InvalidInput
from ikns.simulation.grasp.physics import Seen

__all__ = ["Habits", "Person", "draw_habits", "habit_table"]

Doing = Literal["opening", "reaching", "closing", "carrying", "placing", "releasing"]

#: A finger that is flexed less looks open.
OPEN = 0.08
#: Share of the finger's full effort from which it is felt to press.
PRESSES = 0.25


@dataclass(frozen=True)
class Habits:
    """How a person picks; where each number is from: ``habits.toml``.

    Parameters
    ----------
    reaction : float
        From something seen or felt to acting, s.
    check : float
        Looking before the next step, s.
    pace : float
        Times of reaches, as a multiple of the usual.
    squeeze : float
        How far beyond the contact the person aims while holding, c.
    """

    reaction: float
    check: float
    pace: float
    squeeze: float

    def __post_init__(self) -> None:
        """Refuse what nobody does."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value < math.inf or (field.name == "pace" and not value):
                raise InvalidInput(
                    f"expected a positive and finite {field.name}, found {value:g}."
                )

    def aiming(self, squeeze: float) -> Habits:
        """Return the same person who aims this far beyond the contact."""
        return replace(self, squeeze=squeeze)


@cache
def habit_table() -> dict[str, dict[str, Any]]:
    """Table of all numbers with unit, spread, limits and source."""
    text = files("ikns.simulation.grasp").joinpath("habits.toml").read_text("utf-8")
    return tomllib.loads(text)


def draw_habits(seed: int | np.random.SeedSequence) -> Habits:
    """Draw a person's habits.

    >>> draw_habits(0) == draw_habits(0)
    True
    """
    table = habit_table()
    luck = np.random.default_rng(seed).normal(size=len(table))
    drawn = {}
    for (name, row), z in zip(table.items(), luck, strict=True):
        if row.get("log"):
            value = row["mean"] * math.exp(row["sd"] * z)
        else:
            value = row["mean"] + row["sd"] * z
        drawn[name] = float(min(max(value, row["low"]), row["high"]))
    return Habits(**drawn)


class Person:
    """Decides, frame by frame; six steps, none of which is skipped.

    opening: the finger is to look open, hand above the object. reaching: the hand comes
    down. closing: until the finger is felt to press. carrying: the hand goes to the
    goal. placing: a look. releasing: the finger is to open.

    Parameters
    ----------
    habits : Habits
    down, across : float
        How long the reaches take, s, before pace.

    Attributes
    ----------
    doing : str
    place : float
        Of the hand on its way, -1 above the object, 0 at it, 1 at the goal.
    want : float
        What the finger is meant to be told, 0 to 1.
    """

    def __init__(self, habits: Habits, *, down: float, across: float) -> None:
        self.habits = habits
        self.doing: Doing = "opening"
        self.place, self.want = -1.0, 0.0
        self._times = {
            "reaching": down * habits.pace,
            "carrying": across * habits.pace,
        }
        self._since, self._began = math.nan, 0.0

    def step(self, now: float, seen: Seen) -> None:
        """Take what is seen and felt at a time, s; set `place` and `want`."""
        habits, doing = self.habits, self.doing
        if doing == "opening":
            if self._lasts(now, seen.flexion < OPEN, habits.reaction):
                self._begin(now, "reaching")
        elif doing == "reaching":
            self.place = self._way(now) - 1.0
            if self._lasts(now, self.place >= 0.0, habits.check):
                self._begin(now, "closing")
                self.want = 1.0
        elif doing == "closing":
            presses = seen.load >= PRESSES
            if self._lasts(now, presses, habits.reaction + habits.check):
                self._begin(now, "carrying")
                self.want = min(1.0, seen.flexion + habits.squeeze)
        elif doing == "carrying":
            self.place = self._way(now)
            if self.place >= 1.0:
                self._begin(now, "placing")
        elif doing == "placing" and self._lasts(now, True, habits.check):
            self._begin(now, "releasing")
            self.want = 0.0

    def _way(self, now: float) -> float:
        share = min((now - self._began) / self._times[self.doing], 1.0)
        return float(share**3 * (10 - 15 * share + 6 * share**2))

    def _begin(self, now: float, doing: Doing) -> None:
        self.doing, self._began, self._since = doing, now, math.nan

    def _lasts(self, now: float, true: bool, seconds: float) -> bool:
        if not true:
            self._since = math.nan
        elif math.isnan(self._since):
            self._since = now
        return true and now - self._since >= seconds
