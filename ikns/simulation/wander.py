"""Smooth random processes for involuntary movement: drift and tremor."""

from __future__ import annotations

from functools import cache

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput

#: Physiological tremor of the arm, Hz.
_TREMOR_BAND = (8.0, 12.0)


def wander(
    rng: np.random.Generator,
    n: int,
    width: int,
    *,
    sd: float,
    cutoff: float,
    rate: float,
) -> Array:
    """Slow drift around zero, (n, width): noise through a second-order low-pass.

    Its velocity has a standard deviation of ``2 pi cutoff sd``: the second moment of
    the Butterworth spectrum of order two is the square of its cut-off.
    """
    return _filtered(rng, n, width, sd, cutoff, rate, settle=int(3 * rate / cutoff))


def tremor(
    rng: np.random.Generator, n: int, width: int, *, sd: float, rate: float
) -> Array:
    """Physiological tremor: Gaussian noise in the band of 8 to 12 Hz, (n, width).

    Raises
    ------
    InvalidInput
        When the rate cannot show the band.
    """
    if not rate > 2 * _TREMOR_BAND[1]:
        raise InvalidInput(
            f"expected a rate above {2 * _TREMOR_BAND[1]:g} Hz, which tremor of up to "
            f"{_TREMOR_BAND[1]:g} Hz needs, found {rate:g}."
        )
    return _filtered(rng, n, width, sd, _TREMOR_BAND, rate, settle=int(rate))


def minimum_jerk(n: int) -> Array:
    """Return the minimum-jerk path from 0 to 1 (Flash and Hogan 1985), (n,).

    ``10 s^3 - 15 s^4 + 6 s^5``, s from one sample after the start to the end.
    """
    s = np.arange(1, n + 1) / n
    return s**3 * (10 - 15 * s + 6 * s**2)


Edges = float | tuple[float, float]


@cache
def _filter(edges: Edges, rate: float, settle: int) -> tuple[Array, float]:
    """Filter with these edges, Hz, and its gain of white noise."""
    from scipy.signal import butter, sosfilt  # slow to load

    kind = "bandpass" if isinstance(edges, tuple) else "lowpass"
    sos = butter(2, edges, btype=kind, fs=rate, output="sos")
    impulse = np.zeros(20 * settle)
    impulse[0] = 1.0
    return sos, np.sqrt(np.sum(sosfilt(sos, impulse) ** 2))


def _filtered(
    rng: np.random.Generator,
    n: int,
    width: int,
    sd: float,
    edges: Edges,
    rate: float,
    *,
    settle: int,
) -> Array:
    from scipy.signal import sosfilt

    sos, gain = _filter(edges, rate, settle)
    noise = rng.normal(size=(settle + n, width))
    return np.asarray(sosfilt(sos, noise, axis=0)[settle:]) * (sd / gain)
