"""State of one run of the live loop, and what it does with each frame."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from ikns.errors import IknsError
from ikns.finger import FingerGroup
from ikns.live.control.controller import Controller, Decision
from ikns.live.control.safety import Changes
from ikns.live.runtime.cache_warmer import CacheWarmer
from ikns.live.runtime.listener import LoopListener
from ikns.live.runtime.notices import Notices
from ikns.live.runtime.report import AxisStatus, LoopStatus, Report
from ikns.live.runtime.session_log import write_event, write_frame
from ikns.live.session import RunWriter, micro
from ikns.live.stream import Frame, Source
from ikns.motion.marker_ik.rejection_count import RejectionCount

#: Longest time between two commands to the finger and checks of the watchdog, s.
_KEEP_ALIVE = 0.02


class FrameLoop:
    """One run of the live loop.

    Parameters
    ----------
    source : Source
    controller : Controller
        Drives the fingers.
    twin : Controller
        One like it, for warming the caches.
    columns : (M,) integer array
        Where the markers of the subject's set are among the source's; -1 where missing.
    fingers : FingerGroup, optional
        One for each of the freedoms that the controller's settings name.
    session : RunWriter, optional
    on_notice : callable, optional
        See :func:`ikns.live.runtime.run`.
    listener : LoopListener, optional
        Hears of frames and events.

    Attributes
    ----------
    report : Report
    """

    def __init__(
        self,
        source: Source,
        controller: Controller,
        twin: Controller,
        columns: NDArray[np.int64],
        fingers: FingerGroup | None,
        session: RunWriter | None,
        on_notice: Callable[[str], None] | None = None,
        listener: LoopListener | None = None,
    ) -> None:
        self._listener = listener
        self._source, self._controller = source, controller
        self._columns, self._absent = columns, np.flatnonzero(columns < 0)
        self._fingers, self._session = fingers, session
        self._driven = [dof - 1 for dof in controller.settings.dofs]
        pace = source.rate * source.speed
        self._period = 1 / pace if pace else math.inf
        self._warmer = CacheWarmer(twin, self._period)
        self._unknown_q = np.full(len(controller.solver.skeleton.neutral()), np.nan)
        self._in_order = self._driven == [*range(len(controller.flexions))]
        self._unknown = [math.nan] * len(controller.flexions)
        self._measured = self._unknown
        self._first_device_time = math.nan
        self._last: Decision | None = None
        self._status_time, self._status_frames = 0.0, 0
        self._armed_at = -math.inf
        self._stopped = self._alert = self._refusal = ""
        self._on_notice = on_notice
        self._notices = Notices(source, self._notice)
        self._rejections = RejectionCount()
        limit = controller.settings.hold_speed
        self.report = Report(held=None if limit is None else 0)

    def arm(self) -> None:
        """Start the clock and arm the safety machine."""
        # What a source received before, while others were being opened, is outdated.
        self._start = self._armed_at = time.monotonic()
        self._source.skip()
        if self._listener:
            self._listener.event(self._start, "start", "time 0 of the run")
        self._apply(self._controller.machine.arm(0.0))

    def arm_again(self) -> None:
        """Leave the safe state on request, from the measured position and from rest.

        Connects the finger again, which takes a few tens of packets; frames that come
        meanwhile are not used.
        """
        if self._controller.machine.state != "safe":
            return
        if self._fingers is not None:
            try:
                self._fingers.connect()
            except (IknsError, OSError) as error:
                self._refusal = f"; re-arming failed: {str(error).rstrip('.')}"
                self._notice(self.elapsed(), self._refusal[2:] + ".")
                return
        self._armed_at = time.monotonic()
        self._source.skip()
        self._apply(self._controller.machine.arm_again(self.elapsed()))

    def is_current(self, frame: Frame) -> bool:
        """Whether a frame came after the finger was armed."""
        return frame.receive_time >= self._armed_at

    def elapsed(self) -> float:
        """Time since the start, s."""
        return time.monotonic() - self._start

    def process(self, frame: Frame) -> Decision:
        """Turn a frame into a command to the finger, then write it to the session."""
        report, received = self.report, frame.receive_time
        if math.isnan(self._first_device_time):
            self._first_device_time = frame.device_time
        # Rounded as on disk, so that a replay computes with the same numbers.
        markers = micro(frame.markers[self._columns])
        if len(self._absent):
            markers[self._absent] = np.nan
        device_time = round(frame.device_time - self._first_device_time, 6)
        receive_time = round(received - self._start, 6)
        began = time.monotonic()
        decision = self._controller.frame(markers, device_time, receive_time)
        decided = time.monotonic()
        self._apply(decision.changes)
        if decision.valid and decision.state == "armed":
            self._apply(
                self._controller.machine.activate(receive_time, "first valid pose")
            )
        sent = self._command()
        done = time.monotonic()
        self._check_fingers(receive_time)
        if decision.rejection:
            self._rejections.add(decision.rejection)
        self._notices.frame(receive_time, decision.rejection)
        self._notices.check(receive_time)
        report.frames += 1
        report.misses += done - received > self._period
        if report.held is not None:
            report.held += self._controller.too_fast
        report.stages["solve"].add(decided - began)
        report.stages["command"].add(done - decided)
        report.stages["total"].add(done - received)
        self._last = decision
        self._warmer.frame(markers, device_time, received)
        if self._session:
            write_frame(
                self._session,
                (frame.number, device_time, receive_time),
                markers,
                decision,
                sent=sent,
                measured=self._measured,
                durations=(decided - began, done - received),
            )
        if self._listener:
            self._listener.decision(received, decision, markers)
        report.stages["loop"].add(time.monotonic() - began)
        return decision

    def read_timeout(self) -> float:
        """How long to wait for a frame before something else is to be done, s."""
        left = self._controller.machine.deadline - self.elapsed()
        left = min(left, self._warmer.time_left())
        return min(max(left, 0.0), _KEEP_ALIVE)

    def warm_caches(self) -> bool:
        """Warm the caches if a frame is due shortly; return whether that was done."""
        warmed = self._warmer.warm_caches()
        self.report.warm_ups = self._warmer.count
        return warmed

    def keep_alive(self) -> None:
        """Without a frame: check the watchdog and command the finger."""
        now = time.monotonic() - self._start
        self._apply(self._controller.check(now))
        self._command()
        self._check_fingers(now)
        self._notices.check(now)

    def disarm(self, reason: str) -> None:
        """Disarm the safety machine and complete the report."""
        now = time.monotonic() - self._start
        self.report.stopped = self._stop_reason()
        self._apply(self._controller.machine.disarm(now, reason))
        self.report.seconds = now
        self.report.was_active = self._notices.was_active
        self.report.why = self._notices.why
        self.report.rejections = self._rejections.table()
        self.report.source = asdict(self._source.continuity.counts)
        if self._session:
            self.report.lost_rows = self._session.lost

    def status_due(self, every: float) -> bool:
        """Whether it is time for the next status."""
        return self.elapsed() - self._status_time >= every

    def status(self) -> LoopStatus:
        """Return the present status."""
        now, report, last = self.elapsed(), self.report, self._last
        new_frames = report.frames - self._status_frames
        rate = new_frames / max(now - self._status_time, 1e-9)
        self._status_time, self._status_frames = now, report.frames
        axes = self._axes()
        return LoopStatus(
            time=now,
            rate=rate,
            frames=report.frames,
            misses=report.misses,
            latency=report.stages["total"].percentile(99),
            residual=math.nan if last is None else last.solved.residual,
            worst_residual=math.nan if last is None else last.solved.worst_residual,
            rejection="" if last is None else last.rejection,
            too_fast=self._controller.too_fast,
            inside=last is not None and last.solved.inside,
            c=axes[0].c,
            flexion=axes[0].flexion,
            measured=axes[0].measured,
            uncertainty=axes[0].uncertainty,
            state=self._controller.machine.state,
            q=self._unknown_q if last is None else last.solved.q,
            stopped=self._stop_reason(),
            axes=axes,
        )

    def _axes(self) -> tuple[AxisStatus, ...]:
        """Return the status of each freedom that drives a finger, the first first."""
        solved = None if self._last is None else self._last.solved
        return tuple(
            AxisStatus(
                dof=k + 1,
                c=math.nan if solved is None else float(solved.c[k]),
                uncertainty=math.nan
                if solved is None
                else float(solved.uncertainty[k]),
                flexion=self._controller.flexions[k],
                measured=self._measured[k],
            )
            for k in self._driven
        )

    def _stop_reason(self) -> str:
        """Return why the fingers are stopped; what they say is more recent."""
        if self._fingers is None or self._controller.machine.state != "safe":
            return ""
        return (self._alert or self._stopped) + self._refusal

    def _command(self) -> list[float]:
        """Command the fingers, which limit what they do; return what was sent."""
        if self._fingers is None:
            return self._unknown
        wanted = self._controller.flexions
        if self._controller.machine.state not in ("active", "holding"):
            wanted = self._unknown  # NaN: brake and stay
        if self._in_order:
            return self._fingers.command(wanted)
        return self._by_dof(self._fingers.command([wanted[k] for k in self._driven]))

    def _check_fingers(self, now: float) -> None:
        """Stop when a finger has gone to its safe state by itself."""
        if self._fingers is None:
            return
        states = self._fingers.states()
        measured = []
        for state in states:
            measured.append(state.flexion)
        self._measured = measured if self._in_order else self._by_dof(measured)
        self._alert = self._fingers.alert(states)
        for state in states:
            if state.mode == "safe" and self._controller.machine.state != "safe":
                # A replay repeats it.
                self._event(now, "stop", self._alert)
                reason = f"finger: {self._alert}" if len(states) == 1 else self._alert
                self._apply(self._controller.machine.stop(now, reason))

    def _by_dof(self, values: list[float]) -> list[float]:
        """Return the values of the fingers by freedom; NaN without a finger."""
        placed = list(self._unknown)
        for k, value in zip(self._driven, values, strict=True):
            placed[k] = value
        return placed

    def _apply(self, changes: Changes) -> None:
        """Report state transitions, and make the fingers safe where they say so."""
        for change in changes:
            self.report.transitions.append(change)
            del self.report.transitions[:-1000]
            if change.after == "safe":
                self._stopped, self._refusal = change.reason, ""
                if self._fingers is not None:
                    self._fingers.make_safe(change.reason)
            self._notices.transition(change)
            words = f"{change.before} to {change.after}: {change.reason}"
            self._event(change.time, change.after, words)

    def _notice(self, now: float, sentence: str) -> None:
        self.report.notices.append(sentence)
        del self.report.notices[:-1000]
        self._event(now, "notice", " ".join(sentence.split()))
        if self._on_notice:
            self._on_notice(sentence)

    def _event(self, now: float, name: str, text: str) -> None:
        """Write an event, and pass it on."""
        onset = max(0.0, now)
        if self._session:
            write_event(self._session, onset, name, text)
        if self._listener:
            self._listener.event(self._start + onset, name, text)
