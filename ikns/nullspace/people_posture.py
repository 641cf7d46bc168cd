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


class People(NamedTuple):
    """Natural posture of a population: quadratics in the wrist center.

    Parameters
    ----------
    mean : (10,) array
        Coefficients of :func:`ikns.nullspace.natural_posture.quadratic_terms`, rad.
    covariance : (10, 10) array
        Between arms of different people, rad^2.
    leverage : (10, 10) array
        Matrix of the leverage over all their movements.
    taught_leverage : float
        99th percentile of the leverage over all their movements.
    arms : int
        How many arms they are from.
    source, license : str
    """

    mean: Array
    covariance: Array
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
        mean = np.array(table["mean_rad"], dtype=np.float64)
        covariance = np.array(table["covariance_rad2"], dtype=np.float64)
        leverage = np.array(table["leverage"], dtype=np.float64)
        if {mean.shape * 2, covariance.shape, leverage.shape} != {(10, 10)}:
            raise ValueError(f"{mean.shape}, {covariance.shape}, {leverage.shape}")
        return People(
            mean,
            covariance,
            leverage,
            float(table["taught_leverage"]),
            int(table["arms"]),
            table["source"],
            table["license"],
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise FileError(f"{_PEOPLE}: cannot be read: {error!r}.") from None
