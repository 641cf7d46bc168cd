"""Surface measures of people of a given stature, and which statures are plausible."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.anthropometry.tables import row
from ikns.errors import InvalidInput

__all__ = [
    "MASS_LIMITS",
    "STATURE_LIMITS",
    "check_biacromial",
    "check_mass",
    "check_stature",
    "expected_measure",
]

#: Plausible statures of adults, meters: wide enough for short and tall people, narrow
#: enough to detect centimeters and feet.
STATURE_LIMITS = (1.2, 2.3)

#: Plausible masses of adults, kilograms.
MASS_LIMITS = (25.0, 250.0)

#: Plausible biacromial breadths of adults, meters.
BIACROMIAL_LIMITS = (0.2, 0.6)


def check_stature(stature: ArrayLike) -> Array:
    """Return stature as an array, m, or refuse it outside :data:`STATURE_LIMITS`."""
    return _within(
        stature, STATURE_LIMITS, "stature", "m", "did you give centimeters or feet?"
    )


def check_mass(mass: ArrayLike) -> Array:
    """Return mass as an array, kg, or refuse it outside :data:`MASS_LIMITS`."""
    return _within(mass, MASS_LIMITS, "mass", "kg", "did you give grams or pounds?")


def check_biacromial(breadth: ArrayLike) -> Array:
    """Return biacromial breadth as an array, m, or refuse it likewise."""
    return _within(
        breadth,
        BIACROMIAL_LIMITS,
        "biacromial breadth",
        "m",
        "did you give millimeters, or half the breadth?",
    )


def expected_measure(name: str, stature: ArrayLike, sex: str) -> Array:
    """Mean of an ANSUR II measure among people of a stature, meters.

    The regression line ``mean + r * sd / sd_stature * (stature - mean_stature)`` of a
    row of ``ansur2`` that has a correlation with stature.
    """
    measure = row("ansur2", name, sex=sex)
    height = row("ansur2", "stature", sex=sex)
    slope = measure["r"] * measure["sd_mm"] / height["sd_mm"]
    above = np.asarray(stature, dtype=np.float64) - height["mean_mm"] / 1000
    return np.asarray(measure["mean_mm"] / 1000 + slope * above)


def _within(
    value: ArrayLike, limits: tuple[float, float], what: str, unit: str, hint: str
) -> Array:
    low, high = limits
    try:
        number = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(
            f"{what} is {value!r}, expected a number between {low:g} and {high:g} "
            f"{unit}."
        ) from None
    plausible = (number >= low) & (number <= high)  # false for NaN
    if not plausible.all():
        raise InvalidInput(
            f"{what} is {number[~plausible].flat[0]:g} {unit}, expected {low:g} to "
            f"{high:g} {unit}; {hint}"
        )
    return number
