"""From a frame of markers to the commanded flexion, without clock or input and output.

Every call passes the time, so the same frames at the same times give the same results,
bit for bit, live and when a session is replayed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput
from ikns.live.control.frame import FrameSolver
from ikns.live.control.frame_result import ControlFrame
from ikns.live.control.rejection import (
    NONE_EXCHANGED,
    fits_markers,
    rejection_reason,
)
from ikns.live.control.safety import Changes, SafetyMachine, State
from ikns.live.control.settings import ControlSettings
from ikns.live.control.smoothing import OneEuro
from ikns.motion.marker_ik.label_changes import LabelWatch
from ikns.motion.marker_ik.rejection import chain_columns

#: A device clock that steps back by more than this was restarted, s.
_RESTART = 1.0
#: Cut-off frequency for the hand's speed, Hz; natural reaches are below it.
_SPEED_CUTOFF = 5.0
#: Why there is no valid pose when no frame arrived since the last valid one.
_SILENCE = "no frame arrived"


class Decision(NamedTuple):
    """Result of one frame.

    Parameters
    ----------
    solved : ControlFrame
        Pose and raw control signal.
    rejection : str
        Why the frame is rejected, in words; empty if it is valid.
    flexion : float
        Commanded flexion, 0 to 1; NaN before the first valid pose. Of the first of
        several fingers.
    state : str
        State of the safety machine after the frame.
    changes : tuple of Transition
        State changes caused by the frame.
    flexions : tuple of d float
        Commanded flexion by freedom of the map; NaN where a freedom drives nothing.
    """

    solved: ControlFrame
    rejection: str
    flexion: float
    state: State
    changes: Changes
    flexions: tuple[float, ...]

    @property
    def valid(self) -> bool:
        """Whether the frame is valid."""
        return not self.rejection


class Controller:
    """Turns markers into commanded flexions, frame by frame.

    Parameters
    ----------
    solver : FrameSolver
        Finds pose and control signals.
    settings : ControlSettings, optional
        Its `dofs` say which signals drive a finger.

    Attributes
    ----------
    machine : SafetyMachine
        Armed, activated and stopped by the caller; one for all fingers.
    flexion : float
        Commanded flexion of the first finger.
    flexions : list of d float
        Commanded flexion by freedom of the map; NaN where a freedom drives nothing.
    too_fast : bool
        Whether the last frame is valid, but the hand faster than `hold_speed`.
    smoothing_delay : float
        Delay of the first smoothed control signal at the last frame, s.

    Raises
    ------
    InvalidInput
        When the map lacks one of the freedoms.
    """

    def __init__(
        self, solver: FrameSolver, settings: ControlSettings | None = None
    ) -> None:
        self.solver = solver
        self.settings = s = ControlSettings() if settings is None else settings
        self.machine = SafetyMachine(hold_after=s.hold_after, safe_after=s.safe_after)
        n_dof = solver.null_space_map.directions_.shape[1]
        if max(s.dofs) > n_dof:
            raise InvalidInput(
                f"expected dofs up to the map's {n_dof}, found {max(s.dofs)}."
            )
        self.flexions = [math.nan] * n_dof
        self._first = s.dofs[0] - 1
        self._axes = [
            (dof - 1, OneEuro(cutoff=s.cutoff, beta=s.beta)) for dof in s.dofs
        ]
        self._speed = OneEuro(cutoff=_SPEED_CUTOFF, beta=0.0)
        self._device_time = -math.inf
        self._hand = (math.nan,) * 3
        self.too_fast = False
        self._markers = b""
        self._why = _SILENCE
        self._columns = chain_columns(solver.skeleton, solver.chain)
        self._labels = LabelWatch(len(self._columns))
        self._counted: tuple[float, NDArray[np.float64] | None] = (-math.inf, None)

    @property
    def flexion(self) -> float:
        """Commanded flexion of the first finger."""
        return self.flexions[self._first]

    @property
    def smoothing_delay(self) -> float:
        """Delay of the first smoothed control signal at the last frame, s."""
        return self._axes[0][1].delay

    def frame(
        self, markers: NDArray[np.float64], device_time: float, receive_time: float
    ) -> Decision:
        """Process one frame.

        Parameters
        ----------
        markers : (M, 3) array
            m in the world, in the order of the skeleton's marker set; NaN = not seen.
        device_time : float
            On the device's clock, s. A frame that is not newer than the last one, or
            has exactly the same markers (cameras always add noise), is rejected.
        receive_time : float
            On the caller's monotonic clock, s.
        """
        if device_time < self._device_time - _RESTART:
            self._device_time = -math.inf
        dt = device_time - self._device_time
        seen = markers.tobytes()
        new = dt > 0 and seen != self._markers  # false for a NaN time
        if not new:
            dt = math.nan
        else:
            self._device_time, self._markers = device_time, seen
        solved = self.solver.solve(markers, dt)
        error = math.hypot(solved.residual, solved.intermarker_error)
        exchanged = NONE_EXCHANGED
        if new:
            wrong = self._labels.step(markers[self._columns], dt, error).wrong
            exchanged = self._columns[wrong]
        rejection = rejection_reason(
            self.solver, self.settings, markers, solved, new=new, exchanged=exchanged
        )
        machine, self.too_fast = self.machine, False
        if rejection:
            self._why = rejection
            changes = machine.check(receive_time, rejection)
            # The next frame must not start from a pose that does not fit or is old.
            if len(exchanged) or not fits_markers(solved, self.settings):
                at, q = self._counted
                recent = receive_time - at < self.settings.safe_after
                self.solver.reset(q if recent else None)
        else:
            changes = machine.pose(receive_time, self._why)
            self._why = _SILENCE
            self._counted = receive_time, solved.q
            self._follow(solved.c.tolist(), solved.hand_in_thorax, dt)
        flexions = tuple(self.flexions)
        return Decision(
            solved,
            rejection,
            flexions[self._first],
            machine.state,
            changes,
            flexions,
        )

    def check(self, now: float) -> Changes:
        """Check the watchdog while no frame comes."""
        return self.machine.check(now, self._why)

    def _follow(self, c: list[float], hand: NDArray[np.float64], dt: float) -> None:
        place = tuple(hand.tolist())
        step = math.dist(place, self._hand)
        speed = self._speed.step(step / dt if math.isfinite(dt) else math.nan, dt)
        self._hand = place
        settings, flexions = self.settings, self.flexions
        limit = settings.hold_speed
        self.too_fast = limit is not None and speed > limit
        held = self.too_fast or self.machine.state in ("holding", "safe")
        for k, smooth in self._axes:
            wanted = min(max(smooth.step(c[k], dt), 0.0), 1.0)
            now = flexions[k]
            if math.isnan(now) or (
                not held
                and (abs(wanted - now) > settings.dead_band or wanted in (0.0, 1.0))
            ):
                flexions[k] = wanted
