"""A simulated finger, for work and tests without hardware."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Self

from ikns.errors import InvalidInput
from ikns.finger.errors import FingerError
from ikns.finger.geometry import flexion_at, joint_angles, opening
from ikns.finger.guard import Guard, Safety
from ikns.finger.relax_at_exit import forget, relax_at_exit
from ikns.finger.state import FingerState

# Assumed: a servo that closes the finger in half a turn, modeled on an XL430-W250 (57
# rev/min and 1.3 A at 11.1 V). Flexion per second, stall current in A, seconds to
# follow and to change speed, and the error in flexion at which effort is full.
SPEED, _STALL_CURRENT = 1.9, 1.3
FOLLOW, SPIN, YIELD = 0.03, 0.01, 0.1
_FRICTION = 0.1  # share of full effort needed to move at full speed
_STEP = 1e-3
#: A finger slower than this is reported as not moving, flexion per second.
_RESTING = 0.01


class SimulatedFinger:
    """A simulated tendon-driven finger, deterministic for a given clock.

    Six modules bend equally (:mod:`ikns.finger.geometry`). The motor is a second-order
    system with limited speed and effort; an object stops the closing finger, and the
    current rises. Temperature and voltage are not simulated. Simulated time advances to
    the clock's time at every call.

    Parameters
    ----------
    object_width : float, optional
        Width of an object between finger and palm, m; None for no object.
    effort : float
        Share of full effort that the motor may use.
    safety : Safety, optional
    flexion : float
        Initial flexion.
    clock : callable
        Seconds, monotonic.

    Examples
    --------
    >>> now = 0.0
    >>> with SimulatedFinger(object_width=0.06, clock=lambda: now) as finger:
    ...     for _ in range(200):
    ...         now += 0.01
    ...         sent = finger.command(1.0)
    ...     state = finger.state()
    >>> round(1000 * opening(state.flexion))  # it holds the object
    60
    >>> state.stalled, state.current > 0.1
    (True, True)
    """

    resolution = 0.0

    def __init__(
        self,
        *,
        object_width: float | None = None,
        effort: float = 0.5,
        safety: Safety | None = None,
        flexion: float = 0.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if not 0 < effort <= 1:
            raise InvalidInput(f"effort must be in (0, 1], not {effort:g}.")
        if not 0 <= flexion <= 1:
            raise InvalidInput(f"flexion must be in [0, 1], not {flexion:g}.")
        self.safety = Safety() if safety is None else safety
        self.object_width = object_width
        self._effort_limit = effort
        self._clock = clock
        self._guard = Guard(self.safety)
        self._flexion, self._velocity, self._effort = flexion, 0.0, 0.0
        self._now = clock()
        self._connected = False
        self._lock = threading.Lock()

    @property
    def object_width(self) -> float | None:
        """Width of the object between finger and palm, m; may be set at any time."""
        return self._width

    @object_width.setter
    def object_width(self, width: float | None) -> None:
        self._contact = math.inf if width is None else flexion_at(width)
        self._width = width

    @property
    def joint_angles(self) -> tuple[float, ...]:
        """Angles of the joints of ``urdf/finger.urdf``, rad."""
        return joint_angles(self._flexion)

    @property
    def opening(self) -> float:
        """Distance between tip and palm, m."""
        return opening(self._flexion)

    def connect(self) -> None:
        """Follow commands from the present flexion; leave the safe state."""
        self._advance()
        self._guard.start(self._now, self._flexion)
        self._connected = True
        relax_at_exit(self)

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one sent, NaN if none is."""
        self._advance()
        return self._guard.command(self._now, flexion)

    def state(self) -> FingerState:
        """Return the present state."""
        self._advance()
        return FingerState(
            time=self._now,
            age=0.0,
            mode=self._guard.mode,
            flexion=self._flexion,
            sent=self._guard.goal,
            current=self._effort * _STALL_CURRENT,
            load=self._effort,
            moving=abs(self._velocity) > _RESTING,
            stalled=self._guard.stalled,
            alert=self._guard.reason,
        )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay in it until connected again."""
        self._advance()
        self._guard.fail(reason)

    def relax(self) -> None:
        """Switch the torque off; harmless when repeated."""
        if self._connected:
            self._advance()
            self._connected = False
        self._guard.relax()
        forget(self)

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        """Relax."""
        self.relax()

    def _advance(self) -> None:
        """Advance to the clock's time, in steps of a millisecond."""
        with self._lock:  # any thread may make it safe
            now = self._clock()
            if now < self._now:
                raise FingerError("the clock of a simulated finger went backwards.")
            while (left := now - self._now) > 0:
                if self._at_rest() and left > _STEP:
                    # Nothing moves before the guard's next timeout.
                    step = min(left, 0.01)
                    self._now = now if left <= step else self._now + step
                else:
                    step = min(left, _STEP)
                    self._now = now if left <= step else self._now + step
                    self._move(step)
                self._guard.tick(self._now)
                self._guard.measured(self._now, self._flexion)

    def _at_rest(self) -> bool:
        goal = self._guard.goal
        still = self._velocity == 0.0
        return still and (math.isnan(goal) or abs(goal - self._flexion) < 1e-9)

    def _move(self, dt: float) -> None:
        goal = self._guard.goal
        if math.isnan(goal):  # no torque: the gear holds it
            self._velocity = self._effort = 0.0
            return
        limit = self._effort_limit
        error = goal - self._flexion
        wanted = min(max(error / FOLLOW, -SPEED), SPEED)
        self._velocity += (wanted - self._velocity) * min(dt / SPIN, 1.0)
        if abs(error) < 1e-9 and abs(self._velocity) < 1e-6:
            self._velocity = 0.0
        flexion = self._flexion + self._velocity * dt
        # The object stops a closing finger, but one placed where the finger already is
        # does not push it open.
        contact = max(self._contact, self._flexion)
        if flexion > contact:
            flexion, self._velocity = contact, 0.0
        self._flexion = flexion
        push = error / YIELD + _FRICTION * self._velocity / SPEED
        self._effort = min(max(push, -limit), limit)
