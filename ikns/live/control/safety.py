"""When the finger may move: a state machine that gives a reason for every transition.

    disarmed -> armed -> active <-> holding -> safe -> armed or disarmed

The finger follows the signal only in ``active``. Without valid poses the machine goes
from ``active`` to ``holding`` (the finger stays where it is) and then to ``safe`` (the
chosen safe state: hold, open or limp); when poses return, it goes from ``holding`` back
to ``active``. A stop leads to ``safe`` from any state but ``disarmed``. ``safe`` is
never left by itself: someone has to check, and arm again or disarm.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from ikns.errors import InvalidInput

State = Literal["disarmed", "armed", "active", "holding", "safe"]


class Transition(NamedTuple):
    """One state transition.

    Parameters
    ----------
    time : float
        On the caller's monotonic clock, s.
    before, after : str
        States.
    reason : str
        In words.
    """

    time: float
    before: State
    after: State
    reason: str


Changes = tuple[Transition, ...]


class SafetyMachine:
    """The state machine. It has no clock: every call passes the time.

    Every call returns its state transitions, for the log.

    Parameters
    ----------
    hold_after : float
        After more than this time without a valid pose the finger holds, s.
    safe_after : float
        After more than this time it goes to its safe state, s.

    Attributes
    ----------
    state : str
    """

    def __init__(self, *, hold_after: float = 0.1, safe_after: float = 0.5) -> None:
        if not 0 < hold_after <= safe_after < math.inf:
            raise InvalidInput(
                "expected 0 s < hold_after <= safe_after, found "
                f"{hold_after:g} s and {safe_after:g} s."
            )
        self.hold_after, self.safe_after = hold_after, safe_after
        self.state: State = "disarmed"
        self._now = -math.inf
        self._seen = -math.inf

    @property
    def deadline(self) -> float:
        """Time of the next timeout if no valid pose comes before, s."""
        if self.state == "active":
            return self._seen + self.hold_after
        return self._seen + self.safe_after if self.state == "holding" else math.inf

    def arm(self, now: float, reason: str = "arming requested") -> Changes:
        """Allow the finger to become active."""
        return self._go(now, "armed", reason) if self.state == "disarmed" else ()

    def arm_again(self, now: float, reason: str = "re-arming requested") -> Changes:
        """Leave the safe state, because someone asked for it."""
        return self._go(now, "armed", reason) if self.state == "safe" else ()

    def activate(self, now: float, reason: str = "start requested") -> Changes:
        """Let the finger follow the signal, if armed and poses are coming."""
        now = self._at(now)
        ready = self.state == "armed" and now - self._seen <= self.hold_after
        return self._go(now, "active", reason) if ready else ()

    def pose(self, now: float, why: str = "") -> Changes:
        """Report a valid pose, and why there was none before."""
        # The watchdog comes first: a pose after too long a silence is too late.
        late = self.check(now, why)
        if self.state != "safe":
            self._seen = self._at(now)
        if self.state == "holding":
            return late + self._go(now, "active", "poses have returned")
        return late

    def check(self, now: float, why: str = "") -> Changes:
        """Check the watchdog; call it at least as often as the finger is commanded.

        `why` says why there is no valid pose, if known, for the transition's reason.
        """
        now = self._at(now)
        silence = now - self._seen
        reason = f"no valid pose for {silence:.3f} s" + (f": {why}" if why else "")
        moving = self.state in ("active", "holding")
        if moving and silence > self.safe_after:
            return self._go(now, "safe", reason)
        if self.state == "active" and silence > self.hold_after:
            return self._go(now, "holding", reason)
        return ()

    def stop(self, now: float, reason: str) -> Changes:
        """Go to the safe state at once, after a fault or on request."""
        if self.state in ("disarmed", "safe"):
            return ()
        return self._go(now, "safe", reason)

    def disarm(self, now: float, reason: str = "disarming requested") -> Changes:
        """End: the finger is relaxed."""
        return () if self.state == "disarmed" else self._go(now, "disarmed", reason)

    def _at(self, now: float) -> float:
        """Return a time that never runs back, even if the clock does or is NaN."""
        if now > self._now:
            self._now = now
        return self._now

    def _go(self, now: float, after: State, reason: str) -> Changes:
        before, self.state = self.state, after
        return (Transition(self._at(now), before, after, reason),)
