"""A web socket with one page: what it shows goes out, what it asks comes in."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import OrderedDict
from typing import Any

from tornado.websocket import WebSocketClosedError

from ikns.experiments.cockpit.handlers import GuardedSocket
from ikns.experiments.cockpit.hub import Hub, Role
from ikns.experiments.conduct import Command

__all__ = ["Link", "as_json"]

#: Frames that a page may be behind before newer ones wait for it; 0.2 s at 60 Hz.
_BEHIND = 12
#: What a participant may ask; everything else is the experimenter's.
_PARTICIPANT = frozenset({"begin", "emergency", "press", "toggle"})
#: Longest reason or comment, characters.
_LONGEST = 500


class Link(GuardedSocket):
    """One page."""

    def initialize(self, cockpit: Hub) -> None:
        """Remember whose it is."""
        super().initialize(cockpit)
        self.role: Role = "viewer"
        self._number = 0
        self._sent: OrderedDict[int, float] = OrderedDict()
        self._versions = {"plan": -1, "curve": -1}
        self._writing: asyncio.Future[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """Let it in."""
        self.set_nodelay(True)
        wanted = self.get_query_argument("role", "")
        self.role = "panel" if wanted == "panel" else "viewer"
        self.cockpit.join(self)

    def on_close(self) -> None:
        """Let it go."""
        self.cockpit.leave(self)

    def hello(self) -> None:
        """Say what it is talking with, and which role it has."""
        self._write({"kind": "hello", "role": self.role, **self.cockpit.about})

    def push(self) -> None:
        """Send the newest, unless the page is still busy with what it got."""
        if len(self._sent) >= _BEHIND or (self._writing and not self._writing.done()):
            return
        conductor = self.cockpit.conductor
        shown = conductor.shown
        if not shown:
            return
        for name, table in (("plan", conductor.plan), ("curve", conductor.curve)):
            if table["version"] != self._versions[name]:
                self._versions[name] = table["version"]
                self._write({"kind": name} | table)
        self._number += 1
        self._sent[self._number] = time.monotonic()
        self._write({"kind": "now", "n": self._number} | shown)

    def on_message(self, message: str | bytes) -> None:
        """Take what the page says; one that talks nonsense is shown out."""
        now = time.monotonic()
        try:
            told = json.loads(message)
            name, text = told.get("ask"), str(told.get("text", ""))[:_LONGEST]
            number, c = int(told.get("n", 0)), told.get("c")
            value = math.nan if c is None else float(c)
        except (ValueError, TypeError, AttributeError, RecursionError):
            self.close(1003, "expected JSON as the page sends it")
            return
        round_trip = self._answered(number, now)
        if name is not None:
            self._ask(str(name), text)
        if self.role == "participant" and "c" in told:
            self.cockpit.steer(str(told.get("by")), now, value, round_trip)

    def _ask(self, name: str, text: str) -> None:
        if self.role == "panel" and name not in ("came", "left", "press"):
            self.cockpit.conductor.ask(Command(name, text))
        elif name == "emergency":  # whoever sees danger
            self.cockpit.conductor.ask(Command(name))
        elif self.role == "participant" and name == "press":
            self.cockpit.press()
        elif self.role == "participant" and name in _PARTICIPANT:
            self.cockpit.conductor.ask(Command(name))

    def _answered(self, number: int, now: float) -> float:
        """Take note that the page has seen a frame; return how long it took, s."""
        sent = self._sent.get(number, math.nan)
        while self._sent and next(iter(self._sent)) <= number:
            self._sent.popitem(last=False)
        return now - sent

    def _write(self, table: dict[str, Any]) -> None:
        try:
            writing = self.write_message(as_json(table))
        except WebSocketClosedError:
            return
        writing.add_done_callback(_forget)
        self._writing = writing


def as_json(table: Any) -> str:
    """Return strict JSON; what is not finite becomes null."""
    return json.dumps(_plain(table), separators=(",", ":"), allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _forget(writing: asyncio.Future[None]) -> None:
    """Let a write fail: a page that has gone is noticed when it closes."""
    if not writing.cancelled():
        writing.exception()
