"""Vicon's DataStream as a live source, through the vendor's SDK.

The SDK is not on PyPI and was not available: the calls follow the vendor's examples and
were tested against a stand-in only. GetFrame blocks, so it has a thread of its own.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ikns.errors import StreamError
from ikns.live.stream.client_feed import ClientFeed
from ikns.live.stream.client_thread import RECONNECT, ClientThread
from ikns.live.stream.frame import Frame
from ikns.live.stream.optional import load_client

#: Port of the DataStream.
PORT = 801

_REMEDY = (
    "install Vicon's DataStream SDK from vicon.com, then pip install the folder "
    "Python/vicon_dssdk inside it"
)
_SDK_BUFFER = 100  # frames that the SDK buffers


class ViconFeed(ClientFeed):
    """Read the labeled markers of all subjects, as ``subject:marker``.

    Frames carry no camera time, so the device time is the frame number over the rate.

    Parameters
    ----------
    host : str
    port : int
    timeout : float
        Seconds for Vicon to answer and to send a first frame.

    Attributes
    ----------
    device : dict
        ``latency``, s from exposure to sending as Vicon reports it; ``overruns``,
        frames lost because they were not read.

    Raises
    ------
    StreamError
        When the SDK is not installed, Vicon does not answer or sends no frames, or
        there is no labeled marker or no rate.
    """

    def __init__(self, host: str, port: int = PORT, *, timeout: float = 5.0) -> None:
        name = f"vicon:{host}" + (f":{port}" if port != PORT else "")
        self._sdk = load_client(
            "vicon_dssdk.ViconDataStream", needed_by=name, remedy=_REMEDY
        )
        self._address = f"{host}:{port}"
        super().__init__(ClientThread(name, "Vicon", self._address, timeout))
        self._latency = 0.0
        self._markers: list[tuple[str, str]] = []
        self._start(self._serve, timeout=2 * timeout + 1)

    @property
    def device(self) -> dict[str, float]:
        """What Vicon reports, and overruns."""
        return {"latency": self._latency} | super().device

    def close(self) -> None:
        """Disconnect as soon as the SDK returns."""
        self._client.close()

    def _serve(self) -> None:
        while not self._client.closed:
            try:
                self._session()
            except StreamError as error:
                if not self._client.connected:
                    raise
                self._client.add_event(str(error))
            if not self._client.closed:
                time.sleep(RECONNECT)

    def _session(self) -> None:
        """Connect and read until the connection ends."""
        client = self._sdk.Client()
        try:
            client.Connect(self._address)
        except self._sdk.DataStreamException:
            raise self._client.no_answer() from None
        try:
            kind = type(client)
            client.SetBufferSize(_SDK_BUFFER)
            client.EnableMarkerData()
            client.SetStreamMode(kind.StreamMode.EServerPush)
            axes = kind.AxisMapping  # x forward, y left, z up, as Vicon's files
            client.SetAxisMapping(axes.EForward, axes.ELeft, axes.EUp)
            self._wait_for_frame(client)
            self._read_labels(client)
            self._client.set_connected()
            self._receive(client)
            while not self._client.closed and client.IsConnected():
                if self._next_frame(client):
                    self._receive(client)
            if not self._client.closed:
                self._client.add_event(f"{self.name}: Vicon disconnected.")
        finally:
            client.Disconnect()

    def _next_frame(self, client: Any) -> bool:
        try:
            return bool(client.GetFrame())
        except self._sdk.DataStreamException:  # no frame yet, or disconnected
            time.sleep(1e-3)
            return False

    def _wait_for_frame(self, client: Any) -> None:
        give_up = time.monotonic() + self._client.timeout
        while not self._next_frame(client):
            if self._client.closed or time.monotonic() > give_up:
                raise StreamError(
                    f"{self.name}: Vicon sends no frames within "
                    f"{self._client.timeout:g} s; put Nexus or Tracker into live mode."
                )

    def _read_labels(self, client: Any) -> None:
        markers = [
            (subject, marker)
            for subject in client.GetSubjectNames()
            for marker, _ in client.GetMarkerNames(subject)
        ]
        self._client.set_stream(
            tuple(f"{subject}:{marker}" for subject, marker in markers),
            float(client.GetFrameRate()),
            if_unlabeled="enable a subject",
        )
        self._markers = markers

    def _receive(self, client: Any) -> None:
        received = time.monotonic()
        number = int(client.GetFrameNumber())
        markers = np.full((len(self._markers), 3), np.nan)
        for i, (subject, marker) in enumerate(self._markers):
            try:
                position, occluded = client.GetMarkerGlobalTranslation(subject, marker)
            except self._sdk.DataStreamException:
                self._client.add_event(
                    f"{self.name}: marker {subject}:{marker} is gone."
                )
                continue
            if not occluded:
                markers[i] = position
        self._latency = float(client.GetLatencyTotal())
        self._client.inbox.put(
            Frame(number, number / self._client.rate, received, 1e-3 * markers)
        )
