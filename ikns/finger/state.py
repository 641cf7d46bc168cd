"""The state of a finger, and the interface of every finger."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol, Self

Mode = Literal["relaxed", "active", "safe"]
SafeState = Literal["hold", "open", "limp"]

#: Modes of a finger: no torque, following commands, or in its safe state.
MODES: tuple[Mode, ...] = ("relaxed", "active", "safe")
#: What a finger may do when something fails: hold its place, open, or go limp.
SAFE_STATES: tuple[SafeState, ...] = ("hold", "open", "limp")


@dataclass(frozen=True)
class FingerState:
    """Latest known state of a finger; NaN where the device does not report a value.

    Parameters
    ----------
    time : float
        When it was measured, s on the finger's monotonic clock.
    age : float
        Time since then when the state was read, s.
    mode : {"relaxed", "active", "safe"}
        See :data:`MODES`.
    flexion : float
        Measured, 0 open to 1 closed.
    sent : float
        Flexion last sent to the device; NaN with torque off.
    current : float
        A, positive when flexing.
    load : float
        Share of the actuator's full effort, positive when flexing.
    temperature : float
        Degrees Celsius.
    voltage : float
        V.
    moving : bool
        Whether the device reports that it moves.
    stalled : bool
        Whether an obstacle stops it; its effort is then reduced.
    alert : str
        Why it is in its safe state, or an alert of the device; empty if there is none.
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

    It is safe below any controller: it limits range, rate and acceleration, handles
    stall and the silence of caller and device, and leaves no torque after any exit.
    :func:`ikns.finger.check_finger` tests an implementation.
    """

    #: Smallest step of flexion that can be sent; 0 if there is no such limit.
    resolution: float

    def connect(self) -> None:
        """Connect, follow commands from the present flexion, leave the safe state."""

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one sent to the device, NaN if none was.

        Call it periodically: each call moves the finger only as far as its limits
        allow for the time since the last one, and without calls the finger goes to its
        safe state. Never blocks, never raises.
        """

    def state(self) -> FingerState:
        """Return the latest known state. Never blocks, never raises."""

    def make_safe(self, reason: str) -> None:
        """Go to the configured safe state and stay in it until connected again."""

    def relax(self) -> None:
        """Switch the torque off and disconnect; harmless when repeated."""

    def __enter__(self) -> Self:
        """Connect."""

    def __exit__(self, *_: object) -> None:
        """Relax."""
