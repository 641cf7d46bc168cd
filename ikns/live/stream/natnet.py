"""OptiTrack Motive as a live source, through NatNet.

Tried on loopback with a server written from the protocol's description, not with
Motive.
"""

from __future__ import annotations

import math
import struct
import time

from ikns.errors import StreamError
from ikns.live.stream import natnet_packets as packets
from ikns.live.stream.client_feed import ClientFeed
from ikns.live.stream.client_thread import RECONNECT, ClientThread
from ikns.live.stream.frame import Frame
from ikns.live.stream.natnet_link import NatNetLink
from ikns.live.stream.optional import load_client

#: Port of NatNet servers for commands.
PORT = 1510

_REMEDY = "pip install 'ikns[optitrack]'"
#: Motive forgets a client that is silent for longer than a few of these, s.
_KEEP_ALIVE = 0.5
#: Without a packet for so long, the server is taken to be gone, s.
_SILENCE = 2.0


class NatNetFeed(ClientFeed):
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

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        name = f"natnet:{host}" + (f":{port}" if port != PORT else "")
        self._natnet = load_client("natnet", needed_by=name, remedy=_REMEDY)
        self._address = (host, port)
        super().__init__(
            ClientThread(name, "a NatNet server", f"{host}:{port}", timeout)
        )
        self._latency = {"latency": math.nan, "largest_latency": math.nan}
        self._link: NatNetLink
        self._facts: packets.ServerFacts
        self._models: packets.Models
        # Connecting, names, rate and first frame have `timeout` each at most.
        self._start(self._serve, timeout=4 * timeout + 1)

    @property
    def device(self) -> dict[str, float]:
        """What the server reports, and overruns."""
        return self._latency | super().device

    def _serve(self) -> None:
        while not self._client.closed:
            try:
                self._link = NatNetLink(self._client, *self._address)
                try:
                    self._begin()
                    self._client.set_connected()
                    self._receive_frames()
                finally:
                    self._link.close()
            except StreamError as error:
                if not self._client.connected:
                    raise
                self._client.add_event(str(error))
                time.sleep(RECONNECT)

    def _begin(self) -> None:
        """Ask for version, names and rate, and wait for a first frame."""
        link, client = self._link, self._client
        self._facts = packets.ServerFacts(self._natnet, link.hello, self.name)
        if self._facts.group:
            link.join(self._facts.group, self._facts.data_port)
        models = link.ask(packets.REQUEST_MODELS, "", packets.MODELS)
        content = link.ask(packets.REQUEST, "FrameRate", packets.RESPONSE)
        rate = struct.unpack_from("<f", content)[0] if len(content) >= 4 else 0.0
        self._take_models(models, rate)
        self._changed = True  # of models that are known already
        give_up = time.monotonic() + client.timeout
        while not client.closed:
            got = link.receive(give_up)
            if got is None:
                raise StreamError(
                    f"{self.name}: the server sends no frames within "
                    f"{client.timeout:g} s; run Motive live or play a take, with "
                    "streaming on."
                )
            if got.number == packets.FRAME:
                self._take_frame(got.content, got.time)
                return

    def _receive_frames(self) -> None:
        """Read frames until the server goes away."""
        heard = kept_alive = time.monotonic()
        while not self._client.closed:
            now = time.monotonic()
            if now - kept_alive >= _KEEP_ALIVE:
                kept_alive = now
                self._link.send(packets.KEEP_ALIVE)
            got = self._link.receive(now + _KEEP_ALIVE)
            if got is None:
                if time.monotonic() - heard > _SILENCE:
                    self._client.add_event(f"{self.name}: the server disconnected.")
                    return
                continue
            heard = got.time
            if got.number == packets.FRAME:
                self._take_frame(got.content, got.time)
            elif got.number == packets.MODELS:
                self._take_models(got.content, self._client.rate)

    def _take_models(self, content: bytes, rate: float) -> None:
        """Take names and rate; other ones than before are refused."""
        self._models = packets.Models(
            self._natnet, content, self._facts.version, self.name
        )
        self._client.set_stream(self._models.labels, rate, if_unlabeled="")
        self._asked = math.inf  # nothing is asked at present

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
                self._link.send(packets.REQUEST_MODELS)
            return
        if end.stamp_camera_mid_exposure:
            ticks = end.stamp_transmit - end.stamp_camera_mid_exposure
            self._latency["latency"] = late = ticks / self._facts.ticks
            if not late <= self._latency["largest_latency"]:
                self._latency["largest_latency"] = late
        self._client.inbox.put(
            Frame(frame.prefix.frame_number, end.timestamp, received, markers)
        )
