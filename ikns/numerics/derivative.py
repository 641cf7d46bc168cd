"""Velocity from sampled values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

__all__ = ["slope"]

#: Width of the fit, s; voluntary motion of the arm is below about 5 Hz.
WINDOW = 0.2


def slope(
    values: NDArray[np.float64], time: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Time derivative by a moving parabola (Savitzky and Golay 1964).

    Parameters
    ----------
    values : (T, ...) array
        Any quantity.
    time : (T,) array
        Seconds, evenly spaced.

    Returns
    -------
    (T, ...) array
        Slope of the parabola fitted over ``WINDOW`` around each sample; zero for a
        single sample.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(100) / 100
    >>> slope(3 * time, time)[50].round(9)
    np.float64(3.0)
    """
    if len(time) < 2:
        return np.zeros_like(values)
    step = float(time[-1] - time[0]) / (len(time) - 1)
    window = 2 * round(WINDOW / step / 2) + 1
    window = min(window, len(time) - 1 + len(time) % 2)
    if window < 5:
        return np.asarray(np.gradient(values, step, axis=0))
    return np.asarray(
        savgol_filter(values, window, polyorder=2, deriv=1, delta=step, axis=0)
    )
