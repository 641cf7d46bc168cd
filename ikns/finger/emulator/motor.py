"""Dynamics of a simulated servo: profile, motor, obstacles, heat."""

from __future__ import annotations

import math

from ikns.finger.limiter import approach
from ikns.finger.models import Model

# Assumed for a loaded servo of this size: seconds to follow its profile, seconds to
# change speed, and the error in turns at which it pushes with full effort.
_FOLLOW, _SPIN, _YIELD = 0.03, 0.01, 0.02
# Assumed heating: room temperature, degC; rise at full effort; time constant, s.
_ROOM, _HEAT, _HEAT_TIME = 25.0, 60.0, 120.0
#: A slower motor stands still, ticks per second.
_FRICTION = 0.01
#: Effort above this share for longer than this time is an overload, s.
_OVERLOAD, _OVERLOAD_TIME = 0.95, 2.0
_STEP = 1e-3


class Motor:
    """Position (ticks) of a simulated servo's horn.

    Parameters
    ----------
    model : Model
    position : float
        Ticks.

    Attributes
    ----------
    position, velocity : float
        Ticks and ticks per second.
    profile : float
        Position of the profile on its way to the goal, ticks.
    effort : float
        Share of full effort, -1 to 1.
    temperature : float
        Degrees Celsius.
    obstacles : tuple of float
        Lowest and highest position that obstacles allow, ticks.
    """

    def __init__(self, model: Model, position: float) -> None:
        self._model = model
        self.position = self.profile = position
        self.velocity = self._profile_velocity = self.effort = 0.0
        self.temperature = 30.0
        self.obstacles = (-math.inf, math.inf)
        self._strained = 0.0

    @property
    def overloaded(self) -> bool:
        """Whether it has pushed with nearly full effort for too long."""
        return self._strained > _OVERLOAD_TIME

    def stop(self) -> None:
        """Stop the profile at the present position."""
        self.profile, self._profile_velocity = self.position, 0.0

    def measurements(self) -> dict[str, float]:
        """Values of the registers that show measurements, in their units."""
        model, effort = self._model, self.effort
        return {
            "present_position": self.position,
            "present_velocity": self.velocity / model.velocity_unit,
            "present_load": 1000 * effort,
            "present_current": effort * model.stall_current / model.current_unit,
            "present_pwm": effort * model["pwm_limit"].upper,
            "present_temperature": self.temperature,
            "present_input_voltage": 120 - 10 * abs(effort),
            "moving": abs(self.velocity) > 10 * model.velocity_unit,
            "position_trajectory": self.profile,
        }

    def move(
        self,
        duration: float,
        goal: float,
        *,
        torque: bool,
        rate: float,
        acceleration: float,
        max_effort: float,
    ) -> None:
        """Simulate the motion over a duration.

        Parameters
        ----------
        duration : float
            Seconds.
        goal : float
            Ticks.
        torque : bool
        rate, acceleration : float
            Of the profile, ticks per second (squared); infinite for none.
        max_effort : float
            Share of full effort.
        """
        count = max(round(duration / _STEP), 1)
        dt = duration / count
        for _ in range(count):
            if torque:
                self._follow(goal, dt, rate, acceleration)
                self._push(dt, max_effort)
            else:  # no torque: the gear holds it
                self.velocity = self.effort = 0.0
                self.stop()
            warmth = _ROOM + _HEAT * self.effort**2
            self.temperature += (warmth - self.temperature) * dt / _HEAT_TIME
            strained = abs(self.effort) > _OVERLOAD
            self._strained = self._strained + dt if strained else 0.0

    def _follow(self, goal: float, dt: float, rate: float, acceleration: float) -> None:
        if math.isinf(rate):
            self.profile = goal
            return
        self._profile_velocity = approach(
            goal - self.profile,
            self._profile_velocity,
            dt,
            rate=rate,
            acceleration=min(acceleration, 1e9),
        )
        self.profile += self._profile_velocity * dt

    def _push(self, dt: float, max_effort: float) -> None:
        error = self.profile - self.position
        share = error / (_YIELD * self._model.ticks_per_turn)
        self.effort = min(max(share, -max_effort), max_effort)
        top = self._model.speed * max_effort
        wanted = min(max(error / _FOLLOW, -top), top)
        self.velocity += (wanted - self.velocity) * min(dt / _SPIN, 1.0)
        if abs(self.velocity) < _FRICTION and abs(wanted) < _FRICTION:
            self.velocity = 0.0
        position = self.position + self.velocity * dt
        # An obstacle stops the horn; it does not push it back.
        low, high = self.obstacles
        low, high = min(low, self.position), max(high, self.position)
        if not low <= position <= high:
            position = min(max(position, low), high)
            self.velocity = 0.0
        self.position = position
