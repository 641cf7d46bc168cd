"""Conversion of flexion to a servo's registers: ticks, limits, speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ikns.finger.limiter import Limits
from ikns.finger.models import Model

#: The servo's own profile is faster than the limiter by this factor, so as not to slow
#: the motion down.
_PROFILE_MARGIN = 1.5
_POSITION_MODE, _CURRENT_POSITION_MODE = 3, 5
#: Status return level at which a servo responds to every instruction.
RESPOND_TO_ALL = 2


@dataclass(frozen=True)
class ServoConfiguration:
    """How flexion maps to ticks, and how hard and fast the servo may push.

    Parameters
    ----------
    open_ticks, closed_ticks : int
    effort : float
        Share of full effort.
    watchdog : float
        Seconds.
    limits : Limits
    """

    open_ticks: int
    closed_ticks: int
    effort: float
    watchdog: float
    limits: Limits

    @property
    def span(self) -> int:
        """Ticks from open to closed, signed."""
        return self.closed_ticks - self.open_ticks

    def ticks(self, flexion: float) -> int:
        """Position of a flexion, ticks."""
        return round(self.open_ticks + flexion * self.span)

    def flexion(self, ticks: float) -> float:
        """Flexion at a position in ticks."""
        return (ticks - self.open_ticks) / self.span

    def sent(self, flexion: float) -> float:
        """Flexion that the servo gets, a whole number of ticks; NaN stays NaN."""
        return flexion if math.isnan(flexion) else self.flexion(self.ticks(flexion))

    def eeprom_registers(self, model: Model) -> dict[str, int]:
        """Return values for the servo's permanent memory (EEPROM).

        In current-based position control a servo limits its current but ignores its
        position limits; then only the limiter keeps the range.
        """
        ends = sorted(map(self.ticks, (self.limits.lower, self.limits.upper)))
        values = {"min_position_limit": ends[0], "max_position_limit": ends[1]}
        if model.protocol == 2:
            # Normal direction, velocity-based profile, no torque by a goal alone.
            values["drive_mode"] = 0
            values["operating_mode"] = _POSITION_MODE
        if "current_limit" in model:
            values["operating_mode"] = _CURRENT_POSITION_MODE
            values["current_limit"] = self._share(model, "current_limit")
        else:
            values["pwm_limit"] = self._share(model, "pwm_limit")
        # The servo switches itself off after overheating, a shock or an overload.
        values["shutdown"] = model["shutdown"].initial
        return values

    def ram_registers(self, model: Model) -> dict[str, int]:
        """Return values for the servo's volatile memory (RAM)."""
        speed = self.limits.rate * abs(self.span) * _PROFILE_MARGIN
        values = {
            "profile_velocity": _register_value(model, "profile_velocity", speed),
        }
        if model.protocol == 2:
            values["status_return_level"] = RESPOND_TO_ALL
        if "profile_acceleration" in model:
            change = self.limits.acceleration * abs(self.span) * _PROFILE_MARGIN
            values["profile_acceleration"] = _register_value(
                model, "profile_acceleration", change
            )
        if "current_limit" in model:
            values["goal_current"] = self._share(model, "current_limit")
        else:
            values["goal_pwm"] = self._share(model, "pwm_limit")
        return values

    def _share(self, model: Model, name: str) -> int:
        return max(round(self.effort * model[name].upper), 1)


def _register_value(model: Model, name: str, value: float) -> int:
    """Round up to the unit of a register, whose zero would mean no limit."""
    velocity = name == "profile_velocity"
    unit = model.velocity_unit if velocity else model.acceleration_unit
    top = min(model[name].upper, 1023 if model.protocol == 1 else model[name].upper)
    return min(max(math.ceil(value / unit), 1), top)
