"""OptiTrack: the feed and the library natnet against a server that speaks NatNet."""

import socket
import threading
import time
from typing import Any

import natnet
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from natnet_server import FILLED, OCCLUDED, POINT_CLOUD, NatNetServer

from ikns.errors import StreamError
from ikns.live.stream import Frame, Source, open_source
from ikns.live.stream.natnet_packets import Models, ServerFacts, split_message

LABELS = ["RSHO", "RELB", "RWRA"]
ARM = {"Ann": LABELS}
MARKERS = np.random.default_rng(6).normal(size=(40, 3, 3)).astype(np.float32)


def opened(server: NatNetServer, *, host: str = "127.0.0.1") -> Source:
    """Open a source; the first frame goes out once everything was asked."""

    def first() -> None:
        server.streaming.wait(10)
        give_up = time.monotonic() + 10
        while not ready.wait(0.05) and time.monotonic() < give_up:
            server.send(100, 5.0, MARKERS[0])

    ready = threading.Event()
    sender = threading.Thread(target=first)
    sender.start()
    try:
        return open_source(f"natnet:{host}:{server.port}?timeout=10")
    finally:
        ready.set()
        sender.join()


def read(source: Source, n: int) -> list[Frame]:
    """Return n frames after the first, of which there may be several."""
    frames: list[Frame] = []
    while len(frames) < n:
        frame = source.read(10.0)
        assert frame is not None
        frames += [frame] * (frame.number > 100)
    return frames


@pytest.mark.parametrize("version", [(3, 1), (4, 0), (4, 1)])
def test_frames_arrive_with_number_time_markers_and_latency(
    version: tuple[int, int],
) -> None:
    bodies = ["Table", "Wand"]
    with NatNetServer(ARM, version=version, bodies=bodies) as server:
        with opened(server) as source:
            for k in range(1, 40):
                late = 0.007 if k == 20 else 0.004
                server.send(100 + k, 5 + 0.01 * k, MARKERS[k], latency=late)
            frames = read(source, 39)
            assert source.labels == tuple(LABELS)
            assert source.rate == 100
            # Ticks of 1e-7 s.
            assert source.device["latency"] == pytest.approx(0.004, abs=1e-7)
            assert source.device["largest_latency"] == pytest.approx(0.007, abs=1e-7)
            assert source.device["overruns"] == 0
    assert [f.number for f in frames] == list(range(101, 140))
    times = [f.device_time for f in frames]
    np.testing.assert_allclose(times, 5 + 0.01 * np.arange(1, 40), rtol=1e-15)
    # Meters in 32 bits, as sent.
    np.testing.assert_array_equal([f.markers for f in frames], MARKERS[1:])
    assert source.continuity.counts.dropped == 0


def test_what_motive_did_not_measure_is_not_seen() -> None:
    flags = [POINT_CLOUD, OCCLUDED, POINT_CLOUD | FILLED]
    gone = MARKERS[2].copy()
    gone[0] = 0.0
    with NatNetServer(ARM) as server, opened(server) as source:
        server.send(101, 5.01, MARKERS[1], flags=flags)
        server.send(102, 5.02, gone)
        seen = [np.isfinite(f.markers).all(axis=1).tolist() for f in read(source, 2)]
    assert seen == [[True, False, False], [False, True, True]]


def test_several_sets_have_their_names_before_the_markers() -> None:
    with NatNetServer({"Ann": LABELS[:2], "Bob": LABELS[2:]}) as server:
        with opened(server) as source:
            assert source.labels == ("Ann:RSHO", "Ann:RELB", "Bob:RWRA")


def test_frames_that_are_lost_are_counted() -> None:
    with NatNetServer(ARM) as server, opened(server) as source:
        for k in (1, 2, 5, 6, 6, 9):
            server.send(100 + k, 5 + 0.01 * k, MARKERS[k])
        read(source, 6)
        counts = source.continuity.counts
    # The first frame may have come more than once.
    assert counts.dropped == 4
    assert counts.repeated >= 1


def test_a_server_that_sends_to_a_group_is_heard() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("", 0))
        port = free.getsockname()[1]
    with NatNetServer(ARM, group="239.255.42.99", data_port=port) as server:
        with opened(server) as source:
            server.send(101, 5.01, MARKERS[1])
            np.testing.assert_array_equal(read(source, 1)[0].markers, MARKERS[1])
            # Another server sends to the same group.
            with NatNetServer(
                ARM, group=server.group, data_port=port, host="127.0.0.9"
            ) as other:
                other.send(102, 5.02, MARKERS[2])
                server.send(103, 5.03, MARKERS[3])
                assert read(source, 1)[0].number == 103
            told = [event.text for event in source.events]
    assert any("another server at 127.0.0.9" in text for text in told)


def test_a_server_that_goes_away_is_reported_and_found_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("ikns.live.stream.natnet._SILENCE", 0.3)
    with NatNetServer(ARM) as server:
        source = opened(server)
        port = server.port
    with source, NatNetServer(ARM, port=port) as server:
        assert server.streaming.wait(20)
        give_up = time.monotonic() + 20
        frame = None
        while frame is None or frame.number != 150:
            assert time.monotonic() < give_up
            server.send(150, 5.5, MARKERS[1])
            frame = source.read(0.1)
        told = " ".join(event.text for event in source.events)
    assert "the server disconnected." in told


def test_a_change_that_leaves_the_markers_as_they_were_is_survived() -> None:
    with NatNetServer(ARM) as server, opened(server) as source:
        server.send(101, 5.01, MARKERS[1])
        read(source, 1)
        server.bodies = ["Wand"]
        server.send(102, 5.02, MARKERS[2], changed=True)
        give_up = time.monotonic() + 20
        frame = None
        while frame is None or frame.number < 103:
            assert time.monotonic() < give_up
            server.send(103, 5.03, MARKERS[3], changed=True)
            frame = source.read(0.05)
        np.testing.assert_array_equal(frame.markers, MARKERS[3])
        assert not source.events


def test_models_that_change_are_not_read_under_the_old_names() -> None:
    with NatNetServer(ARM) as server, opened(server) as source:
        server.send(101, 5.01, MARKERS[1])
        read(source, 1)
        server.sets = {"Ann": ["OTHER", *LABELS[1:]]}
        server.send(102, 5.02, MARKERS[2], changed=True)
        give_up = time.monotonic() + 20
        while not any("different markers" in event.text for event in source.events):
            assert time.monotonic() < give_up
            assert source.read(0.05) is None


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"sets": {}}, "expected labeled markers, found unlabeled markers only"),
        ({"sets": {}, "bodies": ["Wand"]}, "found rigid bodies only (Wand)"),
        ({"version": (2, 9)}, "expected NatNet 3 or 4, found version 2.9.0.0 of Moti"),
        ({"version": (5, 0)}, "expected NatNet 3 or 4, found version 5.0.0.0 of Moti"),
        ({"rate": 0}, "rate above 0"),
        ({}, "sends no frames within 0.3 s"),
        ({"mute": True}, "a NatNet server to answer at 127.0.0.1:{port} within 0.3 s"),
    ],
)
def test_a_server_without_what_is_needed_is_refused(
    options: dict[str, Any], says: str
) -> None:
    with NatNetServer(**{"sets": ARM, **options}) as server:
        with pytest.raises(StreamError) as refused:
            open_source(f"natnet:127.0.0.1:{server.port}?timeout=0.3")
    assert says.format(port=server.port) in str(refused.value)
    assert str(refused.value).startswith(f"natnet:127.0.0.1:{server.port}: ")
    assert str(refused.value).count(". ") == 0


def test_no_server_and_two_servers_are_refused() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(StreamError, match=f"answer at 127.0.0.1:{port} within 0.3 s"):
        open_source(f"natnet:127.0.0.1:{port}?timeout=0.3")
    ends = {"listen": "", "port": port}
    with NatNetServer(ARM, host="127.0.0.2", **ends):
        with NatNetServer(ARM, host="127.0.0.3", **ends):
            with pytest.raises(StreamError) as refused:
                open_source(f"natnet:127.255.255.255:{port}?timeout=5")
    assert "found 2: 127.0.0.2 and 127.0.0.3; choose one" in str(refused.value)


@given(st.binary(max_size=200))
def test_noise_is_no_message_or_is_all_there(noise: bytes) -> None:
    number, content = split_message(noise)
    assert number == -1 or len(noise) == 4 + len(content)


PARTS = NatNetServer(ARM, bodies=["Wand"], port=0)
WHOLE = {
    "frame": PARTS.frame(1, 5.0, MARKERS[0], [], 0.004, changed=False),
    "models": PARTS._models(),
    "info": PARTS._info(),
}
PARTS._listening.close()


@given(st.data(), st.sampled_from(sorted(WHOLE)))
def test_damage_ends_in_a_sentence_or_in_numbers(data: Any, part: str) -> None:
    whole = bytearray(WHOLE[part])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(whole) - 4))
        whole[place : place + 4] = data.draw(st.binary(min_size=4, max_size=4))
    damaged = bytes(whole[: data.draw(st.integers(0, len(whole)))])
    four = natnet.Version(4, 1, 0, 0)
    try:
        if part == "info":
            ServerFacts(natnet, damaged, "natnet:x")
        elif part == "models":
            assert Models(natnet, damaged, four, "natnet:x").labels
        else:
            models = Models(natnet, WHOLE["models"], four, "natnet:x")
            assert models.frame(damaged)[1].shape == (3, 3)
    except StreamError as error:
        refused = "models and info", str(error)
    except ValueError as error:
        refused = "frame", f"natnet:x: {error}."
    else:
        return
    assert part in refused[0]
    assert refused[1].startswith("natnet:x: ")
    assert refused[1].endswith(".")


def test_damaged_frames_are_told_and_left_out() -> None:
    with NatNetServer(ARM) as server, opened(server) as source:
        whole = server.frame(101, 5.01, MARKERS[1], [], 0.004, changed=False)
        for cut in range(0, len(whole), 7):
            packet = len(whole[:cut]).to_bytes(2, "little") + whole[:cut]
            server._out.sendto(b"\x07\0" + packet, server._client)
        server.send(102, 5.02, MARKERS[2])
        frames = read(source, 1)
    # Cut off behind what is read (the last four bytes mark the end), it is whole.
    assert frames[0].number in (101, 102)
    np.testing.assert_array_equal(frames[0].markers, MARKERS[frames[0].number - 100])
    assert any("a frame is not read" in event.text for event in source.events)
