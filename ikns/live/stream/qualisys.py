"""Qualisys Track Manager as a live source, through its real-time protocol.

The client of qtm-rt runs on asyncio, so it has a thread of its own. Documentation:
https://docs.qualisys.com/qtm-rt-protocol/
"""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ikns.errors import StreamError
from ikns.live.stream.client_feed import ClientFeed
from ikns.live.stream.client_thread import RECONNECT, ClientThread
from ikns.live.stream.frame import Frame
from ikns.live.stream.optional import load_client

#: Port of QTM for little-endian clients.
PORT = 22223

_VERSION = "1.25"  # of the protocol; the default of qtm-rt
_REMEDY = "pip install 'ikns[qualisys]'"


class QualisysFeed(ClientFeed):
    """Read the labeled 3D markers that QTM streams; reconnect after a break.

    Parameters
    ----------
    host : str
    port : int
    timeout : float
        Seconds for QTM to answer and to send a first frame.

    Attributes
    ----------
    device : dict
        ``drop_rate`` and ``out_of_sync_rate`` of the cameras as QTM reports them, from
        0 to 1 over its last half to full second, and the largest of each so far as
        ``largest_...``; and ``overruns``, frames lost because they were not read.

    Raises
    ------
    StreamError
        When QTM does not answer or sends no frames, has no labeled markers or no rate.
    """

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        name = f"qualisys:{host}" + (f":{port}" if port != PORT else "")
        self._qtm = load_client("qtm_rt", needed_by=name, remedy=_REMEDY)
        self._host, self._port = host, port
        super().__init__(ClientThread(name, "QTM", f"{host}:{port}", timeout))
        self._rates = dict.fromkeys(
            ("drop_rate", "out_of_sync_rate", "largest_drop_rate",
             "largest_out_of_sync_rate"), 0.0
        )  # fmt: skip
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake: asyncio.Event
        # Connecting, settings and first frame have `timeout` each at most.
        self._start(lambda: asyncio.run(self._serve()), timeout=3 * timeout + 1)

    @property
    def device(self) -> dict[str, float]:
        """What QTM reports of its cameras, and overruns."""
        return self._rates | super().device

    def close(self) -> None:
        """Disconnect."""
        self._client.close()
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop has ended already
                self._loop.call_soon_threadsafe(self._wake.set)
        super().close()

    async def _serve(self) -> None:
        self._loop, self._wake = asyncio.get_running_loop(), asyncio.Event()
        while not self._client.closed:
            self._wake.clear()
            connection = None
            try:
                connection = await self._connect()
                self._client.set_connected()
                await self._wake.wait()
                if not self._client.closed:
                    self._client.add_event(f"{self.name}: QTM disconnected.")
            except StreamError as error:
                if not self._client.connected:
                    raise
                self._client.add_event(str(error))
            finally:
                if connection is not None and connection.has_transport():
                    connection.disconnect()
            if not self._client.closed:
                with suppress(TimeoutError):
                    self._wake.clear()
                    await asyncio.wait_for(self._wake.wait(), RECONNECT)

    async def _connect(self) -> Any:
        """Connect and start the stream of frames."""
        connection = await self._open_connection()
        try:
            settings = await connection.get_parameters(["general", "3d"])
            labels, rate = _read_settings(settings, self.name)
            self._client.set_stream(
                labels, rate, if_unlabeled="load an AIM model in QTM"
            )
            await connection.stream_frames(components=["3d"], on_packet=self._receive)
        except TimeoutError:
            connection.disconnect()
            raise StreamError(
                f"{self.name}: QTM sends no frames within {self._client.timeout:g} s; "
                "start a measurement or real-time output in QTM."
            ) from None
        except self._qtm.QRTCommandException as error:
            connection.disconnect()
            raise StreamError(f"{self.name}: QTM answered {error}.") from None
        except StreamError:
            connection.disconnect()
            raise
        return connection

    async def _open_connection(self) -> Any:
        """Connect like ``qtm_rt.connect``, which leaks a socket on a timeout."""
        made: list[Any] = []  # known even if the connection fails later

        def protocol() -> Any:
            made.append(
                self._qtm.protocol.QTMProtocol(
                    on_disconnect=lambda error: self._wake.set()
                )
            )
            return made[0]

        try:
            async with asyncio.timeout(self._client.timeout):
                loop = asyncio.get_running_loop()
                await loop.create_connection(protocol, self._host, self._port)
                await made[0].set_version(_VERSION)
        except (OSError, self._qtm.QRTCommandException) as error:
            if made and made[0].transport is not None:
                made[0].transport.close()
            if isinstance(error, OSError):  # refused, unknown host, or a timeout
                raise self._client.no_answer(error) from None
            raise StreamError(f"{self.name}: QTM answered {error}.") from None
        return self._qtm.QRTConnection(made[0], timeout=self._client.timeout)

    def _receive(self, packet: Any) -> None:
        received = time.monotonic()
        component = packet.get_3d_markers()
        if component is None:
            return
        header, positions = component
        if len(positions) != len(self._client.labels):
            self._client.add_event(
                f"{self.name}: expected {len(self._client.labels)} markers in a frame, "
                f"found {len(positions)}."
            )
            return
        for key, per_mille in (
            ("drop_rate", header.drop_rate),
            ("out_of_sync_rate", header.out_of_sync_rate),
        ):
            self._rates[key] = 1e-3 * per_mille
            largest = f"largest_{key}"
            self._rates[largest] = max(self._rates[largest], self._rates[key])
        self._client.inbox.put(
            Frame(
                packet.framenumber,
                1e-6 * packet.timestamp,
                received,
                1e-3 * np.array(positions, dtype=np.float64).reshape(-1, 3),
            )
        )


def _read_settings(xml: bytes | str, source: str) -> tuple[tuple[str, ...], float]:
    try:
        settings = ElementTree.fromstring(xml)
    except ElementTree.ParseError:
        raise StreamError(f"{source}: QTM's settings are not XML.") from None
    labels = tuple(
        (name.text or "").strip() for name in settings.findall("./The_3D/Label/Name")
    )
    return labels, float(settings.findtext("./General/Frequency", "0"))
