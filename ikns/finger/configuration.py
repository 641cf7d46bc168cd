"""How flexion becomes a servo's numbers: ticks, limits, speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ikns.finger.limiter import Limits
from ikns.finger.models import Model

__all__ = ["ANSWER_ALL", "ServoConfiguration"]

#: The servo's own profile stays out of the way of the limiter's by this factor.
_PROFILE_MARGIN = 1.5
_POSITION_MODE, _CURRENT_POSITION_MODE = 3, 5
#: Status return level at which a servo answers everything.
ANSWER_ALL = 2


@dataclass(frozen=True)
class ServoConfiguration:
    """How flexion becomes ticks, and how hard and fast the servo may push.

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
        """Position of a flexion."""
        return round(self.open_ticks + flexion * self.span)

    def flexion(self, ticks: float) -> float:
        """Flexion at a position."""
        return (ticks - self.open_ticks) / self.span

    def sent(self, flexion: float) -> float:
        """Flexion as the servo is told, in whole ticks; NaN stays NaN."""
        return flexion if math.isnan(flexion) else self.flexion(self.ticks(flexion))

    def eeprom_registers(self, model: Model) -> dict[str, int]:
        """Return what has to be in the servo's permanent memory.

        With current-based position control a servo limits its current, but heeds no
        position limits; then only the limiter does.
        """
        ends = sorted(map(self.ticks, (self.limits.lower, self.limits.upper)))
        values = {"min_position_limit": ends[0], "max_position_limit": ends[1]}
        if model.protocol == 2:
            # Forward, profiles by velocity, and no torque by goal alone.
            values["drive_mode"] = 0
            values["operating_mode"] = _POSITION_MODE
        if "current_limit" in model:
            values["operating_mode"] = _CURRENT_POSITION_MODE
            values["current_limit"] = self._share(model, "current_limit")
        else:
            values["pwm_limit"] = self._share(model, "pwm_limit")
        # Let it switch off by itself when overheated, shocked or overloaded.
        values["shutdown"] = model["shutdown"].initial
        return values

    def ram_registers(self, model: Model) -> dict[str, int]:
        """Return what has to be in its memory while it runs."""
        speed = self.limits.rate * abs(self.span) * _PROFILE_MARGIN
        values = {
            "profile_velocity": _whole(model, "profile_velocity", speed),
        }
        if model.protocol == 2:
            values["status_return_level"] = ANSWER_ALL
        if "profile_acceleration" in model:
            change = self.limits.acceleration * abs(self.span) * _PROFILE_MARGIN
            values["profile_acceleration"] = _whole(
                model, "profile_acceleration", change
            )
        if "current_limit" in model:
            values["goal_current"] = self._share(model, "current_limit")
        else:
            values["goal_pwm"] = self._share(model, "pwm_limit")
        return values

    def _share(self, model: Model, name: str) -> int:
        return max(round(self.effort * model[name].upper), 1)


def _whole(model: Model, name: str, value: float) -> int:
    """Round up to a register's unit; its zero would mean no limit at all."""
    velocity = name == "profile_velocity"
    unit = model.velocity_unit if velocity else model.acceleration_unit
    top = min(model[name].upper, 1023 if model.protocol == 1 else model[name].upper)
    return min(max(math.ceil(value / unit), 1), top)
