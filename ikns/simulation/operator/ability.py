"""How able a virtual operator is: numbers, typical or drawn from a population."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ikns.errors import InvalidInput

__all__ = [
    "CONDITIONS",
    "Ability",
    "parameters",
    "phase_margin",
    "sample_abilities",
    "typical",
]

#: What an operator may hold: the elbow, or a stick.
CONDITIONS = ("ikns", "gamepad")
#: People lower their gain rather than swing: a draw with less is drawn again, rad.
#: Phase margins measured with the crossover model are 30 to 60 deg (recalled from
#: McRuer and Jex 1967); below 20 deg nobody tracks.
LEAST_MARGIN = math.radians(20.0)
_TRIES = 1000


@dataclass(frozen=True)
class Ability:
    """Parameters of a virtual operator; where each is from: ``parameters.toml``.

    Parameters
    ----------
    crossover : float
        Gain of the loop, rad/s.
    delay : float
        From seeing to acting, s.
    preview : float
        How far ahead of the pointer the person looks, s.
    limb_frequency, limb_damping : float
        Of the second-order lag of nerves and muscles, rad/s and 1.
    remnant, remnant_bandwidth : float
        Standard deviation (c) and bandwidth (rad/s) of noise at the perceived error.
    signal_noise : float
        Noise in proportion to the command.
    novice, practice : float
        Both noises are ``1 + novice exp(-trial / practice)`` as large in a trial.
    """

    crossover: float
    delay: float
    preview: float
    limb_frequency: float
    limb_damping: float
    remnant: float
    remnant_bandwidth: float
    signal_noise: float
    novice: float
    practice: float

    def __post_init__(self) -> None:
        """Refuse what nobody can be."""
        above = {"crossover", "delay", "limb_frequency", "limb_damping"}
        above |= {"remnant_bandwidth", "practice"}
        for field in fields(self):
            value = getattr(self, field.name)
            least = "above 0" if field.name in above else "of at least 0"
            if not (value > 0 if field.name in above else value >= 0) or value > 1e6:
                raise InvalidInput(
                    f"expected {field.name} {least} and finite, found {value:g}."
                )

    def practised(self, trial: float) -> Ability:
        """Return the ability at a trial, counted from 0: less noise with practice."""
        more = 1 + self.novice * math.exp(-trial / self.practice)
        return replace(
            self,
            remnant=self.remnant * more,
            signal_noise=self.signal_noise * more,
            novice=0.0,
        )

    def noiseless(self) -> Ability:
        """Return the same person without any noise: a linear system."""
        return replace(self, remnant=0.0, signal_noise=0.0, novice=0.0)


@cache
def parameters(condition: str = "ikns") -> dict[str, dict[str, Any]]:
    """Table of all parameters with unit, spread, limits and source."""
    if condition not in CONDITIONS:
        raise InvalidInput(
            f"expected a condition of {', '.join(CONDITIONS)}, found '{condition}'."
        )
    text = files("ikns.simulation.operator").joinpath("parameters.toml").read_text()
    table = tomllib.loads(text)
    rows = {field.name: table[field.name] for field in fields(Ability)}
    return {k: row | table.get(condition, {}).get(k, {}) for k, row in rows.items()}


def typical(condition: str = "ikns") -> Ability:
    """Return the ability in the middle of the population.

    Examples
    --------
    >>> typical().delay, typical("gamepad").delay
    (0.2, 0.15)
    """
    return Ability(**{name: row["mean"] for name, row in parameters(condition).items()})


def sample_abilities(
    n: int, *, seed: int, condition: str = "ikns", latency: float = 0.05
) -> list[Ability]:
    """Draw virtual operators, independently of one another.

    The same person with another device keeps the place in the population: with one
    seed, whoever is slow with the elbow is slow with the stick.

    Parameters
    ----------
    n : int
    seed : int
        The first k of n are those of k with the same seed.
    condition : {"ikns", "gamepad"}
    latency : float
        Of the system that they learn, s: it counts in the phase margin, which is never
        below :data:`LEAST_MARGIN`.
    """
    table = parameters(condition)
    return [_drawn(table, np.random.default_rng([seed, k]), latency) for k in range(n)]


def phase_margin(ability: Ability, *, latency: float = 0.0) -> float:
    """How far the loop is from swinging, rad, by the crossover model with the limb.

    Found where ``w_c |limb(j w)| / w = 1``, the only such frequency for a damping of
    0.5 and more.
    """
    low, high = 0.0, 2 * ability.crossover + ability.limb_frequency
    for _ in range(80):
        middle = (low + high) / 2
        louder = ability.crossover * abs(_limb(ability, middle)) > middle
        low, high = (middle, high) if louder else (low, middle)
    phase = -np.pi / 2 + float(np.angle(_limb(ability, low)))
    return float(np.pi + phase - low * (ability.delay + latency))


def _limb(ability: Ability, omega: float) -> complex:
    own = ability.limb_frequency
    return own**2 / (own**2 - omega**2 + 2j * ability.limb_damping * own * omega)


def _drawn(
    table: dict[str, dict[str, Any]], rng: np.random.Generator, latency: float
) -> Ability:
    for _ in range(_TRIES):
        # A fixed number of draws a try: devices differ in the table, not in the luck.
        luck = rng.normal(size=len(table))
        values = {}
        for (name, row), z in zip(table.items(), luck, strict=True):
            if row.get("log"):
                value = row["mean"] * math.exp(row["sd"] * z)
            else:
                value = row["mean"] + row["sd"] * z
            values[name] = float(min(max(value, row["low"]), row["high"]))
        ability = Ability(**values)
        if phase_margin(ability, latency=latency) >= LEAST_MARGIN:
            return ability
    raise InvalidInput(
        f"no operator keeps a phase margin with a latency of {latency:g} s."
    )
