"""What the live loop says of itself: while it goes, and when it has ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.live.control.safety import Transition
from ikns.live.stream.delays import Delays

__all__ = ["Report", "LoopStatus"]


@dataclass(frozen=True)
class LoopStatus:
    """How it goes, for a line on a screen.

    Parameters
    ----------
    time : float
        Since the start, s.
    rate : float
        Frames per second over the last second or so.
    frames, misses : int
        So far; frames that took longer than a frame's time.
    latency : float
        99th percentile from receipt to command, s.
    residual, worst_residual : float
        Of the last pose: all markers, and the farthest of the chain, m.
    rejection : str
        Why the last frame did not count; empty if it did.
    inside : bool
        Whether the hand is within the points of the map.
    c, flexion, measured : float
        Raw signal, what is asked, what the finger measured.
    state : str
    q : (nq,) array
        Configuration of the last frame; NaN before the first.
    """

    time: float
    rate: float
    frames: int
    misses: int
    latency: float
    residual: float
    worst_residual: float
    rejection: str
    inside: bool
    c: float
    flexion: float
    measured: float
    state: str
    q: NDArray[np.float64]


@dataclass
class Report:
    """What happened, all told.

    Parameters
    ----------
    frames, misses : int
        Frames taken; those that took longer than a frame's time from receipt to
        command.
    warm_ups : int
        Times that the caches were warmed before a frame was due.
    seconds : float
    stages : dict of Delays
        ``solve`` (markers to decision), ``command`` (telling the finger), ``total``
        (receipt to command), ``loop`` (all of an iteration, logging included).
    transitions : list of Transition
        From the start on; the last thousand.
    source : dict
        What was dropped, late, repeated or out of order.
    fault : str
        Why it ended, where it was not asked to.
    lost_rows : int
        Rows of the session that could not be written.
    """

    frames: int = 0
    misses: int = 0
    warm_ups: int = 0
    seconds: float = 0.0
    stages: dict[str, Delays] = field(
        default_factory=lambda: {
            name: Delays() for name in ("solve", "command", "total", "loop")
        }
    )
    transitions: list[Transition] = field(default_factory=list)
    source: dict[str, Any] = field(default_factory=dict)
    fault: str = ""
    lost_rows: int = 0
