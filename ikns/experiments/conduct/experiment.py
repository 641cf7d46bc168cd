"""What is asked of a conductor, and what it has to know of an experiment."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

__all__ = ["COMMANDS", "Command", "Desk"]

#: What may be asked in every experiment. The participant's page came or left; what
#: makes the signal is to be opened once more; the run is to end.
COMMANDS = frozenset(
    "begin abort skip repeat rest pause connect emergency end came left".split()
)


class Command(NamedTuple):
    """Something that somebody asks.

    Parameters
    ----------
    name : str
        One of :data:`COMMANDS`, or of the experiment's own.
    text : str
        Reason or comment.
    """

    name: str
    text: str = ""


class Desk(Protocol):
    """An experiment, as far as it differs from the others.

    Attributes
    ----------
    experiment : str
    commands : frozenset of str
        What may be asked beyond :data:`COMMANDS`.
    needs_signal : bool
        Whether a trial makes sense only with a control signal.
    visit : Visit or PickVisit
    """

    experiment: str
    commands: frozenset[str]
    needs_signal: bool
    visit: Any

    def begin(self, now: float) -> None:
        """Begin the current trial."""

    def frame(self, now: float, c: float) -> None:
        """Take a control signal."""

    def check(self, now: float) -> None:
        """Let time pass; put down a trial that has ended."""

    def abort(self, now: float, reason: str) -> None:
        """Break the trial off that goes on; it comes again."""

    def skip(self, now: float, reason: str) -> None:
        """Leave the current step out."""

    def ask(self, name: str, text: str, now: float) -> None:
        """Do one of its own commands."""

    def state(self) -> str:
        """Return that of the trial that goes on; empty without one."""

    def view(self, now: float) -> dict[str, Any]:
        """Return what screens show of the trial that goes on."""

    def prompt(self, state: str) -> str:
        """Return what the participant is told in a state of a trial."""

    def curve(self) -> dict[str, Any]:
        """Return what is drawn once per trial."""

    def facts(self, step: Any) -> dict[str, Any]:
        """Return what the panel says of a step."""

    def row(self, number: int, attempt: Any, *, practised: int) -> dict[str, Any]:
        """Return an attempt as it goes to disk."""

    def result(self, attempt: Any) -> dict[str, float]:
        """Return the figures of an attempt."""
