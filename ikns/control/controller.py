"""From a frame of markers to what a finger is asked: the live loop, no clock, no I/O.

Every call says what time it is and nothing else is looked at, so the same frames at the
same times give the same answers, bit for bit, live and replayed from a session.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.control.frame import ControlFrame, FrameSolver
from ikns.control.machine import Changes, SafetyMachine, State
from ikns.control.smoothing import OneEuro
from ikns.errors import InvalidInput

__all__ = ["Controller", "Decision", "Settings"]

#: A device clock that runs back by more than this was started anew, s.
_RESTART = 1.0
#: Cut-off of the hand's speed, Hz: natural reaches lie below it.
_SPEED_CUTOFF = 5.0


@dataclass(frozen=True)
class Settings:
    """How the control signal becomes a flexion.

    Parameters
    ----------
    cutoff, beta : float
        Of the smoothing, Hz and Hz per (unit of c / s); see
        :class:`ikns.control.smoothing.OneEuro`. The defaults are ours: with a share
        ``a = w dt / (1 + w dt)`` of each innovation (w = 2 pi times the cut-off) they
        leave ``sqrt(a / (2 - a))``, a quarter, of white noise of 100 Hz at rest and
        cost ``dt (1 - a) / a = 1 / w``, 80 ms; where c moves by 1 per second, 16 ms.
    dead_band : float
        Smaller changes of flexion are not passed on.
    hold_speed : float, optional
        While the hand is faster, the flexion stays as it is, m/s. Default: never.
    max_residual : float
        A pose that explains the markers worse than this is none, m, root mean square.
    max_worst_residual : float
        Nor is one that leaves a marker of the chain farther off, m. The default is a
        little more than the 70 mm that two people came to in daily activities
        (``benchmarks/stray_marker.py``).
    hold_after, safe_after : float
        See :class:`ikns.control.machine.SafetyMachine`, s.
    """

    cutoff: float = 2.0
    beta: float = 3.0
    dead_band: float = 0.005
    hold_speed: float | None = None
    max_residual: float = 0.05
    max_worst_residual: float = 0.08
    hold_after: float = 0.1
    safe_after: float = 0.5

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 0 <= self.dead_band < 1:
            raise InvalidInput(
                f"expected a dead band from 0 to below 1, found {self.dead_band:g}."
            )
        for name in ("hold_speed", "max_residual", "max_worst_residual"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InvalidInput(f"expected a positive {name}, found {value:g}.")


class Decision(NamedTuple):
    """What a frame led to.

    Parameters
    ----------
    solved : ControlFrame
        Pose and raw control signal.
    valid : bool
        Whether the pose counts.
    flexion : float
        What the finger is asked, 0 to 1; NaN before the first pose.
    state : str
        Of the safety machine, after the frame.
    changes : tuple of Transition
        On the way there.
    """

    solved: ControlFrame
    valid: bool
    flexion: float
    state: State
    changes: Changes


class Controller:
    """The live loop, frame by frame.

    Parameters
    ----------
    solver : FrameSolver
        Markers to pose and control signal; the first degree of freedom drives.
    settings : Settings, optional

    Attributes
    ----------
    machine : SafetyMachine
        To be armed, started and stopped by the caller.
    flexion : float
        What the finger is asked.
    smoothing_delay : float
        Of the control signal at the last frame, s.
    """

    def __init__(self, solver: FrameSolver, settings: Settings | None = None) -> None:
        self.solver = solver
        self.settings = s = Settings() if settings is None else settings
        self.machine = SafetyMachine(hold_after=s.hold_after, safe_after=s.safe_after)
        self.flexion = math.nan
        self._smooth = OneEuro(cutoff=s.cutoff, beta=s.beta)
        self._speed = OneEuro(cutoff=_SPEED_CUTOFF, beta=0.0)
        self._device_time = -math.inf
        self._hand = (math.nan,) * 3
        self._markers = b""
        self._counted: tuple[float, NDArray[np.float64] | None] = (-math.inf, None)

    @property
    def smoothing_delay(self) -> float:
        """Of the control signal at the last frame, s."""
        return self._smooth.delay

    def frame(
        self, markers: NDArray[np.float64], device_time: float, receive_time: float
    ) -> Decision:
        """Take one frame.

        Parameters
        ----------
        markers : (M, 3) array
            m in the world, in the order of the skeleton's marker set; NaN = not seen.
        device_time : float
            On the device's clock, s. A frame that is not newer than the last, or whose
            markers are the last one's to the bit (cameras are never that still), shows
            nothing new and does not count.
        receive_time : float
            On the caller's monotonic clock, s.
        """
        if device_time < self._device_time - _RESTART:
            self._device_time = -math.inf
        dt = device_time - self._device_time
        seen = markers.tobytes()
        new = dt > 0 and seen != self._markers  # never with NaN
        if not new:
            dt = math.nan
        else:
            self._device_time, self._markers = device_time, seen
        solved = self.solver.solve(markers)
        c = float(solved.c[0])
        most, worst = self.settings.max_residual, self.settings.max_worst_residual
        # Without a number nothing is explained.
        explained = solved.residual <= most and solved.worst_residual <= worst
        valid = bool(new and solved.in_sight and math.isfinite(c) and explained)
        machine = self.machine
        changes = machine.pose(receive_time) if valid else machine.check(receive_time)
        if valid:
            self._counted = receive_time, solved.q
            self._follow(c, solved.hand_in_thorax, dt)
        elif solved.residual > most or solved.worst_residual > worst:
            # Such a pose is no place to start the next from; nor is one of long ago.
            at, q = self._counted
            recent = receive_time - at < self.settings.safe_after
            self.solver.reset(q if recent else None)
        return Decision(solved, valid, self.flexion, machine.state, changes)

    def check(self, now: float) -> Changes:
        """Ask the watchdog while no frame comes."""
        return self.machine.check(now)

    def _follow(self, c: float, hand: NDArray[np.float64], dt: float) -> None:
        place = tuple(hand.tolist())
        step = math.dist(place, self._hand)
        speed = self._speed.step(step / dt if math.isfinite(dt) else math.nan, dt)
        self._hand = place
        wanted = min(max(self._smooth.step(c, dt), 0.0), 1.0)
        if math.isnan(self.flexion):
            self.flexion = wanted
        held = self.settings.hold_speed
        if self.machine.state in ("holding", "safe") or (held and speed > held):
            return
        if abs(wanted - self.flexion) > self.settings.dead_band or wanted in (0.0, 1.0):
            self.flexion = wanted
