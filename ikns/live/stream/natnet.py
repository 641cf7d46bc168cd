"""OptiTrack Motive as a live source, through NatNet.

The library natnet reads the bytes; its own client polls, and prints what it does not
understand, so the sockets are here. Tried on loopback with a server written from the
protocol's description, not with Motive.
"""

from __future__ import annotations

import math
import select
import socket
import struct
import time

from ikns.errors import StreamError
from ikns.live.stream import natnet_packets as packets
from ikns.live.stream.client_thread import RECONNECT, ClientThread
from ikns.live.stream.frame import Frame
from ikns.live.stream.optional import load_client

#: Port of NatNet servers for commands.
PORT = 1510

_REMEDY = "pip install 'ikns[optitrack]'"
#: Motive forgets a client that is silent for longer than a few of these, s.
_KEEP_ALIVE = 0.5
#: Without a packet for so long, the server is taken to be gone, s.
_SILENCE = 2.0
#: After the first answer, another server has so long to answer too, s.
_SETTLE = 0.2
_LARGEST = 65535


class NatNetFeed:
    """Read the labeled markers that a NatNet server streams; reconnect after a break.

    Rigid bodies are ignored, and so are frames that come from another server.

    Parameters
    ----------
    host : str
        Of the server, or a broadcast address, if one server answers there.
    port : int
        For commands.
    timeout : float
        Seconds for the server to answer and to send a first frame.

    Attributes
    ----------
    device : dict
        ``latency``: from the middle of the exposure until the server sent the frame,
        s, as it says, and ``largest_latency``; NaN where it does not say. ``overruns``:
        frames lost because they were not read.

    Raises
    ------
    StreamError
        When no server answers, or more than one, or in another version; when it has no
        labeled markers or no rate, or sends no frames.
    """

    speed = 1.0

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        self.name = f"natnet:{host}" + (f":{port}" if port != PORT else "")
        self._natnet = load_client("natnet", needed_by=self.name, remedy=_REMEDY)
        self._address = (host, port)
        self._client = ClientThread(
            self.name, "a NatNet server", f"{host}:{port}", timeout
        )
        self.events = self._client.events
        self._latency = {"latency": math.nan, "largest_latency": math.nan}
        self._sockets: list[socket.socket] = []
        self._facts: packets.ServerFacts
        self._models: packets.Models
        try:
            # Connecting, names, rate and first frame have `timeout` each at most.
            self._client.start(self._serve, timeout=4 * timeout + 1)
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
        """What the server reports, and overruns."""
        return {**self._latency, "overruns": float(self._client.inbox.overruns)}

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, None after `timeout` seconds."""
        return self._client.inbox.get(timeout)

    def close(self) -> None:
        """Disconnect."""
        self._client.close()
        self._client.join(1.0)

    def _serve(self) -> None:
        while not self._client.closed:
            try:
                self._connect()
                self._client.set_connected()
                self._receive_frames()
            except StreamError as error:
                if not self._client.connected:
                    raise
                self._client.add_event(str(error))
                time.sleep(RECONNECT)
            finally:
                for each in self._sockets:
                    each.close()
                self._sockets = []

    def _connect(self) -> None:
        """Ask for version, names and rate, and wait for a first frame."""
        ours = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets = [ours]
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        try:
            self._server = (socket.gethostbyname(self._address[0]), self._address[1])
        except OSError:
            raise self._client.no_answer() from None
        hello, self._server = self._find_server()
        self._facts = packets.ServerFacts(self._natnet, hello, self.name)
        if self._facts.group:
            self._join_group()
        content = self._ask(packets.REQUEST_MODELS, "", packets.MODELS)
        self._models = packets.Models(
            self._natnet, content, self._facts.version, self.name
        )
        content = self._ask(packets.REQUEST, "FrameRate", packets.RESPONSE)
        rate = struct.unpack_from("<f", content)[0] if len(content) >= 4 else 0.0
        self._client.set_stream(self._models.labels, rate, if_unlabeled="")
        self._changed, self._asked = True, math.inf  # these names are new
        give_up = time.monotonic() + self._client.timeout
        while not self._take(packets.FRAME, give_up):
            if time.monotonic() >= give_up:
                raise StreamError(
                    f"{self.name}: the server sends no frames within "
                    f"{self._client.timeout:g} s; let Motive run live or play a take, "
                    "with streaming on."
                )

    def _find_server(self) -> tuple[bytes, tuple[str, int]]:
        """Return the answer of the only server, and its address."""
        found: dict[tuple[str, int], bytes] = {}
        give_up = time.monotonic() + self._client.timeout
        while time.monotonic() < give_up and not self._client.closed:
            self._send(packets.CONNECT, "Ping")
            again = min(give_up, time.monotonic() + RECONNECT)
            while (left := again - time.monotonic()) > 0:
                ready, _, _ = select.select(self._sockets, [], [], left)
                if not ready:
                    break
                number, content, sender = self._packet(self._sockets[0])
                if number == packets.SERVER_INFO:
                    if not found:
                        give_up = again = time.monotonic() + _SETTLE
                    found[sender] = content
        if not found:
            raise self._client.no_answer()
        if len(found) > 1:
            listed = " and ".join(sorted(host for host, _ in found))
            raise StreamError(
                f"{self.name}: expected one NatNet server, found {len(found)}: "
                f"{listed}; choose one, as in natnet:{min(found)[0]}."
            )
        ((sender, content),) = found.items()
        return content, sender

    def _join_group(self) -> None:
        shared = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets.append(shared)
        shared.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(self._server)  # sends nothing; finds the way to the server
            own = probe.getsockname()[0]
        try:
            shared.bind((self._facts.group, self._facts.data_port))
            shared.setsockopt(
                socket.IPPROTO_IP,
                socket.IP_ADD_MEMBERSHIP,
                socket.inet_aton(self._facts.group) + socket.inet_aton(own),
            )
        except OSError as error:
            raise StreamError(
                f"{self.name}: its multicast group {self._facts.group} cannot be "
                f"joined ({error.strerror}); choose Unicast in Motive."
            ) from None

    def _ask(self, number: int, text: str, answer: int) -> bytes:
        """Send a request until it is answered."""
        give_up = time.monotonic() + self._client.timeout
        while time.monotonic() < give_up and not self._client.closed:
            self._send(number, text)
            again = min(give_up, time.monotonic() + RECONNECT)
            while time.monotonic() < again:
                content = self._take(answer, again)
                if content:
                    return content
        raise StreamError(
            f"{self.name}: expected the server to answer {text or 'its models'} within "
            f"{self._client.timeout:g} s, found no answer."
        )

    def _receive_frames(self) -> None:
        """Read frames until the server goes away."""
        heard = kept_alive = time.monotonic()
        while not self._client.closed:
            now = time.monotonic()
            if now - kept_alive >= _KEEP_ALIVE:
                kept_alive = now
                self._send(packets.KEEP_ALIVE, "")
            if self._take(packets.FRAME, now + 0.1):
                heard = time.monotonic()
            elif now - heard > _SILENCE:
                self._client.add_event(f"{self.name}: the server went away.")
                return

    def _take(self, wanted: int, until: float) -> bytes:
        """Return the next message of a kind, empty at a time; frames go on."""
        while (left := until - time.monotonic()) > 0 and not self._client.closed:
            ready, _, _ = select.select(self._sockets, [], [], min(left, 0.1))
            for each in ready:
                number, content, sender = self._packet(each)
                received = time.monotonic()
                if number >= 0 and sender[0] != self._server[0]:
                    self._client.add_event(
                        f"{self.name}: frames of another server at {sender[0]} come "
                        "too and are ignored."
                    )
                    continue
                if number == packets.FRAME == wanted:
                    self._take_frame(content, received)
                elif number == packets.MODELS != wanted:
                    self._renew_models(content)
                if number == wanted:
                    return content
        return b""

    def _take_frame(self, content: bytes, received: float) -> None:
        try:
            frame, markers = self._models.frame(content)
        except ValueError as error:
            self._client.add_event(f"{self.name}: a frame is not read: {error}.")
            return
        end = frame.suffix
        if end.tracked_models_changed and not self._changed:
            self._asked = -math.inf
        self._changed = end.tracked_models_changed
        if self._asked < math.inf:  # names may be others now
            if received - self._asked > RECONNECT:
                self._asked = received
                self._send(packets.REQUEST_MODELS, "")
            return
        if end.stamp_camera_mid_exposure:
            ticks = end.stamp_transmit - end.stamp_camera_mid_exposure
            self._latency["latency"] = late = ticks / self._facts.ticks
            self._latency["largest_latency"] = max(
                late, self._latency["largest_latency"]
            )
        self._client.inbox.put(
            Frame(frame.prefix.frame_number, end.timestamp, received, markers)
        )

    def _renew_models(self, content: bytes) -> None:
        """Take the models after a change; other markers than before are refused."""
        self._models = packets.Models(
            self._natnet, content, self._facts.version, self.name
        )
        self._client.set_stream(self._models.labels, self._client.rate, if_unlabeled="")
        self._asked = math.inf

    def _packet(self, ready: socket.socket) -> tuple[int, bytes, tuple[str, int]]:
        """Read one message: number, content and sender."""
        try:
            packet, sender = ready.recvfrom(_LARGEST)
        except OSError:  # such as "refused": nobody listens at the port at present
            return -1, b"", ("", 0)
        return *packets.split_message(packet), sender

    def _send(self, number: int, text: str) -> None:
        try:
            self._sockets[0].sendto(packets.message(number, text), self._server)
        except OSError as error:
            raise StreamError(
                f"{self.name}: {self._server[0]} cannot be reached ({error.strerror})."
            ) from None
