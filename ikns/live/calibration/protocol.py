"""The state machine of the protocol: countdowns, recordings and decisions.

It has no screen and no clock: every call passes the time.

    ready -> countdown -> recording -> judging -> verdict -> accepted | redo | skipped
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from ikns.errors import InvalidInput
from ikns.live.calibration.frames import recording_from_frames
from ikns.live.stream import Frame
from ikns.recording.recording import Recording

Key = Literal["next", "redo", "skip", "quit"]
KEYS: tuple[Key, ...] = ("next", "redo", "skip", "quit")
State = Literal[
    "ready", "countdown", "recording", "judging", "verdict", "done", "stopped"
]


@dataclass(frozen=True)
class ProtocolStep:
    """One recording of the protocol.

    Parameters
    ----------
    name : str
        Also the stem of its file name.
    kind : {"static", "free", "natural", "point"}
    seconds : float
        Duration of the recording, s.
    countdown : float
        Time before the recording, s.
    """

    name: str
    kind: Literal["static", "free", "natural", "point"]
    seconds: float
    countdown: float = 3.0


class Change(NamedTuple):
    """A change of a step's state.

    Parameters
    ----------
    time : float
        As passed to the call, s.
    step : ProtocolStep or None
        None at the end.
    what : str
        The new state, or the decision about the step: ``accepted``, ``redo``,
        ``skipped``; ``rejected`` for a key that is not valid in this state.
    """

    time: float
    step: ProtocolStep | None
    what: str


def paper_steps(
    *,
    points: int = 10,
    static_seconds: float = 5.0,
    free_seconds: float = 60.0,
    natural_seconds: float = 0.0,
    point_seconds: float = 5.0,
    countdown: float = 3.0,
) -> tuple[ProtocolStep, ...]:
    """Return the steps of Lisini Baldi et al. (arXiv 2012.03600).

    Ordinary movement for the natural posture comes before the points; of it or of the
    free exploration, 0 s leave one out, not both.

    Raises
    ------
    InvalidInput
        When a number is out of its range.

    Examples
    --------
    >>> [step.name for step in paper_steps(points=2, natural_seconds=20)]
    ['static', 'free', 'natural', 'point_01', 'point_02']
    """
    if not 1 <= points <= 99:
        raise InvalidInput(f"expected 1 to 99 points, found {points}.")
    movement: list[tuple[Literal["free", "natural"], float]] = [
        ("free", free_seconds),
        ("natural", natural_seconds),
    ]
    asked = [(kind, seconds) for kind, seconds in movement if seconds != 0]
    if not asked:
        raise InvalidInput(
            "expected free exploration or ordinary movement, found 0 s of both."
        )
    for seconds in (static_seconds, point_seconds, *(s for _, s in asked)):
        if not 0 < seconds <= 3600:
            raise InvalidInput(
                f"expected steps of above 0 s to 3600 s, found {seconds:g} s."
            )
    if not 0 <= countdown <= 3600:
        raise InvalidInput(
            f"expected a countdown of 0 s to 3600 s, found {countdown:g} s."
        )
    return (
        ProtocolStep("static", "static", static_seconds, countdown),
        *(ProtocolStep(kind, kind, seconds, countdown) for kind, seconds in asked),
        *(
            ProtocolStep(f"point_{k:02d}", "point", point_seconds, countdown)
            for k in range(1, points + 1)
        ),
    )


class LiveProtocol:
    """The protocol of a live calibration.

    Parameters
    ----------
    steps : sequence of ProtocolStep
    labels : sequence of M str
        Markers of the frames.
    rate : float
        Frames per second of the device's clock.
    auto_takes : int
        0: keys decide. Otherwise verdicts decide without keys: a step gets at most
        this many takes, and what no verdict keeps is skipped.
    accepted : collection of str
        Names of steps accepted before.
    pending : mapping of str to Recording
        Recordings of steps without a decision.

    Attributes
    ----------
    state : str
    step : ProtocolStep or None
        The present step; None at the end.
    take : Recording or None
        Its recording; None with fewer than two frames.
    kept : bool
        Whether the take was pending, hence is on disk already.
    skipped : list of str
    seconds_left : float
        Time left of the countdown or the recording, s.
    """

    def __init__(
        self,
        steps: Sequence[ProtocolStep],
        *,
        labels: Sequence[str],
        rate: float,
        auto_takes: int = 0,
        accepted: Collection[str] = (),
        pending: Mapping[str, Recording] | None = None,
    ) -> None:
        self.auto = auto_takes > 0
        self.state: State = "ready"
        self.take: Recording | None = None
        self.kept = self._usable = False
        self.skipped: list[str] = []
        self.seconds_left = 0.0
        self._left = [step for step in steps if step.name not in accepted]
        self._pending = dict(pending or {})
        self._labels, self._rate = tuple(labels), rate
        self._auto_takes, self._takes = auto_takes, 0
        self._frames: list[Frame] = []
        self._since = 0.0

    @property
    def step(self) -> ProtocolStep | None:
        """The present step."""
        return self._left[0] if self._left else None

    @property
    def waiting(self) -> bool:
        """Whether it waits for a key."""
        return self.state in ("ready", "verdict") and not self.auto

    @property
    def over(self) -> bool:
        """Whether the protocol has ended."""
        return self.state in ("done", "stopped")

    def begin(self, now: float) -> list[Change]:
        """Start the first step."""
        return self._start_step(now)

    def tick(self, now: float) -> list[Change]:
        """Let time pass without a frame."""
        # A frame counts as on time when it is less than half a period early.
        half = 0.5 / self._rate
        if self.state == "countdown":
            self.seconds_left = self._since + self._present.countdown - now
            if self.seconds_left <= half:
                self._frames, self._since = [], now
                self.seconds_left = self._present.seconds
                return [self._change_state("recording", now)]
        elif self.state == "recording":
            self.seconds_left = self._since + self._present.seconds - now
            if self.seconds_left <= half:
                return self._finish(now)
        return []

    def frame(self, frame: Frame, now: float) -> list[Change]:
        """Process the next frame."""
        changes = self.tick(now)
        if self.state == "recording":
            self._frames.append(frame)
            # The last frame of a step is one period before its end.
            if self.seconds_left <= 1.5 / self._rate:
                changes += self._finish(now)
        return changes

    def judged(self, *, keep: bool, usable: bool, now: float) -> list[Change]:
        """Take the verdict on the step just recorded."""
        self._usable = usable
        changes = [self._change_state("verdict", now)]
        if not self.auto:
            return changes
        last = self._takes >= self._auto_takes
        if keep:
            return changes + self._decide("accepted", now)
        if not last:
            return changes + self._retry(now)
        if self._present.kind == "static":
            self.state = "stopped"
            return [*changes, Change(now, self.step, "stopped")]
        return changes + self._decide("skipped", now)

    def key(self, key: Key, now: float) -> list[Change]:
        """Handle a key of the experimenter.

        A recording that a calibration cannot use cannot be accepted, and the static
        trial cannot be skipped.
        """
        if self.over or self.state == "judging":
            return []
        if key == "quit":
            return [self._change_state("stopped", now)]
        if key == "next" and self.state == "ready":
            return self._start_countdown(now)
        if key == "next" and self.state == "verdict" and self._usable:
            return self._decide("accepted", now)
        if key == "redo" and self.state != "ready":
            return self._retry(now)
        if key == "skip" and self._present.kind != "static":
            return self._decide("skipped", now)
        return [Change(now, self.step, "rejected")]

    @property
    def _present(self) -> ProtocolStep:
        assert self._left
        return self._left[0]

    def _change_state(self, state: State, now: float) -> Change:
        self.state = state
        return Change(now, self.step, state)

    def _start_step(self, now: float) -> list[Change]:
        self.take, self._frames, self._takes = None, [], 0
        self.kept = self._usable = False
        if not self._left:
            return [self._change_state("done", now)]
        if self._present.name in self._pending:
            self.take, self._takes = self._pending.pop(self._present.name), 1
            self.kept = True
            return [self._change_state("judging", now)]
        return [self._change_state("ready", now)] + (
            self._start_countdown(now) if self.auto else []
        )

    def _start_countdown(self, now: float) -> list[Change]:
        self._since, self.seconds_left = now, self._present.countdown
        return [self._change_state("countdown", now)]

    def _finish(self, now: float) -> list[Change]:
        self.take = recording_from_frames(
            self._frames, self._labels, self._rate, self._present.name
        )
        self._frames = []
        self._takes += 1
        return [self._change_state("judging", now)]

    def _retry(self, now: float) -> list[Change]:
        self.take, self._frames = None, []
        self.kept = self._usable = False
        changes = [Change(now, self.step, "redo"), self._change_state("ready", now)]
        return changes + (self._start_countdown(now) if self.auto else [])

    def _decide(self, what: Literal["accepted", "skipped"], now: float) -> list[Change]:
        change = Change(now, self.step, what)
        if what == "skipped":
            self.skipped.append(self._present.name)
        del self._left[0]
        return [change, *self._start_step(now)]
