"""How the control signal becomes a flexion, and which frames count."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ikns.errors import InvalidInput

__all__ = ["ControlSettings"]


@dataclass(frozen=True)
class ControlSettings:
    """How the control signal becomes a flexion.

    Parameters
    ----------
    cutoff, beta : float
        Of the smoothing, Hz and Hz per (unit of c / s); see
        :class:`ikns.live.control.smoothing.OneEuro`. The defaults are ours: with a
        share ``a = w dt / (1 + w dt)`` of each innovation (w = 2 pi times the cut-off)
        they leave ``sqrt(a / (2 - a))``, a quarter, of white noise of 100 Hz at rest
        and cost ``dt (1 - a) / a = 1 / w``, 80 ms; where c moves by 1 per second, 16
        ms.
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
    max_intermarker_error : float
        Nor does a frame count where the distance between two markers of a segment of
        the chain is farther off what it was at calibration, m. Real people's came to
        24 mm between landmarks on the skin, to 13 within clusters (same benchmark).
    hold_after, safe_after : float
        See :class:`ikns.live.control.safety.SafetyMachine`, s.
    """

    cutoff: float = 2.0
    beta: float = 3.0
    dead_band: float = 0.005
    hold_speed: float | None = None
    max_residual: float = 0.05
    max_worst_residual: float = 0.08
    max_intermarker_error: float = 0.04
    hold_after: float = 0.1
    safe_after: float = 0.5

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 0 <= self.dead_band < 1:
            raise InvalidInput(
                f"expected a dead band from 0 to below 1, found {self.dead_band:g}."
            )
        for name in (
            "hold_speed",
            "max_residual",
            "max_worst_residual",
            "max_intermarker_error",
        ):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InvalidInput(f"expected a positive {name}, found {value:g}.")
