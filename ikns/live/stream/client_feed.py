"""What feeds have in common whose frames come from the thread of a client."""

from __future__ import annotations

from collections.abc import Callable

from ikns.live.stream.client_thread import ClientThread
from ikns.live.stream.frame import Frame

#: How long the thread has to end when the feed is closed, s.
_END = 1.0


class ClientFeed:
    """A feed over the inbox and the events of a client's thread.

    Parameters
    ----------
    client : ClientThread
        Not started; see :meth:`_start`.

    Attributes
    ----------
    name : str
        Address of the source.
    labels : tuple of str
    rate : float
        Frames per second.
    events : deque of Event
    """

    speed = 1.0

    def __init__(self, client: ClientThread) -> None:
        self._client = client
        self.name, self.events = client.name, client.events

    def _start(self, serve: Callable[[], None], *, timeout: float) -> None:
        """Run `serve` in the thread until it is connected; the last step of making one.

        Parameters
        ----------
        serve : callable
            Connects again and again until the client is closed.
        timeout : float
            Longest time to wait, s.

        Raises
        ------
        StreamError
        """
        try:
            self._client.start(serve, timeout=timeout)
        except BaseException:
            self.close()
            raise
        self.labels, self.rate = self._client.labels, self._client.rate

    @property
    def ended(self) -> bool:
        """Whether it was closed; the server may come back."""
        return self._client.closed

    @property
    def device(self) -> dict[str, float]:
        """``overruns``: frames lost because they were not read."""
        return {"overruns": float(self._client.inbox.overruns)}

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, None after `timeout` seconds."""
        return self._client.inbox.get(timeout)

    def skip(self) -> None:
        """Forget the frames that came but were not read."""
        self._client.inbox.clear()

    def close(self) -> None:
        """Disconnect."""
        self._client.close()
        self._client.join(_END)
