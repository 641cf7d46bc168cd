"""Range, rate and acceleration limits, for any command at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ikns.errors import InvalidInput


@dataclass(frozen=True)
class Limits:
    """How far and how fast a finger may move.

    Parameters
    ----------
    lower, upper : float
        Range of flexion, within 0 to 1.
    rate : float
        Flexion per second.
    acceleration : float
        Flexion per second squared.
    longest_step : float
        Seconds. After a longer pause motion starts from rest, as if only this much time
        had passed.
    """

    lower: float = 0.0
    upper: float = 1.0
    rate: float = 2.0
    acceleration: float = 20.0
    longest_step: float = 0.1

    def __post_init__(self) -> None:
        """Reject limits that do not limit."""
        if not 0.0 <= self.lower <= self.upper <= 1.0:
            raise InvalidInput(
                "the range of flexion must lie within 0 to 1, "
                f"not {self.lower:g} to {self.upper:g}."
            )
        for name in ("rate", "acceleration", "longest_step"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InvalidInput(
                    f"{name} must be positive and finite, not {getattr(self, name):g}."
                )


def approach(
    distance: float, velocity: float, dt: float, *, rate: float, acceleration: float
) -> float:
    r"""Velocity of the next step of the fastest approach that does not overshoot.

    The velocity :math:`v` of the step changes by at most :math:`a\,dt`, does not
    exceed the rate, and leaves room to brake before the target,
    :math:`v\,dt + v^2/(2a) \le d`; where that is impossible, it brakes as hard as it
    may. If there was room to brake before a step, there is room after it, for any
    sequence of steps: braking by :math:`a\,dt` and then moving needs
    :math:`a\,dt^2/2` less room than there was.

    Parameters
    ----------
    distance : float
        Signed distance to the target.
    velocity : float
        Of the last step.
    dt : float
        Seconds, positive.
    rate, acceleration : float
        Limits, positive.

    Returns
    -------
    float

    Examples
    --------
    >>> approach(1.0, 0.0, 0.01, rate=2.0, acceleration=20.0)
    0.2
    """
    # The positive root of v^2 / (2 a) + v dt = |d|, written without cancellation.
    room = abs(distance)
    root = math.sqrt(dt * dt + 2.0 * room / acceleration)
    fastest = min(rate, 2.0 * room / (dt + root))
    change = acceleration * dt
    wanted = math.copysign(fastest, distance)
    return min(max(wanted, velocity - change), velocity + change)


class Limiter:
    """A flexion that follows a target within limits.

    Parameters
    ----------
    limits : Limits
    position : float
        Flexion to start from, at rest.

    Attributes
    ----------
    position, velocity : float
        Of the last step.

    Examples
    --------
    >>> limiter = Limiter(Limits(rate=1.0, acceleration=100.0), 0.0)
    >>> [round(limiter.step(1.0, 0.01), 3) for _ in range(3)]
    [0.01, 0.02, 0.03]
    >>> limiter.step(float("nan"), 0.01) <= 0.03  # not finite: it brakes
    True
    """

    def __init__(self, limits: Limits, position: float = 0.0) -> None:
        self.limits = limits
        self.restart(position)

    def restart(self, position: float) -> None:
        """Restart from rest at a flexion, clipped to the range."""
        if not math.isfinite(position):
            raise InvalidInput(f"a finite flexion to start from, not {position}.")
        self.position = min(max(position, self.limits.lower), self.limits.upper)
        self.velocity = 0.0

    def step(self, target: float, dt: float) -> float:
        """Move towards a target.

        Parameters
        ----------
        target : float
            Flexion, clipped to the range. If it is not finite, the limiter brakes to
            rest.
        dt : float
            Seconds since the last step; without a positive time nothing moves.

        Returns
        -------
        float
            The new flexion.
        """
        limits = self.limits
        if not dt > 0.0:
            return self.position
        if dt > limits.longest_step:
            dt, self.velocity = limits.longest_step, 0.0
        if math.isfinite(target):
            goal = min(max(target, limits.lower), limits.upper)
            self.velocity = approach(
                goal - self.position,
                self.velocity,
                dt,
                rate=limits.rate,
                acceleration=limits.acceleration,
            )
        else:
            slower = max(abs(self.velocity) - limits.acceleration * dt, 0.0)
            self.velocity = math.copysign(slower, self.velocity)
        position = self.position + self.velocity * dt
        # Only rounding can exceed the range.
        self.position = min(max(position, limits.lower), limits.upper)
        return self.position
