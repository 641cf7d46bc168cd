"""The model of a human operator: from curve and pointer to the position of a limb.

A linear model with noise:

    e(t) = target(t + preview - delay) - seen(t - delay) + remnant(t)
    du/dt = crossover (1 + signal noise) e
    p'' = w^2 (u - p) - 2 z w p'            limb; w limb_frequency, z limb_damping

With a device that returns the limb's position (seen = p) it is the crossover model of
McRuer and Jex 1967 with preview (van der El et al. 2016). The discrete step is exact
for an error that is linear between samples (first-order hold); a delay that is no
multiple of the sample time interpolates the error linearly, too.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from scipy.linalg import expm

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.simulation.operator.ability import Ability

#: Anti-windup: how far the command u may exceed the limits of the limb, c.
_WINDUP = 0.05
#: Bandwidth of the signal-dependent noise, rad/s: about that of the limb, which filters
#: out what is faster (assumption).
_SIGNAL_BANDWIDTH = 10.0
#: Samples of noise drawn at a time.
_BLOCK = 256


class Operator:
    """A virtual operator in a trial.

    The ability is that after :meth:`Ability.practised`, if that is wanted; `limits` are
    the lowest and highest position of the limb.

    >>> from ikns.simulation.operator.ability import typical
    >>> operator = Operator(typical().noiseless(), rate=100, seed=0, start=0.2)
    >>> limb = 0.2
    >>> for _ in range(1000):
    ...     limb = operator.step(0.7, limb)
    >>> round(limb, 4)
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
        # Plain numbers: for three of them arrays take most of the time.
        A, before, now = discrete_step(ability, rate)
        self._rows = list(np.column_stack([A, before, now]).tolist())
        self._x = (float(start), float(start), 0.0)
        whole = int(ability.delay * rate + 1e-9)
        self._part = max(0.0, ability.delay * rate - whole)
        # Errors of the last samples; before the start they are 0.
        self._errors: deque[float] = deque([0.0] * (whole + 1), maxlen=whole + 1)
        self._before, self._pointer = 0.0, math.nan
        keep = [
            math.exp(-w / rate) for w in (ability.remnant_bandwidth, _SIGNAL_BANDWIDTH)
        ]
        self._keep = keep
        self._fresh = [math.sqrt(1 - k**2) for k in keep]
        self._noise: list[float] = self._rng.normal(size=2).tolist()
        self._drawn: list[list[float]] = []

    @property
    def preview(self) -> float:
        """How far ahead the person sees the curve, s."""
        return self.ability.preview

    @property
    def limb(self) -> float:
        """Position of the limb, within the limits."""
        return float(min(max(self._x[1], self._limits[0]), self._limits[1]))

    def step(self, ahead: float, seen: float) -> float:
        """Advance by one sample; return the limb's position at the next one.

        `ahead` is the target ``preview`` s from now, 0 to 1, `seen` the position of the
        pointer now; NaN: it has not moved.
        """
        if math.isfinite(seen):
            self._pointer = seen
        error = ahead - self._pointer
        self._errors.append(0.0 if math.isnan(error) else error)
        # The end of the coming sample, minus the delay, lies between the oldest two.
        old, new = self._errors[0], self._errors[1]
        a = self.ability
        if not self._drawn:  # many at a time, for speed
            self._drawn = self._rng.normal(size=(_BLOCK, 2)).tolist()
        (slow, slower), (fresh, fresher) = self._keep, self._fresh
        first, second = self._drawn.pop()
        of_eye = self._noise[0] = slow * self._noise[0] + fresh * first
        of_signal = self._noise[1] = slower * self._noise[1] + fresher * second
        late = (1 - self._part) * new + self._part * old
        late += a.remnant * of_eye
        late *= 1 + a.signal_noise * of_signal
        x, y, z = self._x
        before, self._before = self._before, late
        command, place, speed = [
            A0 * x + A1 * y + A2 * z + B0 * before + B1 * late
            for A0, A1, A2, B0, B1 in self._rows
        ]
        low, high = self._limits
        command = min(max(command, low - _WINDUP), high + _WINDUP)
        self._x = (command, place, speed)
        return min(max(place, low), high)


def discrete_step(ability: Ability, rate: float) -> tuple[Array, Array, Array]:
    """Exact step of command, limb and its speed for a first-order hold of the error.

    A (3, 3), and B (3,) of the error at the beginning and at the end of the sample.
    """
    w, z = ability.limb_frequency, ability.limb_damping
    M = np.zeros((5, 5))
    M[0, 3] = ability.crossover
    M[1, 2] = 1.0
    M[2, :3] = w**2, -(w**2), -2 * z * w
    M[3, 4] = rate  # slope of the error over one sample, for a unit change
    E = expm(M / rate)
    return E[:3, :3], E[:3, 3] - E[:3, 4], E[:3, 4]
