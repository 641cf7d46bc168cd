"""Surface measures of people of a given stature, and which statures are plausible."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.anthropometry.tables import row
from ikns.errors import InvalidInput

#: What is plausible for adults, with the unit and what may have been given instead.
#: Statures: wide enough for short and tall people, narrow enough to detect centimeters
#: and feet.
_PLAUSIBLE = {
    "stature": (1.2, 2.3, "m", "did you give centimeters or feet?"),
    "mass": (25.0, 250.0, "kg", "did you give grams or pounds?"),
    "biacromial breadth": (
        0.2,
        0.6,
        "m",
        "did you give millimeters, or half the breadth?",
    ),
}


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


def checked_measure(what: str, value: ArrayLike) -> Array:
    """Return a stature, mass or biacromial breadth as an array, m or kg, or refuse it.

    Raises
    ------
    InvalidInput
        When it is not a number or not an adult's.
    """
    low, high, unit, hint = _PLAUSIBLE[what]
    try:
        number = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(
            f"{what} is {value!r}, expected a number between {low:g} and {high:g} "
            f"{unit}."
        ) from None
    plausible = (number >= low) & (number <= high)  # false for NaN
    if not plausible.all():
        wrong = float(number[~plausible].flat[0])
        raise InvalidInput(
            f"{what} is {wrong:g} {unit}, expected {low:g} to {high:g} {unit}"
            f"{f'; {hint}' if wrong > 0 else '.'}"
        )
    return number
