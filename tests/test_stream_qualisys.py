"""Qualisys: the unmodified client of qtm-rt against a server that speaks its bytes."""

import math
import threading
import time
from typing import Any

import numpy as np
import pytest
from qtm_server import QtmServer

from ikns.errors import StreamError
from ikns.live.stream import Frame, Source, open_source

LABELS = ["RSHO", "RELB", "RWRA"]
RNG = np.random.default_rng(5)
MARKERS = RNG.normal(size=(40, 3, 3))
MARKERS[7, 1] = np.nan


def opened(server: QtmServer) -> Source:
    """Open a source; the first frame goes out as soon as it is asked for."""

    def first() -> None:
        server.streaming.wait(10)
        server.send(100, 5_000_000, MARKERS[0])

    sender = threading.Thread(target=first)
    sender.start()
    source = open_source(f"qualisys:127.0.0.1:{server.port}?timeout=10")
    sender.join()
    return source


def read(source: Source, n: int) -> list[Frame]:
    frames = [source.read(10.0) for _ in range(n)]
    return [frame for frame in frames if frame is not None]


def test_frames_arrive_with_number_time_markers_and_what_the_cameras_lost() -> None:
    with QtmServer(LABELS) as server, opened(server) as source:
        for k in range(1, 40):
            lost = 250 if k == 20 else 0
            server.send(100 + k, 5_000_000 + 10_000 * k, MARKERS[k], drop_rate=lost,
                        out_of_sync_rate=lost // 50)  # fmt: skip
        frames = read(source, 40)
        assert source.labels == tuple(LABELS)
        assert source.rate == 100
        assert source.device["largest_drop_rate"] == 0.25
        assert source.device["largest_out_of_sync_rate"] == 0.005
        assert source.device["drop_rate"] == 0
        assert source.device["overruns"] == 0
    assert [f.number for f in frames] == list(range(100, 140))
    times = [f.device_time for f in frames]
    np.testing.assert_allclose(times, 5 + 0.01 * np.arange(40), rtol=1e-12)
    # QTM sends millimeters in 32 bits: half a unit in the last place of 1e3 * |m|.
    found = np.array([f.markers for f in frames])
    np.testing.assert_allclose(found, MARKERS, rtol=6e-8)
    assert server.asked[0] == "version 1.25"
    assert source.continuity.counts.dropped == 0


def test_zeros_are_a_marker_that_was_not_seen() -> None:
    markers = MARKERS[1].copy()
    markers[2] = 0.0
    markers[0, :2] = 0.0  # on the axis of the laboratory, but seen
    with QtmServer(LABELS) as server, opened(server) as source:
        server.send(101, 5_010_000, markers)
        _, frame = read(source, 2)
    seen = np.isfinite(frame.markers).all(axis=1)
    assert seen.tolist() == [True, True, False]


def test_frames_that_qtm_leaves_out_are_counted() -> None:
    with QtmServer(LABELS) as server, opened(server) as source:
        for k in (1, 2, 5, 6, 6, 9):
            server.send(100 + k, 5_000_000 + 10_000 * k, MARKERS[k])
        assert len(read(source, 7)) == 7
        counts = source.continuity.counts
    assert (counts.received, counts.dropped, counts.repeated) == (7, 4, 1)


def test_a_connection_that_breaks_is_reported_and_made_again() -> None:
    with QtmServer(LABELS) as server, opened(server) as source:
        assert len(read(source, 1)) == 1
        server.hang_up()
        assert server.streaming.wait(20)
        server.send(150, 5_500_000, MARKERS[1])
        assert read(source, 1)[0].number == 150
        told = [event.text for event in source.events]
    assert any(text.endswith("QTM disconnected.") for text in told)
    assert source.continuity.counts.dropped == 49


def test_other_markers_after_a_break_are_not_read() -> None:
    with QtmServer(LABELS) as server, opened(server) as source:
        assert len(read(source, 1)) == 1
        server.labels = ["OTHER", "RELB", "RWRA"]
        server.hang_up()
        give_up = time.monotonic() + 20
        while not any("different markers" in event.text for event in source.events):
            assert time.monotonic() < give_up
            assert source.read(0.05) is None


def test_a_reader_that_sleeps_loses_the_oldest_and_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("ikns.live.stream.client_thread._INBOX", 10)
    with QtmServer(LABELS) as server, opened(server) as source:
        for k in range(1, 40):
            server.send(100 + k, 5_000_000 + 10_000 * k, MARKERS[k])
        give_up = time.monotonic() + 20
        while source.device["overruns"] < 30:
            assert time.monotonic() < give_up
            time.sleep(0.01)
        assert [f.number for f in read(source, 10)] == list(range(130, 140))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"labels": []}, "expected labeled markers, found none"),
        ({"rate": 0}, "rate above 0"),
        ({}, "sends no frames within 0.3 s"),
        ({"mute": True}, "answer at 127.0.0.1:{port} within 0.3 s"),
        ({"rate": math.nan}, "rate above 0"),
    ],
)
def test_a_server_without_what_is_needed_is_refused(
    options: dict[str, Any], says: str
) -> None:
    server = QtmServer(**{"labels": LABELS, **options})
    with server, pytest.raises(StreamError) as refused:
        open_source(f"qualisys:127.0.0.1:{server.port}?timeout=0.3")
    assert says.format(port=server.port) in str(refused.value)
    assert str(refused.value).startswith(f"qualisys:127.0.0.1:{server.port}: ")


def test_a_port_where_no_one_listens_is_refused() -> None:
    with QtmServer(LABELS) as server:
        port = server.port
    with pytest.raises(StreamError, match=f"answer at 127.0.0.1:{port}, found no pro"):
        open_source(f"qualisys:127.0.0.1:{port}?timeout=1")
