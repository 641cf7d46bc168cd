"""Status of the live loop while it runs, and its report at the end."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.live.control.safety import Transition
from ikns.live.stream.delays import Delays


def frames(count: int) -> str:
    """Count frames in words.

    >>> frames(1), frames(2)
    ('1 frame', '2 frames')
    """
    return f"{count} frame" + "s" * (count != 1)


class AxisStatus(NamedTuple):
    """Status of one freedom that drives a finger.

    Parameters
    ----------
    dof : int
        Which freedom of the map, from 1 on.
    c, uncertainty : float
        Raw control signal and its standard deviation.
    flexion, measured : float
        Commanded and measured.
    """

    dof: int
    c: float
    uncertainty: float
    flexion: float
    measured: float


@dataclass(frozen=True)
class LoopStatus:
    """Status of the live loop, for a line on a screen.

    Parameters
    ----------
    time : float
        Since the start, s.
    rate : float
        Frames per second since the last status.
    frames, misses : int
        Frames so far, and those that took longer than a frame period.
    latency : float
        99th percentile of the time from receipt to command, s.
    residual, worst_residual : float
        Of the last pose, m: all markers, and the farthest marker of the chain.
    rejection : str
        Why the last frame is rejected; empty if it is valid.
    inside : bool
        Whether the hand is inside the hull of the map's points.
    c, flexion, measured : float
        Raw control signal, commanded flexion, measured flexion; of the first of several
        fingers.
    uncertainty : float
        Standard deviation of c.
    state : str
        Of the safety machine.
    q : (nq,) array
        Configuration of the last frame; NaN before the first.
    stopped : str
        Why the finger is in its safe state; empty unless it is, or without a finger.
    axes : tuple of AxisStatus
        Each freedom that drives a finger.
    too_fast : bool
        Whether the finger is held because the hand is faster than ``hold_speed``.
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
    uncertainty: float
    state: str
    q: NDArray[np.float64]
    stopped: str = ""
    axes: tuple[AxisStatus, ...] = ()
    too_fast: bool = False


@dataclass
class Report:
    """What happened in a run.

    Parameters
    ----------
    frames, misses : int
        Frames processed, and those that took longer than a frame period from receipt
        to command.
    warm_ups : int
        How often the caches were warmed before a frame was due.
    seconds : float
        Duration of the run.
    stages : dict of Delays
        ``solve`` (markers to decision), ``command`` (to the finger), ``total`` (receipt
        to command), ``loop`` (a whole iteration, logging included).
    transitions : list of Transition
        State transitions; the last thousand.
    was_active : bool
        Whether the finger ever followed the signal.
    why : str
        Why the last frame was rejected, or that none came; empty if it was valid.
    rejections : dict of str to int
        Number of frames that were rejected, by reason, the most frequent first.
    notices : list of str
        What was told during the run; the last thousand.
    source : dict
        Counts of frames that were dropped, late, repeated or out of order.
    lost_rows : int
        Rows of the session that were given up so far; :class:`RunWriter` counts those
        that are missing on disk once it is closed.
    stopped : str
        Why the finger was in its safe state at the end; empty if it was not.
    held : int, optional
        Valid frames in which the finger was held because the hand was faster than
        ``hold_speed``; None without such a limit.
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
    was_active: bool = False
    why: str = ""
    rejections: dict[str, int] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)
    source: dict[str, Any] = field(default_factory=dict)
    lost_rows: int = 0
    stopped: str = ""
    held: int | None = None

    @property
    def problem(self) -> str:
        """Why the finger did not move, or no longer; empty if it did to the end.

        >>> Report(rejections={"the right hand is not in sight": 5775}).problem
        'the finger never moved: 5775 frames: the right hand is not in sight.'
        """
        for change, last in [*pairwise(self.transitions)][-1:]:
            if last.before == "safe":
                stayed = max(0.0, last.time - change.time)
                return (
                    f"the finger was in its safe state for the last {stayed:.1f} of "
                    f"{self.seconds:.1f} s: {change.reason}."
                )
        if self.was_active:
            return ""
        reasons = [f"{frames(n)}: {why}" for why, n in self.rejections.items()]
        return f"the finger never moved: {'; '.join(reasons) or self.why}."
