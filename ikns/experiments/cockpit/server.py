"""The cockpit's web server, in its own thread; by default for this machine only."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Self

from ikns.errors import FileError
from ikns.experiments.cockpit.hub import ConnectedPage
from ikns.experiments.conduct import Command, Conductor, HeldInput
from ikns.live.web_access import WebAccess

_LOOPBACK = "127.0.0.1"
#: How often pages get the newest state, 1/s.
_PUSH_RATE = 60.0
#: Longest message of a page, bytes.
_MAX_MESSAGE = 4096
#: Keep-alive: a page that does not answer a ping within this time is gone, s.
_PING_TIMEOUT = 5.0


class Cockpit:
    """Serve the participant's screen and the experimenter's panel of a visit.

    Use it as a context manager; leaving it stops the server. The first participant's
    page is in control; further ones only watch, until it closes.

    Parameters
    ----------
    conductor : Conductor
    held : mapping of str to HeldInput
        Conditions whose signal a page sends: ``gamepad``, ``keyboard``, ``mouse``.
    on_press : callable, optional
        Called when the ring button is pressed on the participant's page.
    host : str
        Address to listen on. Pages need the token in :attr:`url`.
    port : int
        0 takes a free one.
    about : mapping
        What the pages show: ``participant``, ``simulated``, ``stick`` ("left" or
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
            "experiment": conductor.experiment.name,
            "participant": "",
            "simulated": False,
            "stick": "left",
            "view": "",
        } | dict(about or {})
        self._pages: list[ConnectedPage] = []
        host = _LOOPBACK if host == "localhost" else host
        self._socket = _listening(host, port)
        self.access = WebAccess.at(host, self._socket.getsockname()[1])
        self._loop = asyncio.new_event_loop()
        self._closing = asyncio.Event()
        self._thread = threading.Thread(
            target=self._run, name="ikns cockpit", daemon=True
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the participant's page, with the token."""
        return self._address("/")

    @property
    def panel_url(self) -> str:
        """Address of the experimenter's panel, with the token."""
        return self._address("/panel")

    def _address(self, path: str) -> str:
        access = self.access
        host = socket.gethostname() if access.host in ("0.0.0.0", "::") else access.host
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{access.port}{path}?token={access.token}"

    def close(self) -> None:
        """Stop the server; calling it again does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._closing.set)
            self._thread.join()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self.close()

    # --- called in the server's thread ----------------------------------------------

    def join(self, page: ConnectedPage) -> None:
        """Add a page."""
        self._pages.append(page)
        self._choose()
        if page.role != "participant":
            page.hello()

    def leave(self, page: ConnectedPage) -> None:
        """Remove a page; if it was in control, the next one is."""
        if page not in self._pages:
            return
        self._pages.remove(page)
        if page.role == "participant":
            for held in self._held.values():
                held.clear()
            self.conductor.submit(Command("page_disconnected"))
            self._choose()

    def steer(
        self, condition: str, now: float, c: float, round_trip: float, device: str
    ) -> None:
        """Take a control signal from the page in control."""
        if condition in self._held:
            held = self._held[condition]
            held.put(now, c, round_trip=round_trip, device=device)

    def press(self) -> None:
        """Take a press of the ring button."""
        if self._on_press:
            self._on_press()

    def _choose(self) -> None:
        """Put the oldest participant's page in control, unless one is already."""
        pages = [page for page in self._pages if page.role != "panel"]
        if pages and all(page.role == "viewer" for page in pages):
            pages[0].role = "participant"
            self.conductor.submit(Command("page_connected"))
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

        from ikns.experiments.cockpit.handlers import FILES, PageHandler
        from ikns.experiments.cockpit.page_socket import PageSocket

        settings = {"cockpit": self}
        application = Application(
            [
                *((path, PageHandler, settings) for path in FILES),
                ("/link", PageSocket, settings),
            ],
            log_function=lambda handler: None,
            websocket_max_message_size=_MAX_MESSAGE,
            websocket_ping_interval=_PING_TIMEOUT,
            websocket_ping_timeout=_PING_TIMEOUT,
        )
        server = HTTPServer(
            application, max_body_size=_MAX_MESSAGE, idle_connection_timeout=60
        )
        server.add_sockets([self._socket])
        due = time.monotonic()
        while not self._closing.is_set():
            for page in list(self._pages):
                page.push()
            due = max(due + 1 / _PUSH_RATE, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
        server.stop()
        for page in list(self._pages):
            page.close(1001, "the run has ended")
        # Pages may answer, but none can hold up the end.
        end = time.monotonic() + 0.5
        while self._pages and time.monotonic() < end:
            await asyncio.sleep(0.01)
        await server.close_all_connections()


def check_port(host: str, port: int) -> None:
    """Check, before any work, that a cockpit can listen on a port.

    Raises
    ------
    FileError
        When it cannot.
    """
    _listening(_LOOPBACK if host == "localhost" else host, port).close()


def _listening(host: str, port: int) -> socket.socket:
    try:
        if not 0 <= port < 2**16:  # some systems would take it modulo 2**16
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
