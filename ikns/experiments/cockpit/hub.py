"""Interfaces between server and handlers, so that neither imports the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Protocol

from ikns.experiments.conduct import Conductor
from ikns.live.web_access import WebAccess

#: The first participant's page is in control; further ones only watch.
Role = Literal["participant", "viewer", "panel"]


class ConnectedPage(Protocol):
    """A connected page, as the server sees it."""

    role: Role

    def hello(self) -> None:
        """Send the page its role and what it is connected to."""

    def push(self) -> None:
        """Send the newest state."""

    def close(self, code: int | None = None, reason: str | None = None) -> None:
        """End the connection."""


class Hub(Protocol):
    """The server, as its handlers see it."""

    access: WebAccess
    about: Mapping[str, Any]
    conductor: Conductor

    def join(self, page: ConnectedPage) -> None:
        """Add a page."""

    def leave(self, page: ConnectedPage) -> None:
        """Remove a page; if it was in control, the next one is."""

    def steer(
        self, condition: str, now: float, c: float, round_trip: float, device: str
    ) -> None:
        """Take a control signal from the page in control."""

    def press(self) -> None:
        """Take a press of the ring button."""
