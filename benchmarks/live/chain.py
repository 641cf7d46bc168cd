"""What the loop does to a finger and a source, watched from outside."""

from __future__ import annotations

import dataclasses
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, Self

from ikns.calibration.subject import Subject
from ikns.calibration.subject_files import FILES
from ikns.errors import FileError
from ikns.finger import Finger, FingerState, Limits
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime import replay_run
from ikns.live.session import (
    RunWriter,
    check_session,
    create_session,
    open_run,
    read_run,
)
from ikns.recording.recording import Recording

__all__ = [
    "Canary",
    "Clock",
    "Told",
    "Watched",
    "session_for",
    "session_holds",
    "violations",
]


class Clock:
    """`time.monotonic` that remembers what it said last."""

    def __init__(self) -> None:
        self.last = time.monotonic()

    def __call__(self) -> float:
        """Seconds."""
        self.last = time.monotonic()
        return self.last


class Told(NamedTuple):
    """A command.

    Parameters
    ----------
    earliest, latest : float
        Bounds of the finger's time, s.
    sent, measured : float
        Flexion.
    """

    earliest: float
    latest: float
    sent: float
    measured: float


class Watched:
    """A finger, and when it was told what.

    Parameters
    ----------
    finger : Finger
    clock : Clock
        The finger's own, where it takes one.
    canary : Canary
        Told when the finger is connected.

    Attributes
    ----------
    told : list of Told
    safe_at, relaxed_at : float
        When it was told so first; NaN while not.
    """

    def __init__(
        self,
        finger: Finger,
        clock: Clock | None = None,
        canary: Canary | None = None,
    ) -> None:
        self.finger, self.clock, self.canary = finger, clock, canary
        self.resolution = finger.resolution
        self.told: list[Told] = []
        self.safe_at = self.relaxed_at = float("nan")

    @property
    def stall(self) -> float:
        """Longest time between two commands beyond the loop's 20 ms, s."""
        pairs = pairwise(self.told)
        return max((b.latest - a.latest for a, b in pairs), default=0.0) - 0.02

    def connect(self) -> None:
        """Connect."""
        self.finger.connect()
        if self.canary is not None:
            self.canary.begin()

    def command(self, flexion: float) -> float:
        """Tell the finger."""
        before = time.monotonic()
        sent = self.finger.command(flexion)
        after = time.monotonic()
        if self.clock is not None:
            before = after = self.clock.last
        measured = self.finger.state().flexion
        self.told.append(Told(before, after, sent, measured))
        return sent

    def state(self) -> FingerState:
        """Ask the finger."""
        return self.finger.state()

    def make_safe(self, reason: str) -> None:
        """Make it safe."""
        self.finger.make_safe(reason)
        if self.safe_at != self.safe_at:
            self.safe_at = time.monotonic()

    def relax(self) -> None:
        """Relax it."""
        self.finger.relax()
        if self.relaxed_at != self.relaxed_at:
            self.relaxed_at = time.monotonic()

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        """Relax, as the finger itself does on its way out."""
        self.finger.__exit__(*exception)
        self.relax()


class Canary:
    """A thread that does nothing but see how late the machine lets it run.

    Attributes
    ----------
    stall : float
        Longest delay since :meth:`begin`, s.
    """

    def __init__(self) -> None:
        self.stall = 0.0
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        while not self._done.wait(0.01):
            now = time.monotonic()
            self.stall = max(self.stall, now - self._before - 0.01)
            self._before = now

    def begin(self) -> None:
        """Forget what was before, when nobody was to be quick yet."""
        self._before, self.stall = time.monotonic(), 0.0

    def __enter__(self) -> Self:
        """Start."""
        self.begin()
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        """End."""
        self._done.set()
        self._thread.join()


def violations(
    told: list[Told], limits: Limits, resolution: float, *, between: bool = False
) -> int:
    """Commands that were out of range, too fast, or accelerated too hard.

    Times are known to their bounds, and flexion to the device's resolution, so a
    velocity is an interval. Mean velocities of neighboring steps differ by at most the
    acceleration times the longer of them; where the limiter steps `between` commands as
    well (a drive's thread, or a simulated finger that is asked for its state while it
    opens or holds), by that times the later and half of the earlier.
    After more than the limiter's longest step the finger has stood still, and motion
    may start from rest as if that much time had passed. A finger that had let go and
    takes hold again is told to stay where it is measured: that is no motion.
    """
    count = 0
    before, speeds, length = None, None, 0.0
    for now in told:
        if not limits.lower - 1e-12 <= now.sent <= limits.upper + 1e-12:
            count += now.sent == now.sent
            before = speeds = None
            continue
        if before is None:
            before = now
            continue
        moved, most = now.sent - before.sent, now.latest - before.earliest
        if abs(moved) <= limits.rate * most + resolution + 1e-9:
            least = now.earliest - before.latest
            if least <= 0:
                continue
            if most > limits.longest_step and speeds is not None:
                speeds = (min(speeds[0], 0.0), max(speeds[1], 0.0))
                least = min(least, limits.longest_step)
            ends = _speeds(moved, least, most, resolution)
            if speeds is not None:
                apart = max(ends[0] - speeds[1], speeds[0] - ends[1])
                lasts = most + length / 2 if between else max(most, length)
                if apart > limits.acceleration * lasts:
                    # Where it is measured, or a step from rest on from there.
                    near = resolution + limits.acceleration * most**2
                    count += not abs(now.sent - now.measured) <= near
                    speeds, before = None, now
                    continue
            speeds, length = ends, most
        else:
            # From where it is measured it may already have made a step again.
            near = resolution + 0.01 + limits.rate * most
            count += not abs(now.sent - now.measured) <= near
            speeds = None
        before = now
    return count


def _speeds(
    moved: float, least: float, most: float, resolution: float
) -> tuple[float, float]:
    off = resolution + 1e-9
    ends = [(moved + by) / taken for by in (-off, off) for taken in (least, most)]
    return min(ends), max(ends)


def session_for(
    folder: Path, subject: Subject, person: Path, recording: Recording, **more: object
) -> RunWriter:
    """Begin a session as `ikns run` does."""
    return open_run(
        create_session(folder),
        labels=subject.skeleton.marker_set.labels,
        joint_names=subject.skeleton.joint_names,
        rate=recording.rate,
        n_dof=subject.null_space_map.n_dof,
        configuration={"settings": dataclasses.asdict(ControlSettings())},
        subject={name: (person / name).read_text("utf-8") for name in FILES},
        **more,
    )


def session_holds(folder: Path, rows: int | None = None) -> str:
    """Say what is wrong with a session: its rows, its contents, or its replay."""
    try:
        found = check_session(folder)
        run = read_run(folder)
        if rows is not None and len(run.frame) != rows:
            found.append(f"{len(run.frame)} rows of {rows}.")
        again = replay_run(run)
    except FileError as error:
        return str(error)
    if not again.same:
        found.append(f"the replay differs: {again.different}.")
    return " ".join(found)
