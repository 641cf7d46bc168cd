"""From a frame of markers to what a finger is asked: the live loop, no clock, no I/O.

Every call says what time it is and nothing else is looked at, so the same frames at the
same times give the same answers, bit for bit, live and replayed from a session.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.live.control.frame import ControlFrame, FrameSolver
from ikns.live.control.rejection import fits_markers, rejection_reason
from ikns.live.control.safety import Changes, SafetyMachine, State
from ikns.live.control.settings import ControlSettings
from ikns.live.control.smoothing import OneEuro

__all__ = ["Controller", "Decision"]

#: A device clock that runs back by more than this was started anew, s.
_RESTART = 1.0
#: Cut-off of the hand's speed, Hz: natural reaches lie below it.
_SPEED_CUTOFF = 5.0
#: Why there is no pose while no frame has come since the last that counted.
_SILENCE = "no frame came"


class Decision(NamedTuple):
    """What a frame led to.

    Parameters
    ----------
    solved : ControlFrame
        Pose and raw control signal.
    rejection : str
        Why the frame does not count, in words; empty if it does.
    flexion : float
        What the finger is asked, 0 to 1; NaN before the first pose.
    state : str
        Of the safety machine, after the frame.
    changes : tuple of Transition
        On the way there.
    """

    solved: ControlFrame
    rejection: str
    flexion: float
    state: State
    changes: Changes

    @property
    def valid(self) -> bool:
        """Whether the frame counts."""
        return not self.rejection


class Controller:
    """The live loop, frame by frame.

    Parameters
    ----------
    solver : FrameSolver
        Markers to pose and control signal; the first degree of freedom drives.
    settings : ControlSettings, optional

    Attributes
    ----------
    machine : SafetyMachine
        To be armed, started and stopped by the caller.
    flexion : float
        What the finger is asked.
    smoothing_delay : float
        Of the control signal at the last frame, s.
    """

    def __init__(
        self, solver: FrameSolver, settings: ControlSettings | None = None
    ) -> None:
        self.solver = solver
        self.settings = s = ControlSettings() if settings is None else settings
        self.machine = SafetyMachine(hold_after=s.hold_after, safe_after=s.safe_after)
        self.flexion = math.nan
        self._smooth = OneEuro(cutoff=s.cutoff, beta=s.beta)
        self._speed = OneEuro(cutoff=_SPEED_CUTOFF, beta=0.0)
        self._device_time = -math.inf
        self._hand = (math.nan,) * 3
        self._markers = b""
        self._why = _SILENCE
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
        rejection = rejection_reason(
            self.solver, self.settings, markers, solved, new=new
        )
        machine = self.machine
        if rejection:
            self._why = rejection
            changes = machine.check(receive_time, rejection)
            # Its pose may be wrong and no place to start the next from; nor is one of
            # long ago.
            if not fits_markers(solved, self.settings):
                at, q = self._counted
                recent = receive_time - at < self.settings.safe_after
                self.solver.reset(q if recent else None)
        else:
            changes = machine.pose(receive_time, self._why)
            self._why = _SILENCE
            self._counted = receive_time, solved.q
            self._follow(float(solved.c[0]), solved.hand_in_thorax, dt)
        return Decision(solved, rejection, self.flexion, machine.state, changes)

    def check(self, now: float) -> Changes:
        """Ask the watchdog while no frame comes."""
        return self.machine.check(now, self._why)

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
