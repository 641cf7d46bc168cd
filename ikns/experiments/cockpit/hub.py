"""What the handlers of a page need of the server; neither has to import the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Protocol

from ikns.experiments.cockpit.gate import Gate
from ikns.experiments.conduct import Conductor

__all__ = ["Hub", "PageLink", "Role"]

#: The first participant's page drives, others look on.
Role = Literal["participant", "viewer", "panel"]


class PageLink(Protocol):
    """A connected page, as the server sees it."""

    role: Role

    def hello(self) -> None:
        """Tell the page its role and what it is connected to."""

    def push(self) -> None:
        """Send the newest state."""

    def close(self, code: int | None = None, reason: str | None = None) -> None:
        """End the connection."""


class Hub(Protocol):
    """The server, as its handlers see it."""

    gate: Gate
    about: Mapping[str, Any]
    conductor: Conductor

    def join(self, link: PageLink) -> None:
        """Add a page."""

    def leave(self, link: PageLink) -> None:
        """Remove a page; if it was driving, the next one drives."""

    def steer(self, by: str, now: float, c: float, round_trip: float) -> None:
        """Take a control signal of the page that drives."""

    def press(self) -> None:
        """Take a press of the ring button."""
