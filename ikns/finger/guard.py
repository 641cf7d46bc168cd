"""Safety logic of a finger, without a device or a clock."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ikns.errors import InvalidInput
from ikns.finger.limiter import Limiter, Limits
from ikns.finger.state import SAFE_STATES, Mode, SafeState


@dataclass(frozen=True)
class Safety:
    """What counts as a fault, and what a finger does about it.

    Parameters
    ----------
    limits : Limits
        Range, rate and acceleration.
    safe_state : {"limp", "hold", "open"}
        Which one is right depends on the device and the task: letting go of a held
        object may itself be the hazard.
    command_timeout : float
        Seconds without a command after which the finger goes to its safe state.
    silence_timeout : float
        Seconds without a response from the device, likewise.
    stall_timeout : float
        Seconds that the finger may push against an obstacle.
    stall_tolerance : float
        The finger counts as pushing when it is farther than this from its goal, and as
        moving when it moves by more than this; flexion.
    grip : float
        After a stall its goal is this far beyond the obstacle, flexion.
    """

    limits: Limits = field(default_factory=Limits)
    safe_state: SafeState = "limp"
    command_timeout: float = 0.5
    silence_timeout: float = 0.25
    stall_timeout: float = 1.0
    stall_tolerance: float = 0.05
    grip: float = 0.03

    def __post_init__(self) -> None:
        """Reject settings that could never take effect."""
        if self.safe_state not in SAFE_STATES:
            raise InvalidInput(
                f"the safe state must be hold, open or limp, not '{self.safe_state}'."
            )
        for name in ("command_timeout", "silence_timeout", "stall_timeout"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InvalidInput(
                    f"{name} must be positive and finite, not {getattr(self, name):g}."
                )
        if not 0.0 <= self.grip <= self.stall_tolerance <= 1.0:
            raise InvalidInput(
                "grip must not exceed stall_tolerance, both within 0 to 1, "
                f"not {self.grip:g} and {self.stall_tolerance:g}."
            )


class Guard:
    """Decides which goal a finger gets.

    Parameters
    ----------
    safety : Safety

    Attributes
    ----------
    mode : {"relaxed", "active", "safe"}
    reason : str
        Why it is in its safe state; empty otherwise.
    stalled : bool

    Examples
    --------
    >>> guard = Guard(Safety(safe_state="hold"))
    >>> guard.start(0.0, 0.3)
    >>> guard.command(0.01, 1.0) > 0.3
    True
    >>> guard.tick(2.0)  # two seconds without a command
    >>> guard.mode, guard.reason
    ('safe', 'no command for 0.5 s')
    """

    def __init__(self, safety: Safety) -> None:
        self.safety = safety
        self.mode: Mode = "relaxed"
        self.reason = ""
        self.stalled = False
        self._limiter = Limiter(safety.limits)
        self._torque = False
        self._ceiling, self._floor = math.inf, -math.inf
        self._moved_at = self._stepped_at = self._commanded_at = math.nan
        self._anchor = math.nan

    @property
    def torque(self) -> bool:
        """Whether the torque should be on."""
        return self._torque

    @property
    def goal(self) -> float:
        """Flexion to send to the device; NaN with torque off."""
        return self._limiter.position if self._torque else math.nan

    def start(self, now: float, flexion: float) -> None:
        """Follow commands from now on, starting at the measured flexion and at rest."""
        self._limiter.restart(flexion)
        self.mode, self.reason, self._torque = "active", "", True
        self._unblock(now, flexion)
        self._stepped_at = self._commanded_at = now

    def command(self, now: float, flexion: float) -> float:
        """Move the goal by one step towards a flexion; return it."""
        self.tick(now)
        if self.mode != "active":
            return self.goal
        self._commanded_at = now
        if math.isfinite(flexion):
            if self.stalled and self._floor < flexion < self._ceiling:
                self._unblock(now, self._anchor)
            flexion = min(max(flexion, self._floor), self._ceiling)
        self._step(now, flexion)
        return self.goal

    def tick(self, now: float) -> None:
        """Let time pass: check the command timeout, and proceed in the safe state."""
        timeout = self.safety.command_timeout
        if self.mode == "active" and now - self._commanded_at > timeout:
            self.fail(f"no command for {timeout:g} s")
        if self.mode == "safe" and self._torque:
            if self.safety.safe_state == "open":
                self._step(now, max(self.safety.limits.lower, self._floor))
            elif self.stalled:  # hold with a lighter grip
                held = min(max(self._limiter.position, self._floor), self._ceiling)
                self._step(now, held)
            else:
                self._step(now, math.nan)

    def measured(self, now: float, flexion: float) -> None:
        """Take the measured flexion; after a stall, push less."""
        safety = self.safety
        if not math.isfinite(flexion) or not self._torque:
            return
        if not abs(flexion - self._anchor) <= safety.stall_tolerance:
            self._unblock(now, flexion)
        push = self._limiter.position - flexion
        if abs(push) <= safety.stall_tolerance:
            if not self.stalled:
                self._moved_at = now
        elif now - self._moved_at > safety.stall_timeout:
            self.stalled = True
            if push > 0:
                self._ceiling = flexion + safety.grip
            else:
                self._floor = flexion - safety.grip

    def fail(self, reason: str, *, limp: bool = False) -> None:
        """Go to the safe state, or switch the torque off; the first reason is kept."""
        if self.mode == "relaxed":
            return
        if self.mode == "active":
            self.mode, self.reason = "safe", reason
        if limp or self.safety.safe_state == "limp":
            self._torque = False

    def hold_at(self, now: float, flexion: float) -> None:
        """Restart at the measured flexion after the device had stopped by itself."""
        self._limiter.restart(flexion)
        self._unblock(now, flexion)
        self._stepped_at = now

    def relax(self) -> None:
        """Switch the torque off and ignore further commands."""
        self.mode, self.reason, self._torque = "relaxed", "", False
        self.stalled = False

    def _step(self, now: float, target: float) -> None:
        self._limiter.step(target, now - self._stepped_at)
        self._stepped_at = now

    def _unblock(self, now: float, flexion: float) -> None:
        self.stalled = False
        self._ceiling, self._floor = math.inf, -math.inf
        self._anchor, self._moved_at = flexion, now
