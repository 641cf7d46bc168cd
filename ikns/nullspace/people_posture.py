"""The natural posture of a population, which ships with the package."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError

_PEOPLE = Path(__file__).with_name("natural_posture_people.toml")

_KEYS = {
    "mean": "mean_rad",
    "covariance": "covariance_rad2",
    "wrist_alone": "wrist_alone_rad",
    "leverage": "leverage",
}
_SHAPES = [(13,), (13, 13), (10,), (10, 10)]


class People(NamedTuple):
    """Natural posture of a population, in wrist and hand.

    Parameters
    ----------
    mean : (13,) array
        Coefficients of :func:`ikns.nullspace.posture_terms.natural_terms`, rad.
    covariance : (13, 13) array
        Between arms of different people, rad^2.
    wrist_alone : (10,) array
        Coefficients without the hand's direction, rad.
    leverage : (10, 10) array
        Matrix of the leverage of the wrist's terms over all their movements.
    taught_leverage : float
        99th percentile of the leverage over all their movements.
    arms : int
        How many arms they are from.
    source, license : str
    """

    mean: Array
    covariance: Array
    wrist_alone: Array
    leverage: Array
    taught_leverage: float
    arms: int
    source: str
    license: str


@cache
def natural_posture_people() -> People:
    """Return the population that ships with the package.

    Made by ``benchmarks/natural_posture_people.py``.

    Raises
    ------
    FileError
        When the file is damaged.
    """
    try:
        table = tomllib.loads(_PEOPLE.read_text(encoding="utf-8"))
        arrays = {
            name: np.array(table[key], dtype=np.float64) for name, key in _KEYS.items()
        }
        if (found := [array.shape for array in arrays.values()]) != _SHAPES:
            raise ValueError(f"arrays {found}")
        return People(
            **arrays,
            taught_leverage=float(table["taught_leverage"]),
            arms=int(table["arms"]),
            source=table["source"],
            license=table["license"],
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise FileError(f"{_PEOPLE}: cannot be read: {error!r}.") from None
