"""The live loop: a frame comes, a pose is found, a finger is told, a row is written.

One thread, no waiting but for the next frame. The finger hears from it at least every
20 ms, frame or no frame, so a loop that hangs is noticed by the finger itself.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.errors import MarkerMismatch
from ikns.finger import Finger
from ikns.live.control.controller import Controller, Decision
from ikns.live.control.frame import FrameSolver
from ikns.live.control.safety import Changes
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime.priority import realtime_priority
from ikns.live.runtime.report import LoopStatus, Report
from ikns.live.session import RunWriter, micro
from ikns.live.session.channels import STATES
from ikns.live.stream import Frame, Source

__all__ = ["run"]

#: The finger and the watchdog are looked after this often while no frame comes, s.
_KEEP_ALIVE = 0.02
#: How long before a frame is due the last one is worked through once more, s. While a
#: thread sleeps, code and data leave the processor's caches: the same frame then takes
#: four times as long (benchmarks/live_loop.py). Warming up takes a third of this.
_AHEAD = 1.5e-3
#: What is sent when nothing may be: the finger stays where it is.
_NOTHING = math.nan


def run(
    source: Source,
    subject: Subject,
    finger: Finger | None = None,
    *,
    settings: ControlSettings | None = None,
    session: RunWriter | None = None,
    duration: float = math.inf,
    stop: threading.Event | None = None,
    on_status: Callable[[LoopStatus], None] | None = None,
    status_every: float = 0.2,
    on_decision: Callable[[float, float, Decision], None] | None = None,
    realtime: bool = False,
) -> Report:
    """Drive a finger with a person's null space until the source ends.

    Parameters
    ----------
    source : Source
        Open, with the markers of the subject's set among its labels.
    subject : Subject
        Calibrated.
    finger : Finger, optional
        Not connected yet; without one everything runs but nothing moves.
    settings : ControlSettings, optional
        Smoothing, dead band, watchdog.
    session : RunWriter, optional
        From :func:`ikns.live.session.open_run` with the labels of the subject's marker
        set; gets a row a frame and is left open.
    duration : float
        Stop after this long, s.
    stop : threading.Event, optional
        Set it to stop: the finger is relaxed.
    on_status : callable, optional
        Called with a :class:`LoopStatus` from the loop, so it must not wait.
    status_every : float
        How often, s.
    on_decision : callable, optional
        Called after each frame's command with the time of its receipt (s, of
        `time.monotonic`), the flexion asked and the :class:`Decision`, from the loop,
        so it must not wait.
    realtime : bool
        Run before all ordinary programs of the machine, where the system allows it.

    Returns
    -------
    Report

    Raises
    ------
    InvalidInput
        When it does not allow it.
    MarkerMismatch
        When the source lacks markers that the subject wears.
    FingerError
        When the finger cannot be connected.
    """
    marker_set = subject.skeleton.marker_set
    missing = [label for label in marker_set.labels if label not in source.labels]
    if len(missing) == len(marker_set.labels):
        raise MarkerMismatch(
            f"{source.name}: expected markers of the subject such as "
            f"{', '.join(missing[:6])}, found {', '.join(source.labels[:6])}."
        )
    columns = marker_set.columns(source.labels)
    solver = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    controller = Controller(solver, settings)
    twin = Controller(
        FrameSolver(subject.skeleton, subject.null_space_map, subject.chain), settings
    )
    loop = _Loop(source, controller, twin, columns, finger, session)
    # What compiles or loads on first use does so before anybody waits.
    solver.solve(np.full((len(marker_set.labels), 3), np.nan))
    solver.reset()
    stopped = threading.Event() if stop is None else stop
    with realtime_priority(realtime=realtime), connected(finger):
        loop.begin()
        try:
            while not (stopped.is_set() or source.ended or loop.elapsed() >= duration):
                frame = source.read(loop.read_timeout())
                if frame is None:
                    if not loop.warm_caches():
                        loop.keep_alive()
                else:
                    decision = loop.take(frame)
                    if on_decision:
                        received = frame.receive_time
                        on_decision(received, decision.flexion, decision)
                if on_status and loop.due(status_every):
                    on_status(loop.status())
        finally:
            loop.end("asked to stop" if stopped.is_set() else "the end")
    return loop.report


class _Loop:
    """State of one run."""

    def __init__(
        self,
        source: Source,
        controller: Controller,
        twin: Controller,
        columns: NDArray[np.int64],
        finger: Finger | None,
        session: RunWriter | None,
    ) -> None:
        self._source, self._controller, self._twin = source, controller, twin
        self._columns, self._absent = columns, np.flatnonzero(columns < 0)
        self._finger, self._session = finger, session
        pace = source.rate * source.speed
        self._period = 1 / pace if pace else math.inf
        # Faster sources leave no time for it, and keep the caches warm themselves.
        self._warms_caches = 4 * _AHEAD <= self._period < math.inf
        self._next_warm_up: tuple[float, NDArray[np.float64], float] | None = None
        self._nowhere = np.full(len(controller.solver.skeleton.neutral()), np.nan)
        self._measured = math.nan
        self._first = math.nan
        self._last: Decision | None = None
        self._shown, self._shown_frames, self._rate = 0.0, 0, math.nan
        self.report = Report()

    def begin(self) -> None:
        """Arm."""
        self._start = time.monotonic()
        self._tell(self._controller.machine.arm(0.0))

    def elapsed(self) -> float:
        """Since the start, s."""
        return time.monotonic() - self._start

    def take(self, frame: Frame) -> Decision:
        """Take one frame all the way to the finger, then write it down."""
        report, received = self.report, frame.receive_time
        if math.isnan(self._first):
            self._first = frame.device_time
        # As on disk, so that a replay computes with the very numbers.
        seen = micro(frame.markers[self._columns])
        seen[self._absent] = np.nan
        device_time = round(frame.device_time - self._first, 6)
        receive_time = round(received - self._start, 6)
        began = time.monotonic()
        decision = self._controller.frame(seen, device_time, receive_time)
        decided = time.monotonic()
        self._tell(decision.changes)
        if decision.valid and decision.state == "armed":
            self._tell(self._controller.machine.activate(receive_time, "poses come"))
        sent = self._command()
        done = time.monotonic()
        self._watch_finger(receive_time)
        report.frames += 1
        report.misses += done - received > self._period
        report.stages["solve"].add(decided - began)
        report.stages["command"].add(done - decided)
        report.stages["total"].add(done - received)
        self._last = decision
        if self._warms_caches:
            self._next_warm_up = (received + self._period, seen, device_time)
        if self._session:
            self._write(
                frame.number,
                device_time,
                receive_time,
                seen,
                decision,
                sent,
                (decided - began, done - received),
            )
        report.stages["loop"].add(time.monotonic() - began)
        return decision

    def read_timeout(self) -> float:
        """How long to wait for a frame before something else is to be done, s."""
        left = self._controller.machine.deadline - self.elapsed()
        if self._next_warm_up is not None:
            left = min(left, self._next_warm_up[0] - _AHEAD - time.monotonic())
        return min(max(left, 0.0), _KEEP_ALIVE)

    def warm_caches(self) -> bool:
        """Shortly before a frame is due, let a twin go through the one before."""
        if self._next_warm_up is None:
            return False
        due, seen, device_time = self._next_warm_up
        now = time.monotonic()
        if now < due - _AHEAD:
            return False
        self._next_warm_up = None
        if now > due - _AHEAD / 2:  # too late: it would stand in the frame's way
            return False
        self._twin.frame(micro(seen), device_time, now)
        self.report.warm_ups += 1
        return True

    def keep_alive(self) -> None:
        """No frame came: ask the watchdog, and let the finger hear from us."""
        now = time.monotonic() - self._start
        self._tell(self._controller.check(now))
        self._command()
        self._watch_finger(now)

    def end(self, reason: str) -> None:
        """Disarm and sum up."""
        now = time.monotonic() - self._start
        self._tell(self._controller.machine.disarm(now, reason))
        self.report.seconds = now
        self.report.source = asdict(self._source.continuity.counts)
        if self._session:
            self.report.lost_rows = self._session.lost

    def due(self, every: float) -> bool:
        """Whether it is time to show how it goes."""
        return self.elapsed() - self._shown >= every

    def status(self) -> LoopStatus:
        """How it goes."""
        now, report, last = self.elapsed(), self.report, self._last
        self._rate = (report.frames - self._shown_frames) / max(now - self._shown, 1e-9)
        self._shown, self._shown_frames = now, report.frames
        return LoopStatus(
            time=now,
            rate=self._rate,
            frames=report.frames,
            misses=report.misses,
            latency=report.stages["total"].percentile(99),
            residual=math.nan if last is None else last.solved.residual,
            worst_residual=math.nan if last is None else last.solved.worst_residual,
            rejection="" if last is None else last.rejection,
            inside=last is not None and last.solved.inside,
            c=math.nan if last is None else float(last.solved.c[0]),
            flexion=self._controller.flexion,
            measured=self._measured,
            state=self._controller.machine.state,
            q=self._nowhere if last is None else last.solved.q,
        )

    def _command(self) -> float:
        """Tell the finger, which limits what it does; return what was sent."""
        if self._finger is None:
            return math.nan
        moving = self._controller.machine.state in ("active", "holding")
        return self._finger.command(self._controller.flexion if moving else _NOTHING)

    def _watch_finger(self, now: float) -> None:
        if self._finger is None:
            return
        state = self._finger.state()
        self._measured = state.flexion
        if state.mode == "safe" and self._controller.machine.state != "safe":
            if self._session:  # asked for, so a replay has to know
                self._session.row("events", [now, 0.0, "stop", state.alert])
            self._tell(self._controller.machine.stop(now, f"finger: {state.alert}"))

    def _tell(self, changes: Changes) -> None:
        for change in changes:
            self.report.transitions.append(change)
            del self.report.transitions[:-1000]
            if change.after == "safe" and self._finger is not None:
                self._finger.make_safe(change.reason)
            if self._session:
                words = f"{change.before} to {change.after}: {change.reason}"
                onset = max(0.0, change.time)
                self._session.row("events", [onset, 0.0, change.after, words])

    def _write(
        self,
        number: int,
        device_time: float,
        receive_time: float,
        seen: np.ndarray,
        decision: Decision,
        sent: float,
        durations: tuple[float, float],
    ) -> None:
        assert self._session is not None
        solved = decision.solved
        self._session.row(
            "markers", [number, device_time, receive_time, *seen.ravel().tolist()]
        )
        angles = np.degrees(solved.q[7:]).tolist()
        self._session.row(
            "model",
            [
                *solved.q[:7].tolist(),
                *angles,
                *solved.hand_in_thorax.tolist(),
                *solved.c.tolist(),
                decision.flexion,
                sent,
                self._measured,
                solved.residual,
                solved.worst_residual,
                solved.intermarker_error,
                float(solved.inside),
                float(STATES.index(decision.state)),
                *durations,
            ],
        )


@contextmanager
def connected(finger: Finger | None) -> Iterator[None]:
    if finger is None:
        yield
        return
    with finger:
        yield
