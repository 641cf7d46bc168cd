"""Plausible adults, drawn from the statistics of a large survey."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from operator import index

import numpy as np

from ikns.arrays import Array
from ikns.body.anthropometry.lengths import SURFACE_MEASURES, person_length
from ikns.body.anthropometry.measures import expected_measure
from ikns.body.anthropometry.tables import normalize_sex, row, table
from ikns.errors import InvalidInput

#: Stature and every residual stay within this many standard deviations of their means.
TRUNCATION = 3.0

_MEASURES = tuple(SURFACE_MEASURES.values())


@dataclass(frozen=True)
class Adult:
    """One person of the population.

    Parameters
    ----------
    sex : str
        "female" or "male".
    stature_m, mass_kg : float
        Meters, kilograms.
    lengths_m : mapping of str to float
        Distances of joint centers by segment, meters; ready for
        ``segments(stature_m, mass_kg, sex, lengths=lengths_m)``.
    measures_m : mapping of str to float
        Surface measures by row of ``ansur2``, meters.
    """

    sex: str
    stature_m: float
    mass_kg: float
    lengths_m: Mapping[str, float]
    measures_m: Mapping[str, float]


def sample_adults(
    n: int, *, seed: int | np.random.Generator, sex: str | None = None
) -> list[Adult]:
    """Draw people with the statistics of ANSUR II (soldiers: young, fit adults).

    Stature is normal; each surface measure is its regression on stature plus a normal
    residual with the standard error of estimate. Residuals are independent, as their
    correlations are not published, except those of forearm and hand (see
    ``ansur2.toml``). The logarithm of mass is normal and correlated with stature such
    that mass itself has the table's mean, deviation and correlation. Stature and
    residuals beyond three standard deviations are drawn again, which reduces the
    deviations by 1.3 %. Distances of joint centers: see ``person_length``.

    Parameters
    ----------
    n : int
        How many people.
    seed : int or numpy.random.Generator
        Same seed, same people.
    sex : str, optional
        "female" or "male"; without it each person is either with equal chance.

    Returns
    -------
    list of Adult

    Raises
    ------
    InvalidInput
        When `n` or `seed` is not a whole number, 0 or more, or the sex is unknown.

    Examples
    --------
    >>> person = sample_adults(3, seed=1, sex="female")[0]
    >>> person.sex, 1.4 < person.stature_m < 1.9
    ('female', True)
    """
    count = _whole_number(n)
    generator = _generator(seed)
    is_male = generator.integers(2, size=count) == 1
    if sex is not None:
        is_male[:] = normalize_sex(sex) == "male"
    deviates = _deviates(count, generator)
    women = iter(_adults(deviates[~is_male], "female"))
    men = iter(_adults(deviates[is_male], "male"))
    return [next(men if male else women) for male in is_male]


def _whole_number(n: int) -> int:
    try:
        count = index(n)
    except TypeError:
        count = -1
    if count < 0:
        raise InvalidInput(f"n is {n!r}, expected how many adults to draw, 0 or more.")
    return count


def _generator(seed: int | np.random.Generator) -> np.random.Generator:
    if isinstance(seed, np.random.Generator):
        return seed
    try:
        return np.random.default_rng(index(seed))
    except (TypeError, ValueError):
        raise InvalidInput(
            f"seed is {seed!r}, expected a whole number, 0 or more, or a "
            "numpy.random.Generator."
        ) from None


def _deviates(count: int, generator: np.random.Generator) -> Array:
    """Standardized stature, mass residual and measure residuals, (count, 6)."""
    size = 2 + len(_MEASURES)
    correlation = np.eye(size)
    known = table("ansur2")["residual_correlation"]
    for i, first in enumerate(_MEASURES):
        for j, second in enumerate(_MEASURES):
            if second in known.get(first, {}):
                value = known[first][second]
                correlation[2 + i, 2 + j] = correlation[2 + j, 2 + i] = value
    mixing = np.linalg.cholesky(correlation).T
    deviates = np.full((count, size), np.inf)
    while (outside := (np.abs(deviates) > TRUNCATION).any(axis=1)).any():
        fresh = generator.standard_normal((int(outside.sum()), size))
        deviates[outside] = fresh @ mixing
    return deviates


def _adults(deviates: Array, sex: str) -> list[Adult]:
    """People of one sex from their (N, 6) deviates."""
    height = row("ansur2", "stature", sex=sex)
    stature = (height["mean_mm"] + height["sd_mm"] * deviates[:, 0]) / 1000
    measures = {}
    for name, residual in zip(_MEASURES, deviates[:, 2:].T, strict=True):
        see = row("ansur2", name, sex=sex)["see_mm"] / 1000
        measures[name] = expected_measure(name, stature, sex) + see * residual
    lengths = {
        name: person_length(name, stature, measures[surface], sex)
        for name, surface in SURFACE_MEASURES.items()
    }
    mass = _mass(deviates[:, 0], deviates[:, 1], sex)
    return [
        Adult(
            sex=sex,
            stature_m=float(stature[i]),
            mass_kg=float(mass[i]),
            lengths_m={name: float(value[i]) for name, value in lengths.items()},
            measures_m={name: float(value[i]) for name, value in measures.items()},
        )
        for i in range(len(stature))
    ]


def _mass(stature_deviate: Array, residual: Array, sex: str) -> Array:
    """Log-normal mass, kg: mass is skewed, and a normal one could be too low."""
    body = row("ansur2", "body_mass", sex=sex)
    variation = (body["sd_kg"] / body["mean_kg"]) ** 2
    sigma = np.sqrt(np.log1p(variation))
    r = body["r"] * np.sqrt(variation) / sigma
    deviate = r * stature_deviate + np.sqrt(1 - r**2) * residual
    return np.asarray(body["mean_kg"] * np.exp(sigma * deviate - sigma**2 / 2))
