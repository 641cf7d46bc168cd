"""Sockets to one NatNet server: requests, answers, frames.

The client of the library natnet polls its sockets and prints what it does not
understand, so it is not used.
"""

from __future__ import annotations

import select
import socket
import time
from typing import NamedTuple

from ikns.errors import StreamError
from ikns.live.stream.client_thread import RECONNECT, ClientThread
from ikns.live.stream.natnet_packets import (
    CONNECT,
    SERVER_INFO,
    message,
    split_message,
)

#: After the first answer, another server has so long to answer too, s.
_SETTLE = 0.2
#: Longest wait within which closing is noticed, s.
_SLICE = 0.1
_LARGEST = 65535


class Received(NamedTuple):
    """A message: its number, its content, when it came (s of `time.monotonic`)."""

    number: int
    content: bytes
    time: float


class NatNetLink:
    """Find the only server at an address, and talk to it.

    Parameters
    ----------
    client : ClientThread
        Its state, timeout and events.
    host : str
        Name or address, or a broadcast address.
    port : int
        For commands.

    Attributes
    ----------
    hello : bytes
        What the server says of itself.

    Raises
    ------
    StreamError
        When no server answers, or more than one.
    """

    def __init__(self, client: ClientThread, host: str, port: int) -> None:
        self._client, self._name = client, client.name
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM)]
        try:
            self._sockets[0].setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            try:
                self._server = socket.gethostbyname(host), port
            except OSError as error:
                raise client.no_answer(error) from None
            self.hello, self._server = self._find_server()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the sockets."""
        for each in self._sockets:
            each.close()

    def join(self, group: str, port: int) -> None:
        """Receive what the server sends to a multicast group.

        Raises
        ------
        StreamError
            When the group cannot be joined.
        """
        shared = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets.append(shared)
        shared.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.connect(self._server)  # sends nothing; finds our own address
                own = probe.getsockname()[0]
            shared.bind((group, port))
            member = socket.inet_aton(group) + socket.inet_aton(own)
            shared.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        except OSError as error:
            raise StreamError(
                f"{self._name}: its multicast group {group} cannot be joined "
                f"({error.strerror}); choose Unicast in Motive."
            ) from None

    def send(self, number: int, text: str = "") -> None:
        """Send a message.

        Raises
        ------
        StreamError
            When the server cannot be reached.
        """
        try:
            self._sockets[0].sendto(message(number, text), self._server)
        except OSError as error:
            raise StreamError(
                f"{self._name}: {self._server[0]} cannot be reached ({error.strerror})."
            ) from None

    def ask(self, number: int, text: str, answer: int) -> bytes:
        """Send a request until it is answered, and return the answer's content.

        Raises
        ------
        StreamError
            When it is not answered in time.
        """
        give_up = time.monotonic() + self._client.timeout
        while time.monotonic() < give_up and not self._client.closed:
            self.send(number, text)
            again = min(give_up, time.monotonic() + RECONNECT)
            while time.monotonic() < again:
                got = self.receive(again)
                if got is not None and got.number == answer:
                    return got.content
        raise StreamError(
            f"{self._name}: expected the server to send {text or 'its models'} within "
            f"{self._client.timeout:g} s, found no answer."
        )

    def receive(self, until: float) -> Received | None:
        """Return the next message of the server, None at a time."""
        while (left := until - time.monotonic()) > 0 and not self._client.closed:
            ready, _, _ = select.select(self._sockets, [], [], min(left, _SLICE))
            for each in ready[:1]:
                number, content, sender = _read(each)
                received = time.monotonic()
                if sender[0] == self._server[0]:
                    return Received(number, content, received)
                if number >= 0:
                    self._client.add_event(
                        f"{self._name}: frames of another server at {sender[0]} also "
                        "arrive and are ignored."
                    )
        return None

    def _find_server(self) -> tuple[bytes, tuple[str, int]]:
        """Return the answer of the only server, and its address."""
        found: dict[tuple[str, int], bytes] = {}
        give_up = time.monotonic() + self._client.timeout
        while time.monotonic() < give_up and not self._client.closed:
            self.send(CONNECT, "Ping")
            again = min(give_up, time.monotonic() + RECONNECT)
            while (left := again - time.monotonic()) > 0:
                if not select.select(self._sockets, [], [], left)[0]:
                    break
                number, content, sender = _read(self._sockets[0])
                if number == SERVER_INFO:
                    if not found:
                        give_up = again = time.monotonic() + _SETTLE
                    found[sender] = content
        if not found:
            raise self._client.no_answer()
        if len(found) > 1:
            listed = " and ".join(sorted(host for host, _ in found))
            raise StreamError(
                f"{self._name}: expected one NatNet server, found {len(found)}: "
                f"{listed}; choose one, as in natnet:{min(found)[0]}."
            )
        ((sender, content),) = found.items()
        return content, sender


def _read(ready: socket.socket) -> tuple[int, bytes, tuple[str, int]]:
    """Read one message: number, content and sender."""
    try:
        packet, sender = ready.recvfrom(_LARGEST)
    except OSError:  # such as "refused": no one listens at the port at present
        return -1, b"", ("", 0)
    return *split_message(packet), sender
