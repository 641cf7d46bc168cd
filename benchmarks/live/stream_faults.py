"""Cameras that fail, in front of a controller and a simulated finger."""

from __future__ import annotations

import math
import re
import tempfile
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ikns.finger import SAFE_STATES, Safety, SimulatedFinger
from ikns.live.runtime import run
from ikns.live.stream import Frame, Source
from ikns.live.stream.replay import Replay
from live import person
from live.chain import Clock, Watched, session_for, session_holds, violations
from live.outcome import Outcome

__all__ = ["BEAT", "HOLD", "SAFE", "STREAM_FAULTS", "Struck", "strike"]

#: Stated: hold after, safe after, and how often the loop looks, s.
HOLD, SAFE, BEAT = 0.1, 0.5, 0.02
#: Frames after a fault until the run ends.
_AFTER = 30

Rng = np.random.Generator
#: A frame that is due, the one before the fault, frames since it began: what comes
#: instead, and how long the first of it is held up, s.
Change = Callable[[Frame, Frame, int, Rng], tuple[list[Frame], float]]


@dataclass(frozen=True)
class StreamFault:
    """A fault of a source.

    Parameters
    ----------
    name : str
    seconds : float
        How long it lasts.
    ends : str
        State that the loop must end in.
    change : callable
    """

    name: str
    seconds: float
    ends: str
    change: Change


class Struck:
    """A feed that a fault strikes at a frame.

    Parameters
    ----------
    replay : Replay
    start, stop : int
        First frame that suffers, and first after.
    change : Change
    rng : numpy.random.Generator

    Attributes
    ----------
    good_at : float
        When the last frame before the fault came, s.
    """

    def __init__(
        self, replay: Replay, start: int, stop: int, change: Change, rng: Rng
    ) -> None:
        self._replay, self._start, self._stop = replay, start, stop
        self._change, self._rng = change, rng
        self._waiting: deque[Frame] = deque()
        self._until = -math.inf
        self._before: Frame | None = None
        self.good_at = math.nan
        self.ended = False
        self.name, self.labels = replay.name, replay.labels
        self.rate, self.speed, self.events = replay.rate, replay.speed, replay.events
        self.device: dict[str, float] = {}

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame that comes through."""
        give_up = time.monotonic() + timeout
        while (now := time.monotonic()) < give_up:
            if now < self._until:
                time.sleep(min(self._until, give_up) - now)
            elif self._waiting:
                return replace(self._waiting.popleft(), receive_time=now)
            elif frame := self._replay.poll(give_up - now):
                self._take(frame)
        return None

    def _take(self, frame: Frame) -> None:
        if self._start <= frame.number < self._stop and self._before is not None:
            since = frame.number - self._start
            instead, hold = self._change(frame, self._before, since, self._rng)
            self._waiting.extend(instead)
            if hold:
                self._until = frame.receive_time + hold
            return
        if frame.number < self._start:
            self._before, self.good_at = frame, frame.receive_time
        self.ended = frame.number >= self._stop + _AFTER
        self._waiting.append(frame)

    def skip(self) -> None:
        """Nothing comes before it is read."""

    def close(self) -> None:
        """Nothing is held open."""


def _markers(change: Callable[[np.ndarray, Frame, int, Rng], np.ndarray]) -> Change:
    def changed(frame: Frame, before: Frame, since: int, rng: Rng):
        markers = change(frame.markers.copy(), before, since, rng)
        return [replace(frame, markers=markers)], 0.0

    return changed


def _clock(change: Callable[[float, float], float]) -> Change:
    def changed(frame: Frame, before: Frame, since: int, rng: Rng):
        at = change(frame.device_time, before.device_time)
        return [replace(frame, device_time=at)], 0.0

    return changed


def _silent(frame: Frame, before: Frame, since: int, rng: Rng):
    return [], 0.0


def _twice(frame: Frame, before: Frame, since: int, rng: Rng):
    return [frame, frame], 0.0


def _stuck(frame: Frame, before: Frame, since: int, rng: Rng):
    return [before], 0.0


def _held(seconds: float) -> Change:
    # The rest queues up behind the first, as in a network that is stuck.
    return lambda frame, before, since, rng: ([frame], 0.0 if since else seconds)


def _dropped(frame: Frame, before: Frame, since: int, rng: Rng):
    return ([] if rng.random() < 0.3 else [frame]), 0.0


def _swapped_pairs() -> Change:
    kept: list[Frame] = []

    def changed(frame: Frame, before: Frame, since: int, rng: Rng):
        kept.append(frame)
        if len(kept) < 2:
            return [], 0.0
        pair = kept[::-1]
        kept.clear()
        return pair, 0.0

    return changed


def _exchanged() -> Change:
    pair: list[int] = []

    def changed(markers, before, since, rng):
        if not since:
            pair[:] = rng.choice(len(markers), 2, replace=False)
        markers[pair] = markers[pair[::-1]]
        return markers

    return _markers(changed)


def _astray() -> Change:
    where: list[np.ndarray] = []

    def changed(markers, before, since, rng):
        if not since:
            way = rng.normal(size=3)
            where[:] = [rng.integers(len(markers)), way / np.linalg.norm(way)]
        markers[where[0]] += where[1]
        return markers

    return _markers(changed)


def all_faults() -> list[StreamFault]:
    """All of them; some keep state, so a new list for each use."""
    frozen = _markers(lambda markers, before, since, rng: before.markers)
    hidden = _markers(lambda markers, before, since, rng: np.full_like(markers, np.nan))
    infinite = _markers(lambda markers, before, since, rng: markers * np.inf)
    far = _markers(lambda markers, before, since, rng: markers * 1e6)
    noise = _markers(lambda markers, b, s, rng: rng.normal(size=markers.shape))
    return [
        StreamFault("silence, 50 ms", 0.05, "active", _silent),
        StreamFault("silence, 0.3 s", 0.3, "active", _silent),
        StreamFault("silence, 1 s", 1.0, "safe", _silent),
        StreamFault("held up 0.3 s, then all at once", 0.3, "active", _held(0.3)),
        StreamFault("held up 1 s, then all at once", 1.0, "safe", _held(1.0)),
        StreamFault("frozen picture, 0.3 s", 0.3, "active", frozen),
        StreamFault("frozen picture, 1 s", 1.0, "safe", frozen),
        StreamFault("3 of 10 frames dropped, 1 s", 1.0, "active", _dropped),
        StreamFault("pairs out of order, 1 s", 1.0, "active", _swapped_pairs()),
        StreamFault("every frame twice, 1 s", 1.0, "active", _twice),
        StreamFault("one frame over and over, 1 s", 1.0, "safe", _stuck),
        StreamFault("all markers hidden, 1 s", 1.0, "safe", hidden),
        StreamFault("markers infinite, 1 s", 1.0, "safe", infinite),
        StreamFault("markers a million times as far, 1 s", 1.0, "safe", far),
        StreamFault("markers are noise, 1 s", 1.0, "safe", noise),
        StreamFault("a marker 1 m astray, 50 ms", 0.05, "active", _astray()),
        StreamFault("a marker 1 m astray, 1 s", 1.0, "safe", _astray()),
        StreamFault("two markers exchanged, 1 s", 1.0, "active or safe", _exchanged()),
        StreamFault(
            "device clock 1 h ahead, 1 s", 1.0, "active", _clock(lambda t, _: t + 3600)
        ),
        StreamFault(
            "device clock 1 h back, 1 s", 1.0, "active", _clock(lambda t, _: t - 3600)
        ),
        StreamFault(
            "device clock 0.9 s back, 1 s", 1.0, "safe", _clock(lambda t, _: t - 0.9)
        ),
        StreamFault("device clock stands, 1 s", 1.0, "safe", _clock(lambda _, b: b)),
        StreamFault(
            "device time missing, 1 s", 1.0, "safe", _clock(lambda *_: math.nan)
        ),
    ]


STREAM_FAULTS = tuple(fault.name for fault in all_faults())


def strike(name: str, seed: int, folder: Path) -> Outcome:
    """Inject one fault at a random instant of a random stretch of the recording."""
    fault = next(one for one in all_faults() if one.name == name)
    rng = np.random.default_rng(seed)
    subject, recording = person.load(folder)
    offset = int(rng.integers(len(recording.time) - 300))
    piece = person.piece(recording, offset)
    start = int(rng.integers(40, 90))
    stop = start + round(fault.seconds * recording.rate)
    feed = Struck(Replay(piece), start, stop, fault.change, rng)
    safe_state = SAFE_STATES[rng.integers(len(SAFE_STATES))]
    clock = Clock()
    inner = SimulatedFinger(safety=Safety(safe_state=safe_state), clock=clock)
    finger = Watched(inner, clock)
    began = math.nan

    def note(status) -> None:
        nonlocal began
        began = time.monotonic() - status.time

    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session"
        with session_for(session, subject, folder / "person", recording) as writer:
            with Source(feed) as source:
                report = run(
                    source,
                    subject,
                    finger,
                    session=writer,
                    on_status=note,
                    status_every=0.1,
                )
        wrong = session_holds(session, report.frames)
    if fault.ends == "safe" and "missing" in name:
        wrong = re.sub(r"run 1: device_time is missing in \d+ rows\.", "", wrong)
    changes = report.transitions
    after = [change.after for change in changes]
    ended = after[-2]
    holds = [began + c.time for c in changes if c.after == "holding"]
    held = next((at for at in holds if at > feed.good_at), math.inf)
    seconds = {"hold": held - feed.good_at, "safe": finger.safe_at - feed.good_at}
    promised = {}
    if fault.seconds > HOLD and fault.ends == "safe":
        promised = {"hold": HOLD + BEAT, "safe": SAFE + BEAT}
    elif fault.seconds == 0.3:
        promised = {"hold": HOLD + BEAT}
    remarks = _remarks(finger, safe_state) if ended == "safe" else ()
    return Outcome(
        name,
        fault.ends,
        fault.ends if ended in fault.ends.split(" or ") else ended,
        seconds,
        promised,
        violations(finger.told, inner.safety.limits, 0.0, between=True),
        wrong,
        remarks,
        "holding" in after,
        finger.stall,
    )


def _remarks(finger: Watched, safe_state: str) -> tuple[str, ...]:
    """Whether the finger did in its safe state what was chosen."""
    sent = [one.sent for one in finger.told if one.latest > finger.safe_at]
    if safe_state == "limp" and not all(map(math.isnan, sent)):
        return ("it was not limp.",)
    if safe_state == "hold" and max(sent[-5:]) > min(sent[-5:]):
        return ("it did not hold.",)
    if safe_state == "open" and not (sent[-1] < sent[0] or sent[-1] == 0):
        return ("it did not open.",)
    return ()
