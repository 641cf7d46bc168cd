"""A servo that fails, at the end of the loop: the unmodified SDK on a terminal."""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.finger import SAFE_STATES, DynamixelFinger, FingerError, Safety
from ikns.finger.emulator import Servo, Wire
from ikns.live.runtime import run
from ikns.live.stream import Frame, Source
from ikns.live.stream.replay import Replay
from live import person
from live.chain import Canary, Watched, session_for, session_holds, violations
from live.outcome import Outcome
from live.stream_faults import BEAT

__all__ = ["SERVO_FAULTS", "WATCHDOG", "still_at", "strike"]

#: Stated: the finger's patience with a silent servo, what a read without answer takes
#: (with 57600 baud), and the servo's own watchdog in its steps, s.
_SILENCE, _READ, WATCHDOG = 0.25, 0.04, 0.3 + 0.02
#: How often the finger looks whether torque is on.
_LOOK = 0.1
#: How long the servo takes to answer, s, beyond the time of its bytes at 57600 baud.
ANSWER_DELAYS = (0.0, 0.002, 0.004, 0.01)


@dataclass(frozen=True)
class ServoFault:
    """A fault of the emulator.

    Parameters
    ----------
    kind : str
        Of :data:`ikns.finger.emulator.FAULTS`.
    seconds : float
        How long it lasts.
    ends : str
    reaction : float
        Stated time to the safe state, s.
    """

    kind: str
    seconds: float
    ends: str
    reaction: float = math.nan


_PATIENCE = _SILENCE + _READ + BEAT
SERVO_FAULTS = {
    "servo silent, 0.1 s": ServoFault("silence", 0.1, "active"),
    "servo silent, 1 s": ServoFault("silence", 1.0, "safe", _PATIENCE),
    "servo obeys but does not answer, 1 s": ServoFault("mute", 1.0, "safe", _PATIENCE),
    # A late answer may pass for a write's; one that then is no answer to the read is
    # waited out once more.
    "answers 0.2 s late, 1 s": ServoFault("delay", 1.0, "safe", _PATIENCE + 2 * _READ),
    "answers with a wrong checksum, 0.1 s": ServoFault("crc", 0.1, "active"),
    "answers with a wrong checksum, 1 s": ServoFault("crc", 1.0, "safe", _PATIENCE),
    "answers of another servo, 1 s": ServoFault("id", 1.0, "safe", _PATIENCE),
    "hardware alert": ServoFault("alert", 0.0, "safe", _LOOK + BEAT),
    "overheated": ServoFault("overheat", 0.0, "safe", _LOOK + BEAT),
    "supply fails for a moment": ServoFault("power", 0.0, "safe", _PATIENCE),
    "unplugged amid an answer, 1 s": ServoFault("unplug", 1.0, "safe", _PATIENCE),
}


class _Playing:
    """A recording that lets a servo fail at a frame, and ends some time after."""

    def __init__(self, replay: Replay, at: int, wire: Wire, fault: ServoFault) -> None:
        self._replay, self._at, self._wire, self._fault = replay, at, wire, fault
        self.struck_at = math.nan
        self.ended = self.torque_after = False
        self.name, self.labels = replay.name, replay.labels
        self.rate, self.speed, self.events = replay.rate, replay.speed, replay.events
        self.device: dict[str, float] = {}

    def poll(self, timeout: float) -> Frame | None:
        frame = self._replay.poll(timeout)
        if frame is not None and frame.number == self._at:
            fault = self._fault
            value = 0.2 if fault.kind == "delay" else 0.0
            self.struck_at = time.monotonic()
            self._wire.inject(fault.kind, fault.seconds or 1.0, value)
        if frame is not None:
            lasts = max(self._fault.seconds, 0.5)
            self.ended = frame.number > self._at + 100 * lasts + 20
            self.torque_after = self._wire.servos[0].torque
        return frame

    def skip(self) -> None:
        """Nothing comes before it is read."""

    def close(self) -> None:
        """Nothing is held open."""


def still_at(servo: Servo, since: float) -> float:
    """When the servo's motor first was off or stopped after an instant, s."""
    words = ("torque off", "bus watchdog", "started again")
    times = [at for at, text in servo.events if at >= since and text.startswith(words)]
    return min(times, default=math.inf)


def strike(name: str, seed: int, folder: Path) -> Outcome:
    """Inject one fault at a random instant of a random stretch of the recording."""
    fault = SERVO_FAULTS[name]
    rng = np.random.default_rng(seed)
    subject, recording = person.load(folder)
    piece = person.piece(recording, int(rng.integers(len(recording.time) - 400)))
    safe_state = SAFE_STATES[rng.integers(len(SAFE_STATES))]
    at = int(rng.integers(40, 90))
    answer_delay = float(rng.choice(ANSWER_DELAYS))
    remarks: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session"
        servo = Servo("xl430")
        with (
            Canary() as canary,
            Wire(
                servo, link=Path(scratch) / "servo", answer_delay=answer_delay
            ) as wire,
            session_for(session, subject, folder / "person", recording) as writer,
        ):
            inner = DynamixelFinger(wire.port, safety=Safety(safe_state=safe_state))
            finger = Watched(inner, canary=canary)
            feed = _Playing(Replay(piece), at, wire, fault)
            try:
                with Source(feed) as source:
                    report = run(source, subject, finger, session=writer)
            except FingerError as error:
                return Outcome(name, fault.ends, str(error), {}, {}, 0, "")
            if servo.torque:
                remarks.append("the servo was left under torque.")
            if fault.ends == "safe" and safe_state == "limp" and feed.torque_after:
                remarks.append("the servo was limp, under torque.")
            limits, ends = inner.safety.limits, (1024, 3072)  # open, closed
            outside = sum(not ends[0] <= goal <= ends[1] for _, goal in servo.goals)
        wrong = session_holds(session, report.frames)
    after = [change.after for change in report.transitions]
    promised, seconds = {}, {}
    if fault.ends == "safe":
        promised["safe"] = fault.reaction
        seconds["safe"] = finger.safe_at - feed.struck_at
        if fault.kind in ("silence", "unplug"):
            promised["motor"] = WATCHDOG
            seconds["motor"] = still_at(servo, feed.struck_at) - feed.struck_at
    return Outcome(
        name,
        fault.ends,
        after[-2],
        seconds,
        promised,
        violations(finger.told, limits, inner.resolution, between=True) + outside,
        wrong,
        tuple(remarks),
        "holding" in after,
        max(finger.stall, canary.stall),
    )
