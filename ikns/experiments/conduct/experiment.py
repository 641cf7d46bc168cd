"""Commands to a conductor, and what it needs to know of an experiment."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

#: Commands of every experiment. The server itself sends ``page_connected`` and
#: ``page_disconnected``; ``connect`` lets a stopped finger follow again, and opens the
#: source of the signal again if that is gone.
COMMANDS = frozenset(
    "begin abort skip repeat rest pause connect emergency end".split()
) | {"page_connected", "page_disconnected"}


class Command(NamedTuple):
    """A command of a page, or of the server.

    Parameters
    ----------
    name : str
        One of :data:`COMMANDS`, or of the experiment's own.
    text : str
        Reason or comment.
    """

    name: str
    text: str = ""


class Experiment(Protocol):
    """An experiment while it is conducted: what differs from one to the other.

    Attributes
    ----------
    name : {"tracking", "picking"}
    commands : frozenset of str
        Commands beyond :data:`COMMANDS`.
    needs_signal : bool
        Whether a trial needs a control signal.
    visit : Visit or PickVisit
    """

    name: str
    commands: frozenset[str]
    needs_signal: bool
    visit: Any

    def begin(self, now: float) -> None:
        """Begin the current trial."""

    def add_sample(self, now: float, c: float) -> None:
        """Take the control signal at a time."""

    def update(self, now: float) -> None:
        """Let time pass; record a trial that has ended."""

    def abort(self, now: float, reason: str) -> None:
        """Abort the running trial; it is repeated."""

    def skip(self, now: float, reason: str) -> None:
        """Skip the current step."""

    def execute(self, name: str, text: str, now: float) -> None:
        """Execute one of its own commands."""

    def state(self) -> str:
        """Return the state of the running trial; empty without one."""

    def view(self, now: float) -> dict[str, Any]:
        """Return what pages show of the running trial."""

    def prompt(self, state: str) -> str:
        """Return the instruction to the participant in a state of a trial."""

    def curve(self) -> dict[str, Any]:
        """Return what pages draw once per trial."""

    def describe(self, step: Any) -> dict[str, Any]:
        """Return what pages show of a step."""

    def row(self, number: int, attempt: Any, *, practised: int) -> dict[str, Any]:
        """Return an attempt as a row of the visit's table."""

    def metrics(self, attempt: Any) -> dict[str, float]:
        """Return the metrics of an attempt."""
