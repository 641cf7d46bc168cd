"""The cockpit's server: its own thread and loop, on this machine alone by default."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

from ikns.errors import FileError
from ikns.experiments.cockpit.gate import Gate
from ikns.experiments.cockpit.hub import PageLink
from ikns.experiments.conduct import Command, Conductor, HeldInput

__all__ = ["Cockpit", "check_port"]

_LOOPBACK = "127.0.0.1"
#: How often pages get what is newest, 1/s.
_PUSHED = 60.0
#: Longest message of a page, bytes.
_MESSAGE = 4096
#: A page that does not answer this long has gone, s.
_PING = 5.0


class Cockpit:
    """Serve the participant's screen and the experimenter's panel of a visit.

    Use it as a context manager; leaving it stops the server. The first participant's
    page drives; others look on, until it leaves.

    Parameters
    ----------
    conductor : Conductor
    held : mapping of str to HeldInput
        What a page can drive: ``gamepad``, ``keyboard``, ``mouse``.
    on_press : callable, optional
        Called when the participant's page hears the ring button.
    host : str
        Any other address than a loopback one needs the token that :attr:`url` holds.
    port : int
        0 takes a free one.
    about : mapping
        What the pages say: ``participant``, ``simulated``, ``stick`` ("left" or
        "trigger"), ``view`` (address of the 3-D view) and so on.

    Raises
    ------
    FileError
        When the port cannot be opened.
    """

    def __init__(
        self,
        conductor: Conductor,
        held: Mapping[str, HeldInput],
        *,
        on_press: Callable[[], None] | None = None,
        host: str = _LOOPBACK,
        port: int = 0,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        self.conductor, self._held, self._on_press = conductor, dict(held), on_press
        self.about: Mapping[str, Any] = {
            "experiment": conductor.desk.experiment,
            "participant": "",
            "simulated": False,
            "stick": "left",
            "view": "",
        } | dict(about or {})
        self._links: list[PageLink] = []
        host = _LOOPBACK if host == "localhost" else host
        self._socket = _listening(host, port)
        self.gate = Gate.at(host, self._socket.getsockname()[1])
        self._loop = asyncio.new_event_loop()
        self._closing = asyncio.Event()
        self._thread = threading.Thread(
            target=self._run, name="ikns cockpit", daemon=True
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the participant's page."""
        return self._address("/")

    @property
    def panel_url(self) -> str:
        """Address of the experimenter's panel."""
        return self._address("/panel")

    def _address(self, path: str) -> str:
        gate = self.gate
        host = socket.gethostname() if gate.host in ("0.0.0.0", "::") else gate.host
        host = f"[{host}]" if ":" in host else host
        token = f"?token={gate.token}" if gate.token else ""
        return f"http://{host}:{gate.port}{path}{token}"

    def close(self) -> None:
        """Stop the server; calling it again does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._closing.set)
            self._thread.join()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the server."""
        self.close()

    # --- from here on in the server's thread ----------------------------------------

    def join(self, link: PageLink) -> None:
        """Let a page in."""
        self._links.append(link)
        self._choose()
        if link.role != "participant":
            link.hello()

    def leave(self, link: PageLink) -> None:
        """Let a page go; if it was driving, the one that came next drives."""
        if link not in self._links:
            return
        self._links.remove(link)
        if link.role == "participant":
            for held in self._held.values():
                held.lose()
            self.conductor.ask(Command("left"))
            self._choose()

    def steer(self, by: str, now: float, c: float, round_trip: float) -> None:
        """Take a control signal of the page that drives."""
        if by in self._held:
            self._held[by].put(now, c, round_trip=round_trip)

    def press(self) -> None:
        """Hear the ring button."""
        if self._on_press:
            self._on_press()

    def _choose(self) -> None:
        """See that one participant's page drives."""
        pages = [link for link in self._links if link.role != "panel"]
        if pages and all(link.role == "viewer" for link in pages):
            pages[0].role = "participant"
            self.conductor.ask(Command("came"))
            pages[0].hello()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    async def _serve(self) -> None:
        from tornado.httpserver import HTTPServer
        from tornado.web import Application

        from ikns.experiments.cockpit.handlers import FILES, Page
        from ikns.experiments.cockpit.link import Link

        mine = {"cockpit": self}
        application = Application(
            [*((path, Page, mine) for path in FILES), ("/link", Link, mine)],
            log_function=lambda handler: None,
            websocket_max_message_size=_MESSAGE,
            websocket_ping_interval=_PING,
            websocket_ping_timeout=_PING,
        )
        server = HTTPServer(
            application, max_body_size=_MESSAGE, idle_connection_timeout=60
        )
        server.add_sockets([self._socket])
        due = time.monotonic()
        while not self._closing.is_set():
            for link in list(self._links):
                link.push()
            due = max(due + 1 / _PUSHED, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
        server.stop()
        for link in list(self._links):
            link.close(1001, "the run has ended")
        # Pages get to hear it, but are not waited for.
        end = time.monotonic() + 0.5
        while self._links and time.monotonic() < end:
            await asyncio.sleep(0.01)
        await server.close_all_connections()


def check_port(host: str, port: int) -> None:
    """Make sure, before any work, that a cockpit may listen there.

    Raises
    ------
    FileError
        When it may not.
    """
    _listening(_LOOPBACK if host == "localhost" else host, port).close()


def _listening(host: str, port: int) -> socket.socket:
    try:
        if not 0 <= port < 2**16:  # some systems would take the rest of it
            raise OverflowError("expected 0 to 65535")
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        made = socket.create_server(found[4][:2], family=found[0])
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(
            f"port {port} of {host} cannot be opened: {reason.lower()}."
        ) from None
    made.setblocking(False)
    return made
