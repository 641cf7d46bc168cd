"""The thread of a vendor's client, and the frames and events that it receives."""

from __future__ import annotations

import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout

from ikns.errors import StreamError
from ikns.live.stream.frame import Event
from ikns.live.stream.inbox import Inbox

#: Time between attempts to connect, s.
RECONNECT = 0.5
#: Frames kept for a reader that is busy.
_INBOX = 1000


class ClientThread:
    """State that a feed shares with the thread of its client.

    Parameters
    ----------
    name : str
        Address of the source, for messages.
    server : str
        What the client connects to, for messages.
    address : str
        Host and port of the server.
    timeout : float
        Time that the server has to answer, s.

    Attributes
    ----------
    labels : tuple of str
    rate : float
        Frames per second.
    events : deque of Event
    inbox : Inbox
    closed : bool
        Whether the client has ended or is to end.
    connected : bool
        Whether it has been connected once.
    """

    def __init__(self, name: str, server: str, address: str, timeout: float) -> None:
        self.name, self.server, self.timeout = name, server, timeout
        self.labels: tuple[str, ...] = ()
        self.rate = 0.0
        self.events: deque[Event] = deque(maxlen=1000)
        self.inbox = Inbox(_INBOX)
        self.closed = False
        self._address = address
        self._last_text = ""
        self._ready: Future[None] = Future()
        self._thread: threading.Thread | None = None

    @property
    def connected(self) -> bool:
        """Whether it has been connected once."""
        return self._ready.done()

    def start(self, serve: Callable[[], None], *, timeout: float) -> None:
        """Run `serve` in the thread, and wait until it is connected.

        Parameters
        ----------
        serve : callable
            Connects again and again until `closed`.
        timeout : float
            Longest time to wait, s.

        Raises
        ------
        StreamError
            When it is not connected in time; also whatever `serve` raises before.
        """
        self._thread = threading.Thread(target=self._run, args=(serve,), daemon=True)
        self._thread.start()
        try:
            self._ready.result(timeout)
        except FutureTimeout:
            raise self.no_answer() from None

    def join(self, timeout: float) -> None:
        """Wait until the thread has ended, `timeout` seconds at most."""
        if self._thread is not None:
            self._thread.join(timeout)

    def close(self) -> None:
        """Ask the client to end, and wake a waiting reader."""
        self.closed = True
        self.inbox.close()

    def add_event(self, text: str) -> None:
        """Add an event; a repetition of the last one is left out."""
        if text != self._last_text:
            self._last_text = text
            self.events.append(Event(time.monotonic(), text))

    def set_stream(
        self, labels: tuple[str, ...], rate: float, *, if_unlabeled: str
    ) -> None:
        """Check and store the description of the stream.

        Parameters
        ----------
        labels : tuple of str
        rate : float
            Frames per second.
        if_unlabeled : str
            What to do at the server when there are no labels.

        Raises
        ------
        StreamError
            When there are no labels or no rate, or other ones than before.
        """
        if not labels:
            raise StreamError(
                f"{self.name}: expected labeled markers, found none; {if_unlabeled}."
            )
        if not rate > 0:
            raise StreamError(
                f"{self.name}: expected a rate above 0 frames/s, found {rate:g}."
            )
        if self.connected and (labels, rate) != (self.labels, self.rate):
            raise StreamError(
                f"{self.name}: {self.server} has different markers or a different "
                "rate than before and is not read."
            )
        self.labels, self.rate = labels, rate

    def set_connected(self) -> None:
        """Report that frames are coming."""
        if self.connected:
            self.add_event(f"{self.name}: {self.server} is back.")
        else:
            self._ready.set_result(None)

    def no_answer(self, why: OSError | None = None) -> StreamError:
        """Make the error for a server that does not answer.

        Parameters
        ----------
        why : OSError, optional
            What the system says; a timeout where there is none.
        """
        expected = f"{self.name}: expected {self.server} to answer at {self._address}"
        if isinstance(why, socket.gaierror):
            return StreamError(f"{expected}, found no computer of that name.")
        if isinstance(why, ConnectionError):
            return StreamError(f"{expected}, found no program that does.")
        return StreamError(f"{expected} within {self.timeout:g} s, found no answer.")

    def _run(self, serve: Callable[[], None]) -> None:
        try:
            serve()
        except Exception as error:  # the reader has to learn of it, whatever it is
            if not self.connected:
                self._ready.set_exception(error)
            self.add_event(f"{self.name}: stopped reading ({error}).")
            self.close()
