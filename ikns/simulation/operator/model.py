"""The operator: from a curve ahead and a pointer seen to where the limb goes.

A linear model of a person who tracks, with noise:

    e(t) = target(t + preview - delay) - seen(t - delay) + remnant(t)
    du/dt = crossover (1 + signal noise) e
    p'' = w^2 (u - p) - 2 z w p'            limb; w limb_frequency, z limb_damping

With a device that passes the limb on as it is (seen = p) it is the crossover model of
McRuer and Jex 1967 with a look ahead (van der El et al. 2016). The step is exact for an
error that is straight between samples; the delay, which may fall between samples, takes
the error straight there, too.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from ikns.errors import InvalidInput
from ikns.simulation.operator.ability import Ability

__all__ = ["Operator", "closed_loop", "open_loop", "straight_step"]

Array = NDArray[np.float64]

#: How far the wish may run past what the limb can reach, c. Nobody winds up more.
_BEYOND = 0.05
#: Bandwidth of the signal-dependent noise, rad/s: that of the limb, beyond which none
#: would show (assumption).
_SIGNAL_BANDWIDTH = 10.0
#: Samples of noise drawn at a time.
_BLOCK = 256


class Operator:
    """A virtual operator at work.

    Parameters
    ----------
    ability : Ability
        With :meth:`Ability.practised` already applied, if at all.
    rate : float
        Samples per second.
    seed : int or numpy.random.Generator
        Of the noise.
    start : float
        Where the limb is at first.
    limits : (float, float)
        Between which the limb can go: it stops there.

    Examples
    --------
    >>> from ikns.simulation.operator.ability import typical
    >>> operator = Operator(typical().noiseless(), rate=100, seed=0, start=0.2)
    >>> place = 0.2
    >>> for _ in range(1000):
    ...     place = operator.step(0.7, place)
    >>> round(place, 4)
    0.7
    """

    def __init__(
        self,
        ability: Ability,
        *,
        rate: float,
        seed: int | np.random.Generator,
        start: float = 0.5,
        limits: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        if not math.isfinite(rate) or not rate * ability.delay >= 1:
            raise InvalidInput(
                f"expected a rate of at least one sample in {ability.delay:g} s of "
                f"delay, found {rate:g} per second."
            )
        self.ability, self.rate = ability, rate
        self._limits = limits
        self._rng = np.random.default_rng(seed)
        self._A, self._B0, self._B1 = straight_step(ability, rate)
        self._x = np.array([start, start, 0.0])
        whole = int(ability.delay * rate + 1e-9)
        self._part = max(0.0, ability.delay * rate - whole)
        # Errors of the last samples. Before the beginning there was none to correct.
        self._errors: deque[float] = deque([0.0] * (whole + 1), maxlen=whole + 1)
        self._before, self._pointer = 0.0, math.nan
        keep = [
            math.exp(-w / rate) for w in (ability.remnant_bandwidth, _SIGNAL_BANDWIDTH)
        ]
        self._keep = np.array(keep)
        self._fresh = np.sqrt(1 - self._keep**2)
        self._noise = self._rng.normal(size=2)
        self._drawn: list[Array] = []

    @property
    def preview(self) -> float:
        """How far ahead the person looks, s."""
        return self.ability.preview

    @property
    def place(self) -> float:
        """Where the limb is, within the limits."""
        return float(min(max(self._x[1], self._limits[0]), self._limits[1]))

    def step(self, ahead: float, seen: float) -> float:
        """Go on by a sample.

        Parameters
        ----------
        ahead : float
            The target where the person looks, ``preview`` s from now, 0 to 1.
        seen : float
            Where the pointer is now; NaN: it stands where it was.

        Returns
        -------
        float
            Where the limb is at the next sample, within the limits.
        """
        if math.isfinite(seen):
            self._pointer = seen
        error = ahead - self._pointer
        self._errors.append(0.0 if math.isnan(error) else error)
        # The end of the coming sample, less the delay, lies between the oldest two.
        old, young = self._errors[0], self._errors[1]
        a = self.ability
        if not self._drawn:  # many at a time, for speed
            self._drawn = list(self._rng.normal(size=(_BLOCK, 2)))
        self._noise = self._keep * self._noise + self._fresh * self._drawn.pop()
        late = (1 - self._part) * young + self._part * old
        late += a.remnant * self._noise[0]
        late *= 1 + a.signal_noise * self._noise[1]
        self._x = self._A @ self._x + self._B0 * self._before + self._B1 * late
        self._before = late
        low, high = self._limits
        self._x[0] = min(max(self._x[0], low - _BEYOND), high + _BEYOND)
        return self.place


def straight_step(ability: Ability, rate: float) -> tuple[Array, Array, Array]:
    """Exact step of wish, limb and its speed for an error straight between samples.

    Returns
    -------
    A : (3, 3) array
    B0, B1 : (3,) array
        Of the error at the beginning and at the end of the sample.
    """
    w, z = ability.limb_frequency, ability.limb_damping
    M = np.zeros((5, 5))
    M[0, 3] = ability.crossover
    M[1, 2] = 1.0
    M[2, :3] = w**2, -(w**2), -2 * z * w
    M[3, 4] = rate  # slope of the error over one sample, for an end one higher
    E = expm(M / rate)
    return E[:3, :3], E[:3, 3] - E[:3, 4], E[:3, 4]


def open_loop(
    ability: Ability, omega: ArrayLike, *, latency: float = 0.0
) -> NDArray[np.complex128]:
    """Person and device, from the error to what is seen, at frequencies (rad/s)."""
    s = 1j * np.asarray(omega, dtype=np.float64)
    w, z = ability.limb_frequency, ability.limb_damping
    limb = w**2 / (s**2 + 2 * z * w * s + w**2)
    return np.asarray(
        ability.crossover / s * limb * np.exp(-(ability.delay + latency) * s)
    )


def closed_loop(
    ability: Ability, omega: ArrayLike, *, latency: float = 0.0
) -> NDArray[np.complex128]:
    """From the target to what is seen, at frequencies (rad/s).

    ``L exp(preview s) / (1 + L)``, L the open loop; noise is left out.

    Parameters
    ----------
    ability : Ability
    omega : array
        rad/s, above 0.
    latency : float
        Of the device, s.
    """
    L = open_loop(ability, omega, latency=latency)
    look = np.exp(1j * ability.preview * np.asarray(omega))
    return np.asarray(L * look / (1 + L))
