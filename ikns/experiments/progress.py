"""Progress of a subject through a schedule: done, remaining, and the current rest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Generic, Protocol, TypeVar

from ikns.errors import InvalidInput


class _Step(Protocol):
    @property
    def kind(self) -> str: ...
    @property
    def key(self) -> str: ...
    @property
    def seconds(self) -> float: ...


class _TimedAttempt(Protocol):
    @property
    def key(self) -> str: ...
    @property
    def outcome(self) -> str: ...


S = TypeVar("S", bound=_Step)
A = TypeVar("A", bound=_TimedAttempt)


class Progress(Generic[S, A]):
    """Steps of a schedule and the attempts at them.

    Parameters
    ----------
    steps : sequence
        With ``kind`` ("rest" or another), ``key`` and ``seconds``.
    attempts : iterable
        Of earlier runs of the visit, with ``key`` and ``outcome``, in order.
    final : collection of str
        Outcomes after which a step is not repeated.

    Attributes
    ----------
    attempts : list
        All attempts in order; none is ever removed.
    """

    def __init__(
        self, steps: Sequence[S], attempts: Iterable[A], *, final: Collection[str]
    ) -> None:
        self.steps, self.attempts = tuple(steps), list(attempts)
        self._final = frozenset(final)
        self._rest_end: float | None = None
        self._rested = {
            i
            for i, step in enumerate(self.steps)
            if step.kind == "rest" and any(s.key in self.ended for s in self.steps[i:])
        }
        known = {step.key for step in self.steps}
        unknown = sorted({a.key for a in self.attempts} - known)
        if unknown:
            raise InvalidInput(
                f"expected attempts at steps of this schedule, found {unknown[0]}."
            )

    @property
    def ended(self) -> dict[str, A]:
        """Final attempt at each step that has one, by key."""
        last = {a.key: a for a in self.attempts}
        return {k: a for k, a in last.items() if a.outcome in self._final}

    @property
    def remaining(self) -> tuple[S, ...]:
        """Steps still to do, the current one first."""
        return tuple(self.steps[i] for i in self._indices_left())

    @property
    def current(self) -> S | None:
        """Current step; None when all are done."""
        return self.remaining[0] if self.remaining else None

    def next_trial(self, *, running: bool) -> S:
        """Return the step whose trial can begin.

        Raises
        ------
        InvalidInput
            When a trial is running, a rest is due, or nothing is left.
        """
        step = self.current
        if step is None:
            raise InvalidInput("all trials are done; none is left to begin.")
        if step.kind == "rest":
            raise InvalidInput("a rest is running; skip it to begin a trial.")
        if running:
            raise InvalidInput("a trial is already running.")
        return step

    def key_to_repeat(self, *, running: bool) -> str:
        """Return the key of the last step that was finished or skipped.

        Raises
        ------
        InvalidInput
            While a trial is running, or when none was finished.
        """
        if running:
            raise InvalidInput("a trial is running; abort it to repeat an earlier one.")
        ended = self.ended
        for attempt in reversed(self.attempts):
            if attempt.key in ended:
                return attempt.key
        raise InvalidInput("no step is finished yet, so none can be repeated.")

    def rest(self, now: float) -> float:
        """Return the time left of the current rest, s; 0 without one or at its end."""
        step = self.current
        if step is None or step.kind != "rest":
            return 0.0
        if self._rest_end is None:
            self._rest_end = now + step.seconds
        left = self._rest_end - now
        if left <= 0:
            self.end_rest()
        return max(0.0, left)

    def end_rest(self) -> bool:
        """End the current rest; say whether there was one."""
        step = self.current
        if step is None or step.kind != "rest":
            return False
        self._rest_end = None
        self._rested.add(self._indices_left()[0])
        return True

    def _indices_left(self) -> list[int]:
        ended, rested = self.ended, self._rested
        return [
            i
            for i, step in enumerate(self.steps)
            if (i not in rested if step.kind == "rest" else step.key not in ended)
        ]
