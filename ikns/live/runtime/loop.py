"""The live loop: read a frame, find the pose, command the finger, write a row.

One thread, which waits for nothing but the next frame. It commands the finger at least
every 20 ms, with or without a frame, so the finger notices by itself when the loop
hangs.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.finger import Finger, FingerGroup
from ikns.live.control.controller import Controller, Decision
from ikns.live.control.frame import FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.live.runtime.frame_loop import FrameLoop
from ikns.live.runtime.listener import LoopListener
from ikns.live.runtime.priority import realtime_priority
from ikns.live.runtime.report import LoopStatus, Report
from ikns.live.session import RunWriter
from ikns.live.stream import Source
from ikns.live.stream.subjects import check_one_subject


def run(
    source: Source,
    subject: Subject,
    finger: Finger | FingerGroup | None = None,
    *,
    settings: ControlSettings | None = None,
    session: RunWriter | None = None,
    duration: float = math.inf,
    stop: threading.Event | None = None,
    arm: threading.Event | None = None,
    on_status: Callable[[LoopStatus], None] | None = None,
    status_every: float = 0.2,
    on_decision: Callable[[float, float, Decision], None] | None = None,
    on_notice: Callable[[str], None] | None = None,
    listener: LoopListener | None = None,
    realtime: bool = False,
    exclusive: bool = True,
) -> Report:
    """Drive a finger, or several, with a person's null space until the source ends.

    Parameters
    ----------
    source : Source
        Open, with the markers of the subject's marker set among its labels.
    subject : Subject
        Calibrated.
    finger : Finger or FingerGroup, optional
        Not connected yet. Without a finger everything runs but nothing moves. Several
        stop together: what stops one stops all.
    settings : ControlSettings, optional
        Smoothing, dead band, watchdog, and which degrees of freedom of the map drive a
        finger.
    session : RunWriter, optional
        From :func:`ikns.live.session.open_run` with the labels of the subject's marker
        set; gets one row per frame and is left open.
    duration : float
        Stop after this time, s.
    stop : threading.Event, optional
        Set it to stop and relax the finger.
    arm : threading.Event, optional
        Set it to arm a finger again that is in its safe state, from the measured
        position and from rest; the loop clears it. It has no effect otherwise.
    on_status : callable, optional
        Called with a :class:`LoopStatus` from within the loop, so it must not wait.
    status_every : float
        Time between these calls, s.
    on_decision : callable, optional
        Called after each frame's command with the time of receipt (s, of
        `time.monotonic`), the commanded flexion and the :class:`Decision`; also from
        within the loop.
    on_notice : callable, optional
        Called with a sentence: why the finger has not moved half a second after the
        start; that it is in its safe state, and why; and events of the source. Also
        from within the loop.
    listener : LoopListener, optional
        Receives every frame and every event that the session gets, also from within the
        loop; :func:`ikns.live.publish.open_publisher` opens one that publishes.
    realtime : bool
        Give the loop priority over ordinary programs, where the system allows it.
    exclusive : bool
        Whether the program does nothing else meanwhile, so that Python's garbage
        collector of cycles may be off.

    Returns
    -------
    Report

    Raises
    ------
    InvalidInput
        When the system does not allow real-time priority, the subject was calibrated
        without the method of the settings, or the fingers follow other degrees of
        freedom than the settings name.
    MarkerMismatch
        When the source has none of the subject's markers, or those of several people.
    FingerError
        When the finger cannot be connected.

    Examples
    --------
    A person who holds still, tracked at 100 frames per second, and a simulated finger:

    >>> import ikns
    >>> from ikns.live.stream.replay import Replay
    >>> body = ikns.Skeleton.load()
    >>> points = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    >>> Z, one = np.eye(7)[[1] * 8], np.ones(8)
    >>> learned = ikns.NullSpaceMap.from_arrays(points, Z, 0 * one, one)
    >>> subject = ikns.Subject(body, learned, "right_arm", {})
    >>> markers = np.tile(body.markers_in_world(body.neutral()), (5, 1, 1))
    >>> still = ikns.Recording(np.arange(5) / 100, markers, body.marker_set.labels)
    >>> with Source(Replay(still)) as source:
    ...     run(source, subject, ikns.SimulatedFinger()).frames
    5
    """
    marker_set = subject.skeleton.marker_set
    check_one_subject(source.name, source.labels, marker_set)
    columns = marker_set.columns(source.labels)
    if (columns < 0).all():
        raise MarkerMismatch(
            f"{source.name}: expected markers of the subject such as "
            f"{', '.join(marker_set.labels[:6])}, found "
            f"{', '.join(source.labels[:6])}."
        )
    settings = ControlSettings() if settings is None else settings
    fingers = _group(finger, settings)
    controller, twin = (
        Controller(
            FrameSolver(
                subject.skeleton,
                subject.null_space_map,
                subject.chain,
                readout=subject.readout(settings.method),
                max_uncertainty=settings.max_uncertainty,
            ),
            settings,
        )
        for _ in range(2)
    )
    loop = FrameLoop(
        source, controller, twin, columns, fingers, session, on_notice, listener
    )
    # Compile or load everything before the finger is connected.
    controller.solver.solve(np.full((len(marker_set.labels), 3), np.nan))
    controller.solver.reset()
    stopped = threading.Event() if stop is None else stop
    with (
        realtime_priority(realtime=realtime, exclusive=exclusive),
        connected(fingers),
    ):
        loop.arm()
        try:
            while not (stopped.is_set() or source.ended or loop.elapsed() >= duration):
                if arm is not None and arm.is_set():
                    loop.arm_again()
                    arm.clear()
                frame = source.read(loop.read_timeout())
                if frame is None:
                    if not loop.warm_caches():
                        loop.keep_alive()
                elif loop.is_current(frame):
                    decision = loop.process(frame)
                    if on_decision:
                        received = frame.receive_time
                        on_decision(received, decision.flexion, decision)
                if on_status and loop.status_due(status_every):
                    on_status(loop.status())
        finally:
            loop.disarm("stop requested" if stopped.is_set() else "run ended")
    return loop.report


def _group(
    finger: Finger | FingerGroup | None, settings: ControlSettings
) -> FingerGroup | None:
    """Return the fingers as a group, one for each freedom of the settings."""
    if finger is None:
        return None
    given = finger
    if not isinstance(given, FingerGroup):
        given = FingerGroup([given], settings.dofs[:1])
    if given.dofs != settings.dofs:
        raise InvalidInput(
            f"expected fingers for the dofs of the settings, {settings.dofs}, found "
            f"fingers for {given.dofs}."
        )
    return given


@contextmanager
def connected(fingers: FingerGroup | None) -> Iterator[None]:
    """Connect the fingers, if there are any, and relax them at the end."""
    if fingers is None:
        yield
        return
    with fingers:
        yield
