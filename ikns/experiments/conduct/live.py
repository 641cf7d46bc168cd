"""The live loop as a source of the control signal, in a thread of its own."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

from ikns.calibration.subject import Subject
from ikns.errors import IknsError
from ikns.experiments.conduct.inputs import Sample, SampleQueue
from ikns.experiments.conduct.measured import recent_values
from ikns.finger import Finger, FingerGroup
from ikns.live.control.controller import Decision
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime import LoopStatus, Report, run
from ikns.live.runtime.listener import LoopListener
from ikns.live.session import RunWriter
from ikns.live.stream import Source

#: How often the loop reports its status, s.
_STATUS_EVERY = 1 / 30
#: Frames are counted this long for a frame rate, s.
_RATE_INTERVAL = 1.0

#: Words for the operator; "safe" would be read as "nothing is wrong".
_WORDS = {"safe": "stopped"}


class LiveDriver:
    """A running live loop.

    Parameters
    ----------
    finger : Finger, FingerGroup or None
        Of several, the first one's signal is what the experiment reads.
    writer : RunWriter or None
        Session, which events are written to as well.
    smooth : bool
        Whether the signal is the smoothed flexion command of the finger; else the raw c
        of the map.
    on_status : callable, optional
        Called from the loop with each status.

    Attributes
    ----------
    fault : str
        Why it has ended; empty while it runs.
    report : Report or None
        Once it has ended.
    """

    def __init__(
        self,
        finger: Finger | FingerGroup | None,
        writer: RunWriter | None,
        *,
        smooth: bool = False,
        on_status: Callable[[LoopStatus], None] | None = None,
    ) -> None:
        self.fault = ""
        self.report: Report | None = None
        self._finger, self._writer, self._smooth = finger, writer, smooth
        self._on_status = on_status
        self._samples = SampleQueue()
        self._status: LoopStatus | None = None
        self._signal = 0  # which freedom the experiment reads
        self._finger_state = self._stopped = ""
        self._status_at = self._frame_at = self._finger_at = math.nan
        self._start = math.nan
        self._events: list[tuple[str, str, float]] = []
        self._rate, self._counted_at, self._frames = math.nan, math.nan, 0
        self._stop, self._arm = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None

    def begin(
        self,
        source: Source,
        subject: Subject,
        settings: ControlSettings,
        *,
        listener: LoopListener | None = None,
        realtime: bool = False,
    ) -> None:
        """Start the loop."""
        self._signal = settings.dofs[0] - 1

        def loop() -> None:
            try:
                self.report = run(
                    source,
                    subject,
                    self._finger,
                    settings=settings,
                    session=self._writer,
                    stop=self._stop,
                    arm=self._arm,
                    on_status=self._take_status,
                    status_every=_STATUS_EVERY,
                    on_decision=self._take_decision,
                    listener=listener,
                    realtime=realtime,
                )
            except (IknsError, OSError) as error:
                self.fault = str(error)
            else:
                # A requested stop is no fault.
                ended = f"{source.name} has ended."
                self.fault = "" if self._stop.is_set() else ended
            finally:  # whatever failed, the visit must not wait for frames
                if self.report is None and not self.fault:
                    self.fault = "the live loop failed."

        self._thread = threading.Thread(target=loop, name="ikns loop", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop the loop, which relaxes the finger, and wait until that is done."""
        self.halt()
        if self._thread is not None:
            self._thread.join()

    def halt(self) -> None:
        """Stop the loop at its next cycle, within 20 ms."""
        self._stop.set()

    def arm(self) -> None:
        """Arm a finger again that is in its safe state."""
        self._arm.set()

    def take(self, now: float) -> list[Sample]:
        """Return the samples since the last call, at the times of receipt."""
        return self._samples.take(now)

    def status(self) -> dict[str, Any]:
        """Return the state of loop and finger.

        See :func:`ikns.experiments.conduct.measured.recent_values` for their age.
        """
        status, now = self._status, time.monotonic()
        if status is None:
            return {"kind": "ikns"}
        session = {}
        if self._writer is not None:
            session = {"session": self._writer.fault, "lost_rows": self._writer.lost}
        loop = {
            "state": _WORDS.get(status.state, status.state),
            "flexion": status.flexion,
            "rate": self._rate,
            "latency": status.latency,
            "misses": status.misses,
        }
        for axis in status.axes[1:]:
            loop[f"c_{axis.dof}"] = axis.c
            loop[f"flexion_{axis.dof}"] = axis.flexion
            loop[f"measured_{axis.dof}"] = axis.measured
        finger = {"finger": self._finger_state, "measured": status.measured}
        pose = {
            "residual": status.residual,
            "worst_residual": status.worst_residual,
            "refused": status.rejection,
            "inside": status.inside,
        }
        measured_at = self._status_at if self._finger is None else self._finger_at
        known = {"kind": "ikns", "stopped": self._stopped} | session
        if len(status.axes) > 1:
            known["dof"] = status.axes[0].dof  # that of c, flexion and measured
        return known | recent_values(
            (loop, now - self._status_at),
            (finger, now - measured_at),
            (pose, now - self._frame_at),
        )

    def log_event(self, name: str, text: str, now: float) -> None:
        """Write an event into the session."""
        self._events.append((name, text, now))
        # The start of the session's time is known from the first status on.
        while self._writer is not None and self._events and self._start < math.inf:
            event, words, at = self._events.pop(0)
            onset = max(0.0, at - self._start)
            self._writer.row("events", [onset, 0.0, event, words])

    def _take_decision(
        self, received: float, flexion: float, decision: Decision
    ) -> None:
        self._frame_at = received
        c = flexion if self._smooth else float(decision.solved.c[self._signal])
        self._samples.put(Sample(received, c if decision.valid else math.nan))

    def _take_status(self, status: LoopStatus) -> None:
        now = time.monotonic()
        if math.isnan(self._start):
            self._start = now - status.time
        if not now - self._counted_at < _RATE_INTERVAL:
            passed = now - self._counted_at
            self._rate = (status.frames - self._frames) / passed
            self._counted_at, self._frames = now, status.frames
        if self._finger is not None:
            state = self._finger.state()
            self._finger_at = now - state.age
            mode = _WORDS.get(state.mode, state.mode)
            self._finger_state = f"{mode}: {state.alert}" if state.alert else mode
            stopped = state.mode == "safe"
            self._stopped = (state.alert or "no reason is known") if stopped else ""
        if status.state == "safe" and not self._stopped:
            reason = status.rejection or "poses stopped coming"
            self._stopped = f"the control loop stopped: {reason}"
        self._status, self._status_at = status, now
        if self._on_status:
            self._on_status(status)


@contextmanager
def live_driver(
    open_source: Callable[[], AbstractContextManager[Source]],
    subject: Subject,
    *,
    finger: Callable[[], Finger | FingerGroup] | None = None,
    open_session: Callable[[Source], AbstractContextManager[RunWriter]] | None = None,
    settings: ControlSettings | None = None,
    smooth: bool = False,
    on_status: Callable[[LoopStatus], None] | None = None,
    listener: LoopListener | None = None,
    realtime: bool = False,
) -> Iterator[LiveDriver]:
    """Run the live loop while the context is open.

    Parameters
    ----------
    open_source : callable
        Opens the source of marker frames.
    subject : Subject
    finger : callable, optional
        Makes the finger, or several; without it nothing moves.
    open_session : callable, optional
        Opens the next run of a session for a source.
    settings : ControlSettings, optional
        Of the controller.
    smooth : bool
        See :class:`LiveDriver`.
    on_status : callable, optional
        Called from the loop about 30 times per second; it must not block.
    listener : LoopListener, optional
        Hears of every frame and event of the loop.
    realtime : bool
        See :func:`ikns.live.runtime.run`.
    """
    with ExitStack() as stack:
        source = stack.enter_context(open_source())
        writer = stack.enter_context(open_session(source)) if open_session else None
        driver = LiveDriver(
            finger() if finger else None, writer, smooth=smooth, on_status=on_status
        )
        stack.callback(driver.end)
        driver.begin(
            source,
            subject,
            ControlSettings() if settings is None else settings,
            listener=listener,
            realtime=realtime,
        )
        yield driver
