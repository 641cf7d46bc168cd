"""A plausible motor: a profile, a first-order lag behind it, and coasting."""

import math

__all__ = ["Motor"]

#: Ours: s to follow the profile, and s to coast to rest without torque.
LAG, COAST = 0.03, 0.05
STEP = 2e-3


class Motor:
    """Position (ticks) and velocity (ticks/s) of a horn that nothing holds back.

    `goal` is where it goes under torque, `planned` where the profile is on its way.
    """

    def __init__(self, position: float) -> None:
        self.position, self.velocity = position, 0.0
        self.stop()

    def stop(self) -> None:
        """Give up the way to the goal; stand here."""
        self.goal = self.planned = self.position
        self.planned_velocity = 0.0

    def begin(self, goal: float) -> None:
        """Set off to a goal from rest."""
        self.stop()
        self.goal = goal

    @property
    def under_way(self) -> bool:
        """Whether the profile has not ended."""
        return abs(self.goal - self.planned) >= 1

    def move(self, seconds: float, *, fast: float, change: float, top: float) -> None:
        """Let time pass.

        `fast` and `change` limit the profile, ticks/s and ticks/s^2, and may be
        infinite; `top` is what the motor reaches, ticks/s, and 0 without torque.
        """
        steps = max(1, math.ceil(seconds / STEP))
        dt = seconds / steps
        for _ in range(steps if seconds > 0 else 0):
            if top > 0:
                self._follow(dt, fast, change)
                lag = (self.planned - self.position) / max(LAG, dt)
                self.velocity = min(max(lag, -top), top)
            else:
                self.velocity *= math.exp(-dt / COAST)
            self.position += self.velocity * dt
            if not top:
                self.planned, self.planned_velocity = self.position, 0.0

    def _follow(self, dt: float, fast: float, change: float) -> None:
        away = self.goal - self.planned
        # As fast as allowed, but so that it can still stop at the goal.
        wanted = min(fast, abs(away) / dt)
        if change < math.inf:
            wanted = min(wanted, math.sqrt(2 * change * abs(away)))
        low, high = (self.planned_velocity + s * change * dt for s in (-1, 1))
        self.planned_velocity = min(max(math.copysign(wanted, away), low), high)
        self.planned += self.planned_velocity * dt
