"""Vicon's DataStream as a live source, through the vendor's own SDK.

The SDK is not on PyPI and was not at hand: the calls follow the vendor's examples and
were tried against a stand-in only. GetFrame blocks, so it has a thread of its own.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotInTime
from typing import Any

import numpy as np

from ikns.errors import StreamError
from ikns.live.stream.frame import Event, Frame
from ikns.live.stream.inbox import Inbox
from ikns.live.stream.optional import bring_in

__all__ = ["PORT", "ViconFeed"]

#: Where Vicon's programs serve the DataStream.
PORT = 801

_REMEDY = (
    "install Vicon's DataStream SDK from vicon.com, then pip install the folder "
    "Python/vicon_dssdk inside it"
)
_AGAIN = 0.5  # seconds between attempts to connect
_INBOX = 1000  # frames
_SDK_BUFFER = 100  # frames that the SDK keeps for us; we empty it at once


class ViconFeed:
    """Read the labeled markers of all subjects, as ``subject:marker``.

    Frames carry no time of the cameras; the device time is frame number over rate.

    Parameters
    ----------
    host : str
    port : int
    timeout : float
        Seconds for Vicon to answer and to send a first frame.

    Attributes
    ----------
    device : dict
        ``latency``, seconds from exposure to sending as Vicon reports it; ``overruns``,
        frames forgotten because nobody read them.

    Raises
    ------
    StreamError
        When the SDK is not installed, Vicon does not answer or sends no frames, or
        there is no labeled marker or no rate.
    """

    speed = 1.0

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        self.name = f"vicon:{host}" + (f":{port}" if port != PORT else "")
        self._sdk = bring_in(
            "vicon_dssdk.ViconDataStream", needed_by=self.name, remedy=_REMEDY
        )
        self._address, self._timeout = f"{host}:{port}", timeout
        self.events: deque[Event] = deque(maxlen=1000)
        self.labels: tuple[str, ...] = ()
        self.rate = self._latency = 0.0
        self._places: list[tuple[str, str]] = []
        self._inbox = Inbox(_INBOX)
        self._closed = False
        self._told = ""
        self._ready: Future[None] = Future()
        threading.Thread(target=self._work, daemon=True).start()
        try:
            self._ready.result(2 * timeout + 1)
        except NotInTime:  # the SDK's Connect knows no time-out
            self.close()
            raise StreamError(self._no_answer()) from None
        except BaseException:
            self.close()
            raise

    @property
    def ended(self) -> bool:
        """Whether it was closed; Vicon may come back."""
        return self._closed

    @property
    def device(self) -> dict[str, float]:
        """What Vicon reports of itself, and overruns."""
        return {"latency": self._latency, "overruns": float(self._inbox.overruns)}

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, None after `timeout` seconds."""
        return self._inbox.get(timeout)

    def close(self) -> None:
        """Disconnect, as soon as the SDK hands back control."""
        self._closed = True
        self._inbox.close()

    def _no_answer(self) -> str:
        return (
            f"{self.name}: expected Vicon to answer at {self._address} within "
            f"{self._timeout:g} s, found no answer."
        )

    def _tell(self, text: str) -> None:
        if text != self._told:  # an attempt that fails again and again is told once
            self._told = text
            self.events.append(Event(time.monotonic(), text))

    def _work(self) -> None:
        try:
            while not self._closed:
                try:
                    self._session()
                except StreamError as error:
                    if not self._ready.done():
                        raise
                    self._tell(str(error))
                if not self._closed:
                    time.sleep(_AGAIN)
        except Exception as error:  # whatever it is, the reader must hear of it
            if not self._ready.done():
                self._ready.set_exception(error)
            self._tell(f"{self.name}: stopped reading ({error}).")
            self.close()

    def _session(self) -> None:
        """Connect and read until the connection ends."""
        client = self._sdk.Client()
        try:
            client.Connect(self._address)
        except self._sdk.DataStreamException:
            raise StreamError(self._no_answer()) from None
        try:
            kind = type(client)
            client.SetBufferSize(_SDK_BUFFER)
            client.EnableMarkerData()
            client.SetStreamMode(kind.StreamMode.EServerPush)
            axes = kind.AxisMapping  # x forward, y left, z up, as Vicon's files
            client.SetAxisMapping(axes.EForward, axes.ELeft, axes.EUp)
            self._wait_for_frame(client)
            self._read_labels(client)
            if self._ready.done():
                self._tell(f"{self.name}: Vicon is back.")
            else:
                self._ready.set_result(None)
            self._take(client)
            while not self._closed and client.IsConnected():
                if self._next_frame(client):
                    self._take(client)
            if not self._closed:
                self._tell(f"{self.name}: Vicon went away.")
        finally:
            client.Disconnect()

    def _next_frame(self, client: Any) -> bool:
        try:
            return bool(client.GetFrame())
        except self._sdk.DataStreamException:  # no frame yet, or disconnected
            time.sleep(1e-3)
            return False

    def _wait_for_frame(self, client: Any) -> None:
        give_up = time.monotonic() + self._timeout
        while not self._next_frame(client):
            if self._closed or time.monotonic() > give_up:
                raise StreamError(
                    f"{self.name}: Vicon sends no frames within {self._timeout:g} s; "
                    "put Nexus or Tracker into live mode."
                )

    def _read_labels(self, client: Any) -> None:
        places = [
            (subject, marker)
            for subject in client.GetSubjectNames()
            for marker, _ in client.GetMarkerNames(subject)
        ]
        labels = tuple(f"{subject}:{marker}" for subject, marker in places)
        rate = float(client.GetFrameRate())
        if not labels:
            raise StreamError(
                f"{self.name}: expected labeled markers, found none; enable a subject."
            )
        if not rate > 0:
            raise StreamError(
                f"{self.name}: expected a rate above 0 frames/s, found {rate:g}."
            )
        if self._ready.done() and (labels, rate) != (self.labels, self.rate):
            raise StreamError(
                f"{self.name}: Vicon has other markers or another rate than before and "
                "is not read."
            )
        self._places, self.labels, self.rate = places, labels, rate

    def _take(self, client: Any) -> None:
        received = time.monotonic()
        number = int(client.GetFrameNumber())
        markers = np.full((len(self._places), 3), np.nan)
        for i, (subject, marker) in enumerate(self._places):
            try:
                position, occluded = client.GetMarkerGlobalTranslation(subject, marker)
            except self._sdk.DataStreamException:
                self._tell(f"{self.name}: marker {subject}:{marker} is gone.")
                continue
            if not occluded:
                markers[i] = position
        self._latency = float(client.GetLatencyTotal())
        self._inbox.put(Frame(number, number / self.rate, received, 1e-3 * markers))
