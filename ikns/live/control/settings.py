"""How the control signal becomes a flexion, and which frames are valid."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from ikns.errors import InvalidInput
from ikns.live.control.frame import MAX_UNCERTAINTY
from ikns.motion.marker_ik.gate import GateLimits
from ikns.nullspace.readout import METHODS, Method

_LIMITS = GateLimits()


@dataclass(frozen=True)
class ControlSettings:
    """How the control signal becomes a flexion, and which frames are valid.

    Parameters
    ----------
    cutoff, beta : float
        Smoothing, Hz and Hz per (unit of c / s); see
        :class:`ikns.live.control.smoothing.OneEuro`. The defaults were chosen for this
        package: with a share ``a = w dt / (1 + w dt)`` of each innovation (w = 2 pi
        times the cut-off) they pass ``sqrt(a / (2 - a))``, a quarter, of white noise at
        100 Hz at rest and delay c by ``dt (1 - a) / a = 1 / w``, 80 ms; while c moves
        by 1 per second, by 16 ms.
    dead_band : float
        Smaller changes of flexion are ignored.
    hold_speed : float, optional
        While the hand is faster, the flexion is held, m/s. Default: never.
    max_residual, max_worst_residual, max_intermarker_error : float
        See :class:`ikns.motion.marker_ik.gate.GateLimits`, m.
    max_uncertainty : float or None
        c moves nothing while its standard deviation is larger; see
        :class:`ikns.live.control.FrameSolver`.
    method : {"paper", "proximal", "intent"}
        What reads c off the posture, see :mod:`ikns.nullspace.readout`.
    hold_after, safe_after : float
        See :class:`ikns.live.control.safety.SafetyMachine`, s.
    dofs : tuple of int
        Freedoms of the map that drive a finger, from 1 on. A frame is valid when the
        signals of all of them are known: an axis without a signal holds the others.
    """

    cutoff: float = 2.0
    beta: float = 3.0
    dead_band: float = 0.005
    hold_speed: float | None = None
    max_residual: float = _LIMITS.residual
    max_worst_residual: float = _LIMITS.worst_residual
    max_intermarker_error: float = _LIMITS.intermarker_error
    max_uncertainty: float | None = MAX_UNCERTAINTY
    method: Method = "paper"
    hold_after: float = 0.1
    safe_after: float = 0.5
    dofs: tuple[int, ...] = (1,)

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not 0 <= self.dead_band < 1:
            raise InvalidInput(
                f"expected a dead band from 0 to below 1, found {self.dead_band:g}."
            )
        object.__setattr__(self, "dofs", tuple(self.dofs))
        if not self.dofs or min(self.dofs) < 1 or len(set(self.dofs)) < len(self.dofs):
            raise InvalidInput(
                "expected different dofs, counted from 1, found "
                f"{', '.join(map(str, self.dofs)) or 'none'}."
            )
        if self.method not in METHODS:
            raise InvalidInput(
                f"expected a method of {', '.join(METHODS)}, found '{self.method}'."
            )
        for name in (
            "hold_speed",
            "max_residual",
            "max_worst_residual",
            "max_intermarker_error",
            "max_uncertainty",
        ):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InvalidInput(f"{name} must be above 0, found {value:g}.")

    def table(self) -> dict[str, Any]:
        """Return what a session keeps; `dofs` where it is not the first alone."""
        kept = asdict(self)
        if self.dofs == (1,):
            del kept["dofs"]
        return kept

    @property
    def limits(self) -> GateLimits:
        """What the markers of a valid frame do not exceed."""
        return GateLimits(
            self.max_residual, self.max_worst_residual, self.max_intermarker_error
        )
