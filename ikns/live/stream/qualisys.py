"""Qualisys Track Manager as a live source, through its real-time protocol.

The client of qtm-rt runs on asyncio, so it has a thread of its own; a bounded inbox
lies between. Documentation: https://docs.qualisys.com/qtm-rt-protocol/
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotInTime
from contextlib import suppress
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ikns.errors import StreamError
from ikns.live.stream.frame import Event, Frame
from ikns.live.stream.inbox import Inbox
from ikns.live.stream.optional import bring_in

__all__ = ["PORT", "QualisysFeed"]

#: Where QTM listens for clients that read little-endian numbers.
PORT = 22223

_VERSION = "1.25"  # of the protocol, as qtm-rt asks for by default
_AGAIN = 0.5  # seconds between attempts to connect
_INBOX = 1000  # frames


class QualisysFeed:
    """Read the labeled 3D markers that QTM streams, and reconnect when it goes away.

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
        0 to 1 over its last half to full second, each also as ``largest_``; and
        ``overruns``, frames forgotten because nobody read them.

    Raises
    ------
    StreamError
        When QTM does not answer or sends no frames, has no labeled markers or no rate.
    """

    speed = 1.0

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        self.name = f"qualisys:{host}" + (f":{port}" if port != PORT else "")
        self._qtm = bring_in(
            "qtm_rt", needed_by=self.name, remedy="pip install 'ikns[qualisys]'"
        )
        self._host, self._port, self._timeout = host, port, timeout
        self.events: deque[Event] = deque(maxlen=1000)
        self.labels: tuple[str, ...] = ()
        self.rate = 0.0
        self._rates = dict.fromkeys(
            ("drop_rate", "out_of_sync_rate", "largest_drop_rate",
             "largest_out_of_sync_rate"), 0.0
        )  # fmt: skip
        self._inbox = Inbox(_INBOX)
        self._closed = False
        self._told = ""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake: asyncio.Event
        self._ready: Future[None] = Future()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()
        try:
            # Connecting, settings and first frame have `timeout` each at most.
            self._ready.result(3 * timeout + 1)
        except NotInTime:
            self.close()
            raise StreamError(self._no_answer()) from None
        except BaseException:
            self.close()
            raise

    @property
    def ended(self) -> bool:
        """Whether it was closed; QTM may come back."""
        return self._closed

    @property
    def device(self) -> dict[str, float]:
        """What QTM reports of its cameras, and overruns."""
        return {**self._rates, "overruns": float(self._inbox.overruns)}

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, None after `timeout` seconds."""
        return self._inbox.get(timeout)

    def close(self) -> None:
        """Disconnect."""
        self._closed = True
        self._inbox.close()
        if self._loop is not None:
            with suppress(RuntimeError):  # the loop has ended already
                self._loop.call_soon_threadsafe(self._wake.set)
        self._thread.join(1.0)

    def _no_answer(self) -> str:
        return (
            f"{self.name}: expected QTM to answer at {self._host}:{self._port} within "
            f"{self._timeout:g} s, found no answer."
        )

    def _tell(self, text: str) -> None:
        if text != self._told:  # an attempt that fails again and again is told once
            self._told = text
            self.events.append(Event(time.monotonic(), text))

    def _work(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as error:  # whatever it is, the reader must hear of it
            if not self._ready.done():
                self._ready.set_exception(error)
            self._tell(f"{self.name}: stopped reading ({error}).")
            self._closed = True
            self._inbox.close()

    async def _serve(self) -> None:
        self._loop, self._wake = asyncio.get_running_loop(), asyncio.Event()
        while not self._closed:
            self._wake.clear()
            connection = None
            try:
                connection = await self._connect()
                if self._ready.done():
                    self._tell(f"{self.name}: QTM is back.")
                else:
                    self._ready.set_result(None)
                await self._wake.wait()
                if not self._closed:
                    self._tell(f"{self.name}: QTM went away.")
            except StreamError as error:
                if not self._ready.done():
                    raise
                self._tell(str(error))
            finally:
                if connection is not None and connection.has_transport():
                    connection.disconnect()
            if not self._closed:
                with suppress(TimeoutError):
                    self._wake.clear()
                    await asyncio.wait_for(self._wake.wait(), _AGAIN)

    async def _connect(self) -> Any:
        """Connect and let frames flow."""
        connection = await self._call()
        try:
            settings = await connection.get_parameters(["general", "3d"])
            labels, rate = _read_settings(settings, self.name)
            if self._ready.done() and (labels, rate) != (self.labels, self.rate):
                raise StreamError(
                    f"{self.name}: QTM has other markers or another rate than before "
                    "and is not read."
                )
            self.labels, self.rate = labels, rate
            await connection.stream_frames(components=["3d"], on_packet=self._take)
        except TimeoutError:
            connection.disconnect()
            raise StreamError(
                f"{self.name}: QTM sends no frames within {self._timeout:g} s; start a "
                "measurement or real-time output in QTM."
            ) from None
        except self._qtm.QRTCommandException as error:
            connection.disconnect()
            raise StreamError(f"{self.name}: QTM answered {error}.") from None
        except StreamError:
            connection.disconnect()
            raise
        return connection

    async def _call(self) -> Any:
        """Connect as ``qtm_rt.connect`` does, which forgets a socket on a time-out."""
        made: list[Any] = []  # known even when the rest fails

        def protocol() -> Any:
            made.append(
                self._qtm.protocol.QTMProtocol(
                    on_disconnect=lambda error: self._wake.set()
                )
            )
            return made[0]

        try:
            async with asyncio.timeout(self._timeout):
                loop = asyncio.get_running_loop()
                await loop.create_connection(protocol, self._host, self._port)
                await made[0].set_version(_VERSION)
        except (OSError, self._qtm.QRTCommandException) as error:
            if made and made[0].transport is not None:
                made[0].transport.close()
            if isinstance(error, OSError):  # refused, no such host, or a time-out
                raise StreamError(self._no_answer()) from None
            raise StreamError(f"{self.name}: QTM answered {error}.") from None
        return self._qtm.QRTConnection(made[0], timeout=self._timeout)

    def _take(self, packet: Any) -> None:
        received = time.monotonic()
        component = packet.get_3d_markers()
        if component is None:
            return
        header, positions = component
        if len(positions) != len(self.labels):
            self._tell(
                f"{self.name}: expected {len(self.labels)} markers in a frame, found "
                f"{len(positions)}."
            )
            return
        for key, per_mille in (
            ("drop_rate", header.drop_rate),
            ("out_of_sync_rate", header.out_of_sync_rate),
        ):
            self._rates[key] = 1e-3 * per_mille
            largest = f"largest_{key}"
            self._rates[largest] = max(self._rates[largest], self._rates[key])
        self._inbox.put(
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
    rate = float(settings.findtext("./General/Frequency", "0"))
    if not labels:
        raise StreamError(
            f"{source}: expected labeled markers, found none; load an AIM model in QTM."
        )
    if not rate > 0:
        raise StreamError(
            f"{source}: expected a rate above 0 frames/s, found {rate:g}."
        )
    return labels, rate
