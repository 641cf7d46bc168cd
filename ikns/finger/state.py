"""What a finger tells of itself, and what every finger does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol, Self

__all__ = ["MODES", "SAFE_STATES", "Finger", "FingerState", "Mode", "SafeState"]

Mode = Literal["relaxed", "active", "safe"]
SafeState = Literal["hold", "open", "limp"]

#: What a finger is doing: nothing (no torque), what it is told, or its safe state.
MODES: tuple[Mode, ...] = ("relaxed", "active", "safe")
#: What a finger may do when something fails: stay, open slowly, or lose all torque.
SAFE_STATES: tuple[SafeState, ...] = ("hold", "open", "limp")


@dataclass(frozen=True)
class FingerState:
    """The last that is known of a finger; NaN where the device does not tell.

    Parameters
    ----------
    time : float
        When it was measured, seconds of the finger's clock (monotonic).
    age : float
        Seconds from then until it was asked for.
    mode : {"relaxed", "active", "safe"}
        What it is doing.
    flexion : float
        Measured, 0 open to 1 closed.
    sent : float
        Flexion that the device was last told; NaN with torque off.
    current : float
        Amperes, positive when flexing.
    load : float
        Share of the actuator's full effort, positive when flexing.
    temperature : float
        Degrees Celsius.
    voltage : float
        Volts.
    moving : bool
        Whether the device says that it moves.
    stalled : bool
        Whether something is in its way; its effort has then been reduced.
    alert : str
        Why it is in its safe state, or what the device complains of; empty if nothing.
    """

    time: float = math.nan
    age: float = math.nan
    mode: Mode = "relaxed"
    flexion: float = math.nan
    sent: float = math.nan
    current: float = math.nan
    load: float = math.nan
    temperature: float = math.nan
    voltage: float = math.nan
    moving: bool = False
    stalled: bool = False
    alert: str = ""


class Finger(Protocol):
    """A wearable finger with one degree of freedom, its flexion.

    Safety sits in here, below any controller: range, rate and acceleration limits,
    stall, silence of the caller and of the device, and no torque after any exit.
    :func:`ikns.finger.check_finger` tests an implementation.
    """

    #: Smallest step of flexion that the device can be told; 0 where there is none.
    resolution: float

    def connect(self) -> None:
        """Take hold of the device, from where it is; also leave the safe state."""

    def command(self, flexion: float) -> float:
        """Ask for a flexion; return what was truly sent, NaN if nothing was.

        To be called again and again: the finger moves only as far as its limits
        allow for the time since the last call, and goes to its safe state when it is
        not called for a while. Never blocks, never raises.
        """

    def state(self) -> FingerState:
        """Return the last that is known. Never blocks, never raises."""

    def make_safe(self, reason: str) -> None:
        """Go to the configured safe state and stay there until connected again."""

    def relax(self) -> None:
        """Switch the torque off and let go of the device; harmless when repeated."""

    def __enter__(self) -> Self:
        """Connect."""

    def __exit__(self, *exception: object) -> None:
        """Relax."""
