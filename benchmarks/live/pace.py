"""Frames at the cameras' pace: how long each takes from here to the finger."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np

from ikns.finger import FingerState, SimulatedFinger
from ikns.live.runtime import run
from ikns.live.stream import Frame, LslOutlet, Source, open_source
from ikns.live.stream.replay import Replay, wait_until
from ikns.recording.recording import Recording
from live import person
from live.chain import session_for

__all__ = ["Pace", "over_lsl", "replayed"]


@dataclass
class Pace:
    """How frames went through.

    Parameters
    ----------
    frames, lost : int
        Commanded, and sent but never commanded.
    milliseconds : dict of str to float
        ``p50``, ``p99``, ``p99.9`` and ``worst``, from receipt (over LSL: from the
        outlet's call) to the command.
    from_due : dict of str to float
        The same from the instant that the frame was due, waking up included.
    backlog : float
        Median of the latter over the last tenth of the frames less that over the first.
    misses : int
        Frames that took longer than until the next.
    holds : int
        Times that the finger held for lack of poses.
    lost_rows : int
        Of the session.
    """

    frames: int
    lost: int
    milliseconds: dict[str, float]
    from_due: dict[str, float]
    backlog: float
    misses: int
    holds: int
    lost_rows: int


class _Timed:
    """Source and finger at once, to see when which frame has become a command."""

    def __init__(self, source: Source, frames: int) -> None:
        self._source, self._finger = source, SimulatedFinger()
        self.resolution = self._finger.resolution
        self._frame: Frame | None = None
        self._most = frames
        self.device, self.received, self.commanded = (
            np.full(frames, np.nan) for _ in range(3)
        )
        self.count = 0
        self._give_up = np.inf

    def __getattr__(self, name: str) -> Any:
        return getattr(self._source, name)

    @property
    def ended(self) -> bool:
        late = time.monotonic() > self._give_up
        return self._source.ended or self.count >= self._most or late

    def read(self, timeout: float) -> Frame | None:
        frame = self._frame = self._source.read(timeout)
        if frame is not None and not self.count:
            lasts = self._most / (frame_rate(self._source))
            self._give_up = frame.receive_time + lasts + 2
        return frame

    def command(self, flexion: float) -> float:
        sent = self._finger.command(flexion)
        frame = self._frame
        if frame is not None and self.count < self._most:
            k = self.count
            self.device[k], self.received[k] = frame.device_time, frame.receive_time
            self.commanded[k] = time.monotonic()
            self.count += 1
            self._frame = None
        return sent

    def connect(self) -> None:
        self._finger.connect()

    def state(self) -> FingerState:
        return self._finger.state()

    def make_safe(self, reason: str) -> None:
        self._finger.make_safe(reason)

    def relax(self) -> None:
        self._finger.relax()

    def __enter__(self) -> _Timed:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.relax()


def frame_rate(source: Source) -> float:
    """Frames per second of this machine's clock."""
    return source.rate * source.speed


def replayed(
    folder: Path,
    rate: float,
    seconds: float,
    session: bool,
    *,
    busy: float = 0.0,
    programs: int = 0,
    realtime: bool = False,
) -> Pace:
    """Play a recording into the loop of the same process.

    Beside it a thread may be busy, for a share of 16 ms, a page's time between draws,
    and so may whole programs.
    """
    _, recording = person.load(folder)
    played = person.retimed(recording, rate)
    frames = round(rate * seconds)
    timed = _Timed(Source(Replay(played, loop=True)), frames)
    over = Event()
    if busy:
        Thread(target=_compute, args=(busy, over), daemon=True).start()
    with ExitStack() as stack:
        for _ in range(programs):
            endless = [sys.executable, "-c", "while True: pass"]
            stack.callback(subprocess.Popen(endless).kill)
        report = _run(timed, folder, played, session, realtime=realtime)
    over.set()
    due = timed.received[0] + (timed.device - timed.device[0])
    return _pace(timed, report, timed.received, due, frames)


def _compute(share: float, over: Event) -> None:
    while not over.wait((1 - share) * 0.016):
        until = time.monotonic() + share * 0.016
        while time.monotonic() < until:
            sum(range(50))


def over_lsl(folder: Path, rate: float, seconds: float, session: bool) -> Pace:
    """Play a recording from another process, over LSL on this machine."""
    _, recording = person.load(folder)
    frames = round(rate * seconds)
    name = f"ikns-benchmark-{os.getpid()}-{session:d}"
    context = get_context("forkserver")
    ours, theirs = context.Pipe()
    sender = context.Process(target=_send, args=(folder, rate, frames, name, theirs))
    sender.start()
    with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
        timed = _Timed(source, frames)
        report = _run(timed, folder, recording, session)
        offset = source.device["clock_offset"]
    start, sent = ours.recv()
    ours.send(None)
    sender.join()
    k = np.rint((timed.device[: timed.count] + offset - start) * rate).astype(int)
    at_call, due = np.full(frames, np.nan), np.full(frames, np.nan)
    at_call[: timed.count], due[: timed.count] = sent[k], start + k / rate
    return _pace(timed, report, at_call, due, frames)


def _send(
    folder: Path, rate: float, frames: int, name: str, result: Connection
) -> None:
    """Send on absolute deadlines; report when each was sent."""
    _, recording = person.load(folder)
    sent = np.empty(frames)
    with LslOutlet(recording.labels, rate, name=name) as outlet:
        outlet.wait_for_listener(120)
        start = time.monotonic() + 1.0
        for k in range(frames):
            sent[k] = wait_until(start + k / rate)
            outlet.push(recording.markers[k % len(recording.time)], start + k / rate)
        result.send((start, sent))
        result.recv()  # the reader has all


def _run(
    timed: _Timed,
    folder: Path,
    recording: Recording,
    session: bool,
    *,
    realtime: bool = False,
) -> Any:
    subject, _ = person.load(folder)
    with ExitStack() as stack:
        writer = None
        if session:
            place = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "session"
            writer = stack.enter_context(
                session_for(place, subject, folder / "person", recording)
            )
        return run(timed, subject, timed, session=writer, realtime=realtime)


def _pace(
    timed: _Timed, report: Any, since: np.ndarray, due: np.ndarray, frames: int
) -> Pace:
    n = timed.count
    took = timed.commanded[:n] - since[:n]
    late = timed.commanded[:n] - due[:n]
    tenth = max(n // 10, 1)
    return Pace(
        n,
        frames - len(np.unique(timed.device[:n])),
        _percentiles(took),
        _percentiles(late),
        1e3 * float(np.median(late[-tenth:]) - np.median(late[:tenth])),
        report.misses,
        sum(change.after == "holding" for change in report.transitions),
        report.lost_rows,
    )


def _percentiles(seconds: np.ndarray) -> dict[str, float]:
    values = 1e3 * np.percentile(seconds, [50, 99, 99.9, 100])
    names = ("p50", "p99", "p99.9", "worst")
    return {name: float(value) for name, value in zip(names, values, strict=True)}
