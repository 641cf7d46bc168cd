"""Run the calibration protocol: from a source of frames to accepted recordings.

Time is the device's clock while frames come, so a recording played at full speed passes
through the protocol as the person did; without frames it is this machine's clock.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ikns.body.chains import ChainLike
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration import sight_needs
from ikns.calibration.judge.finding import refused
from ikns.calibration.judge.labels import judge_labels
from ikns.errors import MarkerMismatch, NotEnoughData, StreamError
from ikns.live.calibration.clock import DeviceClock
from ikns.live.calibration.folder import RecordingsFolder
from ikns.live.calibration.guidance import CalibrationStatus, Guidance
from ikns.live.calibration.judge import Judge
from ikns.live.calibration.protocol import Change, Key, LiveProtocol, ProtocolStep
from ikns.live.calibration.verdict import Verdict
from ikns.live.stream import Frame, Source
from ikns.live.stream.subjects import check_one_subject
from ikns.recording.files import read

#: Called with a change, the verdict if there is one, and the direction of the target.
OnChange = Callable[[Change, Verdict | None, str], None]

#: Seconds to wait for a frame before reading the keys again.
_WAIT = 0.05


def check_labels(
    source: Source, marker_set: str, chain: ChainLike, *, generic: Skeleton
) -> None:
    """Check that the source has every marker of the thorax and of the chain.

    Static-only markers and those of an arm outside the chain may be missing.

    Raises
    ------
    MarkerMismatch
        With the labels that are missing, or when they are those of several people.
    """
    moving = MarkerSet.load(marker_set).without_static()
    check_one_subject(source.name, source.labels, moving)
    needed = sorted(
        column
        for own, _ in sight_needs(generic.with_nominal_markers(moving), chain).values()
        for column in own
    )
    columns = moving.columns(source.labels)
    missing = [moving.labels[i] for i in needed if columns[i] < 0]
    if missing:
        others = judge_labels(source.name, source.labels, moving, calibrated=False)
        if faults := refused(others):
            raise MarkerMismatch(faults[0].sentence)
        raise MarkerMismatch(
            f"{source.name}: expected markers {', '.join(missing)} of {moving.name}, "
            f"found only {', '.join(source.labels)}."
        )


def restore(
    judge: Judge, folder: RecordingsFolder, steps: Sequence[ProtocolStep]
) -> None:
    """Restore the judge's state from the recordings accepted before."""
    accepted = folder.accepted
    for step in steps:
        if step.name in accepted:
            judge.accept(step, judge.judge(step, read(accepted[step.name])))


def accepted_recordings(
    folder: RecordingsFolder, steps: Sequence[ProtocolStep]
) -> tuple[Path, list[Path]]:
    """Return the static trial and the points to calibrate from.

    Raises
    ------
    NotEnoughData
        When there is no static trial, or there are fewer points than a map needs: 4, or
        all of them if fewer were requested.
    """
    accepted = folder.accepted
    static = [s for s in steps if s.kind == "static" and s.name in accepted]
    asked = [s for s in steps if s.kind == "point"]
    points = [s for s in asked if s.name in accepted]
    need = min(4, len(asked))
    if not static or len(points) < need:
        raise NotEnoughData(
            f"{folder.path}: expected an accepted static trial and at least {need} "
            f"accepted points, found {'a' if static else 'no'} static trial and "
            f"{len(points)} of {len(asked)} points; the recordings are kept; "
            "continue with --resume."
        )
    return accepted[static[0].name], [accepted[step.name] for step in points]


def accepted_movement(
    folder: RecordingsFolder, steps: Sequence[ProtocolStep]
) -> list[Path]:
    """Return accepted free exploration and ordinary movement, for natural posture."""
    accepted, kinds = folder.accepted, ("free", "natural")
    return [accepted[s.name] for s in steps if s.kind in kinds and s.name in accepted]


def run_protocol(
    source: Source,
    protocol: LiveProtocol,
    judge: Judge,
    folder: RecordingsFolder,
    *,
    n_points: int,
    keys: Callable[[bool], Sequence[Key]] = lambda waiting: (),
    on_change: OnChange = lambda change, verdict, where: None,
    on_status: Callable[[CalibrationStatus], None] | None = None,
    status_every: float = 0.1,
    read_timeout: float = 10.0,
) -> None:
    """Run the protocol until it is done or stopped.

    Parameters
    ----------
    source : Source
    protocol : LiveProtocol
        Not started yet.
    judge : Judge
        Restored from earlier recordings, see :func:`restore`.
    folder : RecordingsFolder
    n_points : int
        Number of points, for the suggested positions.
    keys : callable
        Called with whether the protocol waits for a key; returns the keys pressed.
    on_change : callable
        Called with every change, the verdict if there is one, and the direction of the
        target in words.
    on_status : callable, optional
        Called with a :class:`CalibrationStatus` about every `status_every` seconds.
    read_timeout : float
        Without keys, an error is raised after this time without a frame, s.

    Raises
    ------
    StreamError
        When the source ends, or sends no frames and there are no keys.
    """
    _Run(source, protocol, judge, folder, n_points, on_change).go(
        keys, on_status, status_every, read_timeout
    )


class _Run:
    """State of one run of the protocol."""

    def __init__(
        self,
        source: Source,
        protocol: LiveProtocol,
        judge: Judge,
        folder: RecordingsFolder,
        n_points: int,
        on_change: OnChange,
    ) -> None:
        self._source, self._protocol = source, protocol
        self._judge, self._folder, self._n_points = judge, folder, n_points
        self._on_change = on_change
        self._verdict: Verdict | None = None
        self._clock = DeviceClock()
        self._frame: Frame | None = None
        self._guidance = Guidance(source, judge, n_points)

    def go(
        self,
        keys: Callable[[bool], Sequence[Key]],
        on_status: Callable[[CalibrationStatus], None] | None,
        status_every: float,
        read_timeout: float,
    ) -> None:
        protocol, source = self._protocol, self._source
        source.skip()
        self._handle(protocol.begin(0.0))
        shown = -math.inf
        while not protocol.over:
            while not protocol.over and (pressed := keys(protocol.waiting)):
                for key in pressed:
                    self._handle(protocol.key(key, self._clock.now))
            if protocol.over:
                break
            frame = source.read(_WAIT)
            self._clock.advance(frame)
            if frame is not None:
                self._frame = frame
                self._handle(protocol.frame(frame, self._clock.now))
            else:
                self._handle(protocol.tick(self._clock.now))
                self._check_silence(read_timeout)
            if on_status and not protocol.over:
                if time.monotonic() - shown >= status_every:
                    shown = time.monotonic()
                    silence = self._clock.silence
                    on_status(self._guidance.status(protocol, self._frame, silence))

    def _check_silence(self, read_timeout: float) -> None:
        protocol, source = self._protocol, self._source
        step = protocol.step.name if protocol.step else "the end"
        if source.ended and not protocol.waiting and not protocol.over:
            raise StreamError(
                f"{source.name}: ended at {step}; recordings so far are "
                f"in {self._folder.path}; continue with --resume."
            )
        if protocol.auto and self._clock.silence > read_timeout:
            raise StreamError(
                f"{source.name}: no frame for {read_timeout:g} s at {step}; "
                f"recordings so far are in {self._folder.path}; continue with --resume."
            )
        if source.ended:
            time.sleep(_WAIT)

    def _handle(self, changes: list[Change]) -> None:
        while changes:
            change, *changes = changes
            step = change.step
            if step is not None and change.what in ("accepted", "redo", "skipped"):
                if self._verdict is not None:
                    if change.what == "accepted":
                        self._judge.accept(step, self._verdict)
                    self._folder.decide(step, change.what, self._verdict)
            if change.what == "stopped":
                self._verdict = None
            self._on_change(change, self._verdict, self._guidance.direction(step))
            if change.what in ("accepted", "redo", "skipped"):
                self._verdict = None
            if change.what == "judging":
                changes += self._judge_take(change)

    def _judge_take(self, change: Change) -> list[Change]:
        """Write the take, then judge it, so that a failing judge loses nothing."""
        protocol, step = self._protocol, change.step
        assert step is not None
        take = protocol.take
        if take is not None and not protocol.kept:
            take = self._folder.keep(step, take)
        verdict = self._judge.judge(step, take)
        self._verdict = verdict
        return protocol.judged(
            keep=verdict.keep, usable=verdict.usable, now=change.time
        )
