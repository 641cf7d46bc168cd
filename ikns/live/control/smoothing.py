"""Causal smoothing of one signal with the one-euro filter, and its delay.

A first-order low-pass filter whose cut-off rises with the speed of the signal: slow
parts are smoothed, fast parts are hardly delayed. G. Casiez, N. Roussel and D. Vogel
(2012), 1 Euro filter, CHI, doi 10.1145/2207676.2208639.
"""

from __future__ import annotations

import math

from ikns.errors import InvalidInput


class OneEuro:
    """A one-euro filter.

    Parameters
    ----------
    cutoff : float
        Cut-off frequency for a signal at rest, Hz.
    beta : float
        Increase of the cut-off with the signal's speed, Hz per (unit / s). The speed is
        taken from the last output to the new input, as in the publication, so it is
        overestimated while the output lags behind.
    speed_cutoff : float
        Cut-off frequency for the speed, Hz; 1 in the publication.

    Attributes
    ----------
    value : float
        The last output; NaN before the first sample.
    delay : float
        Delay of a steadily moving signal at the last cut-off, s: ``dt (1 - a) / a`` for
        steps dt and the share a of each innovation that passes.

    Examples
    --------
    >>> smooth = OneEuro(cutoff=1.0, beta=0.0)
    >>> [round(smooth.step(x, 0.01), 3) for x in (0.0, 1.0, 1.0)]
    [0.0, 0.059, 0.115]
    """

    def __init__(
        self, *, cutoff: float = 1.0, beta: float = 0.5, speed_cutoff: float = 1.0
    ) -> None:
        for name, value in (("cutoff", cutoff), ("speed_cutoff", speed_cutoff)):
            if not 0 < value < math.inf:
                raise InvalidInput(f"expected a positive {name} in Hz, found {value}.")
        if not 0 <= beta < math.inf:
            raise InvalidInput(f"expected a beta of at least 0, found {beta}.")
        self._cutoff, self._beta, self._speed_cutoff = cutoff, beta, speed_cutoff
        self.reset()

    def reset(self) -> None:
        """Reset: the next sample passes unchanged."""
        self.value = math.nan
        self.delay = 0.0
        self._speed = 0.0

    def step(self, x: float, dt: float) -> float:
        """Return the smoothed signal after one more sample.

        Parameters
        ----------
        x : float
            NaN and infinity leave the value unchanged.
        dt : float
            Time since the last sample, s; zero or less leaves the value unchanged.
        """
        if not math.isfinite(x):
            return self.value
        if math.isnan(self.value):
            self.value = x
            return x
        if not 0 < dt < math.inf:
            return self.value
        speed = (x - self.value) / dt
        speed = self._speed + _share(self._speed_cutoff, dt) * (speed - self._speed)
        share = _share(self._cutoff + self._beta * abs(speed), dt)
        if not share > 0:  # overflow of a jump in a tiny step, or underflow of the step
            return self.value
        self._speed = speed
        self.value += share * (x - self.value)
        self.delay = dt * (1 - share) / share
        return self.value


def _share(cutoff: float, dt: float) -> float:
    """Share of an innovation that passes: RC low-pass filter, backward Euler."""
    turn = 2 * math.pi * cutoff * dt
    return turn / (1 + turn)
