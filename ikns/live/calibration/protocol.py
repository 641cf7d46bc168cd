"""The order of steps: prompts, countdowns, recordings and what becomes of them.

Nothing here looks at a screen or a clock: every call says what time it is.

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

__all__ = [
    "KEYS",
    "Change",
    "Key",
    "LiveProtocol",
    "State",
    "ProtocolStep",
    "paper_steps",
]

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
        Also the name of its file.
    kind : {"static", "free", "point"}
    seconds : float
        How long it is recorded.
    countdown : float
        Seconds before the recording.
    """

    name: str
    kind: Literal["static", "free", "point"]
    seconds: float
    countdown: float = 3.0


class Change(NamedTuple):
    """What happened to a step, and when.

    Parameters
    ----------
    time : float
        As told to the call, s.
    step : ProtocolStep or None
        None at the end.
    what : str
        The new state, or what became of the step: ``accepted``, ``redo``, ``skipped``;
        ``refused`` for a key that means nothing here.
    """

    time: float
    step: ProtocolStep | None
    what: str


def paper_steps(
    *,
    points: int = 10,
    static_seconds: float = 5.0,
    free_seconds: float = 60.0,
    point_seconds: float = 5.0,
    countdown: float = 3.0,
) -> tuple[ProtocolStep, ...]:
    """Return the steps of Lisini Baldi et al. (arXiv 2012.03600).

    Raises
    ------
    InvalidInput
        When a number is out of its range.

    Examples
    --------
    >>> [step.name for step in paper_steps(points=2)]
    ['static', 'free', 'point_01', 'point_02']
    """
    if not 1 <= points <= 99:
        raise InvalidInput(f"expected 1 to 99 points, found {points}.")
    for seconds in (static_seconds, free_seconds, point_seconds):
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
        ProtocolStep("free", "free", free_seconds, countdown),
        *(
            ProtocolStep(f"point_{k:02d}", "point", point_seconds, countdown)
            for k in range(1, points + 1)
        ),
    )


class LiveProtocol:
    """Where a calibration stands.

    Parameters
    ----------
    steps : sequence of ProtocolStep
    labels : sequence of M str
        Markers of the frames.
    rate : float
        Frames per second of the device's clock.
    auto_takes : int
        0: a key decides everything. Otherwise nothing waits for a key, verdicts are
        followed, and a step gets at most this many takes.
    settled : collection of str
        Names of steps that were accepted before.
    pending : mapping of str to Recording
        Recordings of steps on which nobody decided yet.

    Attributes
    ----------
    state : str
    step : ProtocolStep or None
        The present one; None once there is none left.
    take : Recording or None
        What was recorded of it, None with fewer than two frames.
    kept : bool
        Whether the take was pending, so it is on disk already.
    skipped : list of str
    seconds_left : float
        Of the countdown or the recording.
    """

    def __init__(
        self,
        steps: Sequence[ProtocolStep],
        *,
        labels: Sequence[str],
        rate: float,
        auto_takes: int = 0,
        settled: Collection[str] = (),
        pending: Mapping[str, Recording] | None = None,
    ) -> None:
        self.auto = auto_takes > 0
        self.state: State = "ready"
        self.take: Recording | None = None
        self.kept = self._usable = False
        self.skipped: list[str] = []
        self.seconds_left = 0.0
        self._left = [step for step in steps if step.name not in settled]
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
        """Whether it goes on only with a key."""
        return self.state in ("ready", "verdict") and not self.auto

    @property
    def over(self) -> bool:
        """Whether nothing more will happen."""
        return self.state in ("done", "stopped")

    def begin(self, now: float) -> list[Change]:
        """Start with the first step."""
        return self._enter(now)

    def tick(self, now: float) -> list[Change]:
        """Let time pass without a frame."""
        # A frame counts as on time when it is less than half a period early.
        half = 0.5 / self._rate
        if self.state == "countdown":
            self.seconds_left = self._since + self._present.countdown - now
            if self.seconds_left <= half:
                self._frames, self._since = [], now
                self.seconds_left = self._present.seconds
                return [self._to("recording", now)]
        elif self.state == "recording":
            self.seconds_left = self._since + self._present.seconds - now
            if self.seconds_left <= half:
                return self._finish(now)
        return []

    def frame(self, frame: Frame, now: float) -> list[Change]:
        """Take the next frame."""
        changes = self.tick(now)
        if self.state == "recording":
            self._frames.append(frame)
            # The last frame of a step lies one period before its end.
            if self.seconds_left <= 1.5 / self._rate:
                changes += self._finish(now)
        return changes

    def judged(self, *, keep: bool, usable: bool, now: float) -> list[Change]:
        """Hear the verdict on the step just recorded."""
        self._usable = usable
        changes = [self._to("verdict", now)]
        if not self.auto:
            return changes
        last = self._takes >= self._auto_takes
        if keep or (last and usable):
            return changes + self._settle("accepted", now)
        if not last:
            return changes + self._again(now)
        if self._present.kind == "static":
            self.state = "stopped"
            return [*changes, Change(now, self.step, "stopped")]
        return changes + self._settle("skipped", now)

    def key(self, key: Key, now: float) -> list[Change]:
        """Hear what the experimenter wants.

        What a calibration cannot use cannot be accepted, and nothing goes without the
        static trial.
        """
        if self.over or self.state == "judging":
            return []
        if key == "quit":
            return [self._to("stopped", now)]
        if key == "next" and self.state == "ready":
            return self._count(now)
        if key == "next" and self.state == "verdict" and self._usable:
            return self._settle("accepted", now)
        if key == "redo" and self.state != "ready":
            return self._again(now)
        if key == "skip" and self._present.kind != "static":
            return self._settle("skipped", now)
        return [Change(now, self.step, "refused")]

    @property
    def _present(self) -> ProtocolStep:
        assert self._left
        return self._left[0]

    def _to(self, state: State, now: float) -> Change:
        self.state = state
        return Change(now, self.step, state)

    def _enter(self, now: float) -> list[Change]:
        self.take, self._frames, self._takes = None, [], 0
        self.kept = self._usable = False
        if not self._left:
            return [self._to("done", now)]
        if self._present.name in self._pending:
            self.take, self._takes = self._pending.pop(self._present.name), 1
            self.kept = True
            return [self._to("judging", now)]
        return [self._to("ready", now)] + (self._count(now) if self.auto else [])

    def _count(self, now: float) -> list[Change]:
        self._since, self.seconds_left = now, self._present.countdown
        return [self._to("countdown", now)]

    def _finish(self, now: float) -> list[Change]:
        self.take = recording_from_frames(
            self._frames, self._labels, self._rate, self._present.name
        )
        self._frames = []
        self._takes += 1
        return [self._to("judging", now)]

    def _again(self, now: float) -> list[Change]:
        self.take, self._frames = None, []
        self.kept = self._usable = False
        changes = [Change(now, self.step, "redo"), self._to("ready", now)]
        return changes + (self._count(now) if self.auto else [])

    def _settle(self, what: Literal["accepted", "skipped"], now: float) -> list[Change]:
        change = Change(now, self.step, what)
        if what == "skipped":
            self.skipped.append(self._present.name)
        del self._left[0]
        return [change, *self._enter(now)]
