"""The web socket of one page: it sends the state and takes commands and signals."""

from __future__ import annotations

import asyncio
import math
import time
from collections import OrderedDict
from typing import Any

from tornado.websocket import WebSocketClosedError

from ikns.experiments.cockpit.handlers import CheckedSocket
from ikns.experiments.cockpit.hub import Hub, Role
from ikns.experiments.cockpit.messages import read_message
from ikns.experiments.conduct import Command
from ikns.output.strict_json import strict_json

#: A page with so many unanswered states gets no new one; 0.2 s at 60 Hz.
_MAX_UNANSWERED = 12
#: Commands of the participant's page; all others are the experimenter's.
_PARTICIPANT = frozenset({"begin", "emergency", "press", "toggle"})
#: Messages from the server to the conductor, and the ring button: not for the panel.
_NOT_PANEL = frozenset({"page_connected", "page_disconnected", "press"})


class PageSocket(CheckedSocket):
    """The connection to one page."""

    def initialize(self, cockpit: Hub) -> None:
        """Start as a viewer."""
        super().initialize(cockpit)
        self.role: Role = "viewer"
        self._number = 0
        self._sent: OrderedDict[int, float] = OrderedDict()
        self._versions = {"plan": -1, "curve": -1}
        self._writing: asyncio.Future[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """Join the cockpit in the role that the address names."""
        self.set_nodelay(True)
        self.role = "panel" if self.in_address("role") == "panel" else "viewer"
        self.cockpit.join(self)

    def on_close(self) -> None:
        """Leave the cockpit."""
        self.cockpit.leave(self)

    def hello(self) -> None:
        """Send the page its role and what the visit is."""
        about = dict(self.cockpit.about)
        if self.role != "panel":  # its address holds a token
            about["view"] = ""
        self._write({"kind": "hello", "role": self.role, **about})

    def push(self) -> None:
        """Send the newest state, unless the page is behind."""
        if len(self._sent) >= _MAX_UNANSWERED or (
            self._writing and not self._writing.done()
        ):
            return
        conductor = self.cockpit.conductor
        if not conductor.shown:
            return
        for name, table in (("plan", conductor.plan), ("curve", conductor.curve)):
            if table["version"] != self._versions[name]:
                self._versions[name] = table["version"]
                self._write({"kind": name} | table)
        self._number += 1
        now, shown = time.monotonic(), conductor.shown
        self._sent[self._number] = now
        age = max(0.0, now - shown["time"])
        self._write({"kind": "now", "n": self._number, "now_age": age} | shown)

    def on_message(self, message: str | bytes) -> None:
        """Take a message of the page; one that is malformed closes the connection."""
        now = time.monotonic()
        try:
            received = read_message(message)
        except ValueError:
            self.close(1003, "expected JSON as the page sends it")
            return
        round_trip = self._answered(received.n, now)
        if received.command:
            self._submit(received.command, received.text)
        if self.role == "participant" and received.c is not None:
            self.cockpit.steer(
                received.condition, now, received.c, round_trip, received.device
            )

    def _submit(self, name: str, text: str) -> None:
        """Pass a command on if the page's role allows it."""
        if self.role == "panel" and name not in _NOT_PANEL:
            self.cockpit.conductor.submit(Command(name, text))
        elif name == "emergency":  # anyone may stop
            self.cockpit.conductor.submit(Command(name))
        elif self.role == "participant" and name == "press":
            self.cockpit.press()
        elif self.role == "participant" and name in _PARTICIPANT:
            self.cockpit.conductor.submit(Command(name))

    def _answered(self, number: int, now: float) -> float:
        """Note that the page has seen a state; return how long ago it was sent, s."""
        sent = self._sent.get(number, math.nan)
        while self._sent and next(iter(self._sent)) <= number:
            self._sent.popitem(last=False)
        return now - sent

    def _write(self, table: dict[str, Any]) -> None:
        try:
            writing = self.write_message(strict_json(table))
        except WebSocketClosedError:
            return
        writing.add_done_callback(_ignore_failure)
        self._writing = writing


def _ignore_failure(writing: asyncio.Future[None]) -> None:
    """Let a write fail: a lost page is handled when its connection closes."""
    if not writing.cancelled():
        writing.exception()
