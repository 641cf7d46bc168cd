"""Parameters of a virtual operator, typical or drawn from a population."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ikns.errors import InvalidInput
from ikns.simulation.parameter_table import draw_parameters

#: Conditions that an operator can do: with the elbow, or with a stick.
CONDITIONS = ("ikns", "gamepad")
#: Smallest phase margin, rad; a draw with less is repeated, as people lower their gain
#: rather than oscillate.
#: Phase margins measured with the crossover model are 30 to 60 deg (recalled from
#: McRuer and Jex 1967); tracking is not possible below 20 deg.
LEAST_MARGIN = math.radians(20.0)
_TRIES = 1000


@dataclass(frozen=True)
class Ability:
    """Parameters of a virtual operator; ``parameters.toml`` gives their sources.

    Parameters
    ----------
    crossover : float
        Gain of the loop, rad/s.
    delay : float
        Visuomotor delay, s.
    preview : float
        How far ahead of the pointer the person sees the curve, s.
    limb_frequency, limb_damping : float
        Natural frequency (rad/s) and damping ratio of the second-order neuromuscular
        lag.
    remnant, remnant_bandwidth : float
        Standard deviation (c) and bandwidth (rad/s) of noise at the perceived error.
    signal_noise : float
        Standard deviation of noise in proportion to the command.
    novice, practice : float
        Both noises are multiplied by ``1 + novice exp(-trial / practice)``.
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
        """Check that all parameters are possible."""
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
        """Return the same person without noise: a linear system."""
        return replace(self, remnant=0.0, signal_noise=0.0, novice=0.0)


@cache
def parameters(condition: str = "ikns") -> dict[str, dict[str, Any]]:
    """Return the table of all parameters with unit, spread, limits and source."""
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

    >>> typical().delay, typical("gamepad").delay
    (0.2, 0.15)
    """
    return Ability(**{name: row["mean"] for name, row in parameters(condition).items()})


def sample_abilities(
    n: int, *, seed: int, condition: str = "ikns", latency: float = 0.05
) -> list[Ability]:
    """Draw virtual operators, independently of one another.

    A person has the same rank in the population with every device: with one seed, who
    is slow with the elbow is slow with the stick. The first k of n are those of k with
    the same seed. The latency of the system, s, lowers the phase margin, which is never
    below :data:`LEAST_MARGIN`.
    """
    table = parameters(condition)
    return [_drawn(table, np.random.default_rng([seed, k]), latency) for k in range(n)]


def phase_margin(ability: Ability, *, latency: float = 0.0) -> float:
    """Phase margin of the loop, rad: crossover model with the limb's lag.

    It is taken where ``w_c |limb(j w)| / w = 1``, a unique frequency for a damping
    ratio of at least 0.5.
    """
    low, high = 0.0, 2 * ability.crossover + ability.limb_frequency
    for _ in range(80):
        middle = (low + high) / 2
        above = ability.crossover * abs(_limb(ability, middle)) > middle
        low, high = (middle, high) if above else (low, middle)
    phase = -np.pi / 2 + float(np.angle(_limb(ability, low)))
    return float(np.pi + phase - low * (ability.delay + latency))


def _limb(ability: Ability, omega: float) -> complex:
    own = ability.limb_frequency
    return own**2 / (own**2 - omega**2 + 2j * ability.limb_damping * own * omega)


def _drawn(
    table: dict[str, dict[str, Any]], rng: np.random.Generator, latency: float
) -> Ability:
    for _ in range(_TRIES):
        # The same number of draws for each device keeps a person's rank.
        ability = Ability(**draw_parameters(table, rng))
        if phase_margin(ability, latency=latency) >= LEAST_MARGIN:
            return ability
    raise InvalidInput(
        f"no operator has enough phase margin with a latency of {latency:g} s; choose "
        "a shorter one."
    )
