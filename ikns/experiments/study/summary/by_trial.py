"""RMSE by the number of the trial, over participants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array


class TrialMeans(NamedTuple):
    """Mean RMSE of every trial of a condition.

    Parameters
    ----------
    trial : (K,) array
        Numbers of the trials, increasing.
    mean : (K,) array
        Over participants, of 100.
    deviation : (K,) array
        Standard deviation over participants; 0 with one.
    """

    trial: Array
    mean: Array
    deviation: Array


def rmse_by_trial(
    table: Mapping[str, NDArray[Any]], condition: str, *, center: bool
) -> TrialMeans:
    """Return the mean RMSE by trial.

    Parameters
    ----------
    table : mapping of columns
        ``condition``, ``trajectory``, ``trial`` and ``rmse``; a row is a trial.
    condition : str
    center : bool
        Whether to take out each trajectory's own difficulty: the difference of its
        mean from that of all trials.

    Examples
    --------
    >>> table = {
    ...     "condition": np.array(["ikns"] * 4),
    ...     "trajectory": np.array(["T1", "T2", "T1", "T2"]),
    ...     "trial": np.array([1, 2, 2, 1]),
    ...     "rmse": np.array([3.0, 5.0, 2.0, 6.0]),
    ... }
    >>> rmse_by_trial(table, "ikns", center=True).mean
    array([4.5, 3.5])
    """
    rows = table["condition"] == condition
    y, number = table["rmse"][rows].astype(float), table["trial"][rows]
    if center and len(y):
        where = table["trajectory"][rows]
        for name in np.unique(where):
            y = np.where(where == name, y - y[where == name].mean(), y)
        y = y + float(table["rmse"][rows].mean())
    once = np.unique(number)
    groups = [y[number == k] for k in once]
    return TrialMeans(
        once.astype(float),
        np.array([group.mean() for group in groups]),
        np.array([group.std(ddof=1) if len(group) > 1 else 0.0 for group in groups]),
    )
