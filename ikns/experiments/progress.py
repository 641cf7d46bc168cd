"""Where a subject is in a schedule: what counts as done, what is left, which rest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Generic, Protocol, TypeVar

from ikns.errors import InvalidInput

__all__ = ["Progress"]


class _Step(Protocol):
    @property
    def kind(self) -> str: ...
    @property
    def key(self) -> str: ...
    @property
    def seconds(self) -> float: ...


class _Attempt(Protocol):
    @property
    def key(self) -> str: ...
    @property
    def outcome(self) -> str: ...


S = TypeVar("S", bound=_Step)
A = TypeVar("A", bound=_Attempt)


class Progress(Generic[S, A]):
    """Steps and the attempts at them, whatever is done in a step.

    Parameters
    ----------
    steps : sequence
        Of a schedule, with ``kind`` ("rest" or another), ``key`` and ``seconds``.
    attempts : iterable
        Of a visit that was broken off, with ``key`` and ``outcome``, in order.
    final : collection of str
        Outcomes after which a step does not come again.

    Attributes
    ----------
    attempts : list
        Everything that was tried, in order; nothing is ever taken out.
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
        strangers = sorted({a.key for a in self.attempts} - known)
        if strangers:
            raise InvalidInput(
                f"expected attempts at steps of this schedule, found {strangers[0]}."
            )

    @property
    def ended(self) -> dict[str, A]:
        """Last attempt at each step that does not come again, by key."""
        last = {a.key: a for a in self.attempts}
        return {k: a for k, a in last.items() if a.outcome in self._final}

    @property
    def remaining(self) -> tuple[S, ...]:
        """Steps still to do, the current one first."""
        return tuple(self.steps[i] for i in self._left())

    @property
    def current(self) -> S | None:
        """What is to be done now; None when all is."""
        return self.remaining[0] if self.remaining else None

    def to_begin(self, *, going_on: bool) -> S:
        """Step whose trial may begin.

        Raises
        ------
        InvalidInput
            When one goes on, a rest is due, or nothing is left.
        """
        step = self.current
        if going_on or step is None or step.kind == "rest":
            found = "one that goes on" if going_on else "none"
            found = "a rest" if step is not None and step.kind == "rest" else found
            raise InvalidInput(f"expected a trial to begin, found {found}.")
        return step

    def to_repeat(self, *, going_on: bool) -> str:
        """Key of the last step that was finished or skipped.

        Raises
        ------
        InvalidInput
            While a trial goes on, or when none was finished.
        """
        if going_on:
            raise InvalidInput("expected no trial going on, found one: abort it.")
        ended = self.ended
        for attempt in reversed(self.attempts):
            if attempt.key in ended:
                return attempt.key
        raise InvalidInput("expected a step that was done to repeat, found none.")

    def rest(self, now: float) -> float:
        """Time left of the rest that is due, s; 0 when none is, or it is over."""
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
        """Let the rest that is due be over; say whether one was."""
        step = self.current
        if step is None or step.kind != "rest":
            return False
        self._rest_end = None
        self._rested.add(self._left()[0])
        return True

    def _left(self) -> list[int]:
        ended, rested = self.ended, self._rested
        return [
            i
            for i, step in enumerate(self.steps)
            if (i not in rested if step.kind == "rest" else step.key not in ended)
        ]
