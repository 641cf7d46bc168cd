"""LSL: a recording sent over the loopback arrives as it was, faults and all."""

import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from ikns.errors import StreamError
from ikns.live.stream import (
    Broadcast,
    Faults,
    Frame,
    LslOutlet,
    Source,
    broadcast,
    open_source,
)
from ikns.live.stream.lsl_layout import read_lsl_layout
from ikns.live.stream.lsl_library import lsl, lsl_settings
from ikns.live.stream.lsl_search import ANY_MOCAP
from ikns.recording.recording import Recording


def recording(n: int, rate: float = 200.0) -> Recording:
    rng = np.random.default_rng(n)
    markers = rng.normal(size=(n, 4, 3))
    markers[rng.random((n, 4)) < 0.2] = np.nan
    labels = ["RSHO", "RELB", "RWRA", "C7"]
    return Recording(np.arange(n) / rate, markers, labels)


@pytest.fixture
def name() -> str:
    """Name that only this test uses."""
    return f"test-{uuid.uuid4().hex[:8]}"


def opened(name: str, **options: float) -> Source:
    return open_source(f"lsl:{name}?scope=machine&timeout=10", **options)


@contextmanager
def playing(
    there: Recording, outlet: LslOutlet, faults: str = ""
) -> Iterator[list[Broadcast]]:
    """Play in the background from the first listener on."""
    done: list[Broadcast] = []

    def play() -> None:
        if outlet.wait_for_listener(20):
            done.append(broadcast(there, outlet, faults=Faults.parse(faults), seed=3))

    player = threading.Thread(target=play)
    player.start()
    yield done
    player.join()


def until_broken_off(source: Source) -> list[Frame]:
    frames = []
    while not source.events:
        frame = source.read(0.05)
        if frame is not None:
            frames.append(frame)
    return frames


def test_a_recording_arrives_as_it_was_sent(name: str) -> None:
    there = recording(100)
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with playing(there, outlet), opened(name) as source:
            frames = [next(source) for _ in range(100)]
    np.testing.assert_array_equal([f.markers for f in frames], there.markers)
    assert [f.number for f in frames] == list(range(100))
    steps = np.diff([f.device_time for f in frames])
    # Stamps are sums near the machine's uptime, 1e8 s at most: 2e-8 s each.
    np.testing.assert_allclose(steps, 1 / there.rate, atol=4e-8)
    assert source.labels == there.labels
    assert source.rate == pytest.approx(there.rate)
    counts = source.continuity.counts
    assert (counts.received, counts.dropped, counts.repeated) == (100, 0, 0)
    # No frame is received before it was sent; the offset of the clocks is known to
    # half a round trip, which LSL takes only when it is below 128 ms.
    offset = source.device["clock_offset"]
    assert min(f.receive_time - f.device_time - offset for f in frames) > -0.064


def test_frames_that_nobody_read_are_skipped_and_not_counted(name: str) -> None:
    there = recording(30)
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with opened(name) as source:
            outlet.push(there.markers[0])
            assert next(source).number == 0
            start = time.monotonic()
            for k in range(1, 25):
                outlet.push(there.markers[k], start + k / there.rate)
            inlet, give_up = source._feed._open.inlet, time.monotonic() + 20
            while inlet.samples_available() < 24:
                assert time.monotonic() < give_up
                time.sleep(0.01)
            source.skip()
            outlet.push(there.markers[25], start + 25 / there.rate)
            np.testing.assert_array_equal(next(source).markers, there.markers[25])
            counts = source.continuity.counts
    assert (counts.received, counts.dropped, counts.repeated) == (2, 0, 0)


def test_what_is_struck_is_counted(name: str) -> None:
    there = recording(300, rate=500)
    faults = "drop=0.05,repeat=0.05,swap=0.05,freeze=0.01:0.02,late=0.005:0.1"
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with opened(name) as source:
            with playing(there, outlet, faults) as done:
                pass
            # All is in the inlet's buffer now, so lateness shows nothing here.
            counts = _drained(source, done)
    struck = done[0].faults
    assert all(struck[kind] for kind in Faults.KINDS)
    assert counts.dropped == struck["drop"]
    assert counts.repeated == struck["repeat"]
    assert counts.out_of_order == struck["swap"]
    assert counts.frozen == struck["freeze"]
    assert counts.received == done[0].frames


def _drained(source: Source, done: list[Broadcast]) -> Any:
    for _ in range(done[0].frames):
        next(source)
    assert source.read(0.05) is None
    return source.continuity.counts


def test_frames_held_up_are_late(name: str) -> None:
    there = recording(100)
    faults = "late=0.02:0.3"
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with opened(name, late_after=0.15) as source:
            with playing(there, outlet, faults) as done:
                for _ in range(100):
                    next(source)
    assert done[0].faults["late"]
    assert source.continuity.counts.late >= done[0].faults["late"]
    assert source.continuity.counts.jitter["largest"] >= 0.15


def test_a_stream_that_breaks_off_is_reported_and_found_again(name: str) -> None:
    there = recording(5)
    outlet = LslOutlet(there.labels, there.rate, name=name)
    with opened(name) as source:
        outlet.push(there.markers[0])
        assert next(source).number == 0
        outlet.close()
        assert until_broken_off(source) == []
        assert source.events[0].text.endswith("the stream was interrupted.")
        with LslOutlet(there.labels, there.rate, name=name) as outlet:
            assert outlet.wait_for_listener(20)
            give_up = time.monotonic() + 20
            frame = None
            while frame is None:
                assert time.monotonic() < give_up
                outlet.push(there.markers[1])
                frame = source.read(0.05)
    np.testing.assert_array_equal(frame.markers, there.markers[1])
    told = " ".join(event.text for event in source.events)
    assert "the stream is back." in told
    # The break lasted longer than a frame: what was missed meanwhile is counted.
    assert source.continuity.counts.dropped == frame.number - 1 > 0


def test_other_markers_after_a_break_are_not_read(name: str) -> None:
    there = recording(5)
    outlet = LslOutlet(there.labels, there.rate, name=name)
    with opened(name) as source:
        outlet.close()
        until_broken_off(source)
        others = ["RELB", "RSHO", "RWRA", "C7"]
        with LslOutlet(others, there.rate, name=name) as outlet:
            give_up = time.monotonic() + 20
            while not any("different markers" in event.text for event in source.events):
                assert time.monotonic() < give_up
                outlet.push(there.markers[0])
                assert source.read(0.05) is None


def vendor(
    name: str,
    channels: list[dict[str, str]],
    *,
    kind: str = "Mocap",
    rate: float = 100.0,
    form: str = "float32",
    source_id: str | None = None,
) -> Any:
    """Make an outlet as another program would."""
    pylsl = lsl("a test", this_machine=True)
    own = name if source_id is None else source_id
    info = pylsl.StreamInfo(name, kind, max(1, len(channels)), rate, form, own)
    node = info.desc().append_child("channels")
    for fields in channels:
        channel = node.append_child("channel")
        for key, value in fields.items():
            channel.append_child_value(key, value)
    return pylsl.StreamOutlet(info)


def marker(label: str, axis: str, unit: str = "meters") -> dict[str, str]:
    kind = f"Position{axis}"
    return {"label": f"{label}_{axis}", "marker": label, "type": kind, "unit": unit}


def test_channels_of_another_program_are_sorted_out(name: str) -> None:
    body = [
        {"label": f"Body_{axis}", "object": "Body", "type": f"Position{axis}",
         "unit": "meters"} for axis in "XYZ"
    ]  # fmt: skip
    turn = [{"label": "Body_P", "object": "Body", "type": "OrientationP"}]
    channels = [
        marker("B", "Z"), *body, marker("A", "X", "millimeters"), *turn,
        marker("B", "X"), marker("A", "Z", "mm"), marker("A", "Y", "mm"),
        {"label": "B_y", "type": "positiony", "unit": "m"},
    ]  # fmt: skip
    outlet = vendor(name, channels)
    with opened(name) as source:
        outlet.push_sample([3, 9, 9, 9, 10, 8, 1, 30, 20, 2], 50.0)
        frame = next(source)
        outlet.push_sample([3, 9, 9, 9, 10, 8, 1, 30, 20, float("nan")], 50.01)
        hidden = next(source)
        assert source.labels == ("B", "A")
    np.testing.assert_allclose(
        frame.markers, [[1, 2, 3], [0.010, 0.020, 0.030]], rtol=1e-15
    )
    assert frame.device_time == 50.0
    # As in files: a point with a missing coordinate was not seen.
    assert np.isnan(hidden.markers).all(axis=1).tolist() == [True, False]


AXES = [marker("A", axis) for axis in "XYZ"]


@pytest.mark.parametrize(
    ("channels", "says"),
    [
        ([], "PositionX, PositionY and PositionZ with marker names, found no descr"),
        ([{"label": "Fz", "type": "Force"}], "found Force"),
        (AXES[:2], "PositionX, PositionY and PositionZ of marker A, found only x, y"),
        ([*AXES, AXES[0]], "one PositionX channel for marker A, found two"),
        (
            [*AXES[:2], marker("A", "Z", "feet")],
            "mm, cm or m for channel A_Z, found f",
        ),
        (
            [*AXES[:2], marker("A", "Z", "")],
            "found none; say which it is with the op",
        ),
    ],
)
def test_a_description_without_markers_is_refused(
    channels: list[dict[str, str]], says: str
) -> None:
    inside = "".join(
        "<channel>" + "".join(f"<{k}>{v}</{k}>" for k, v in c.items()) + "</channel>"
        for c in channels
    )
    xml = f"<info><desc><channels>{inside}</channels></desc></info>"
    with pytest.raises(StreamError) as refused:
        read_lsl_layout(xml, "lsl:x")
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("said", "option", "meters"),
    [
        ("centimetres", None, 0.01),
        ("", "mm", 1e-3),
        ("", "m", 1.0),
        ("meters", "cm", 0.01),  # the option counts, where the description is wrong
        ("furlongs", "mm", 1e-3),
    ],
)
def test_a_unit_is_that_of_the_option_or_of_the_description(
    said: str, option: str | None, meters: float
) -> None:
    channels = "".join(
        "<channel>"
        + "".join(f"<{k}>{v}</{k}>" for k, v in marker("A", axis, said).items())
        + "</channel>"
        for axis in "XYZ"
    )
    layout = read_lsl_layout(f"<info>{channels}</info>", "lsl:x", unit=option)
    np.testing.assert_array_equal(layout.markers(np.array([1.0, 2.0, 4.0])),
                                  [[meters, 2 * meters, 4 * meters]])  # fmt: skip


def test_a_stream_without_a_unit_is_read_with_the_option_only(name: str) -> None:
    outlet = vendor(name, [marker("A", axis, "") for axis in "XYZ"])
    with pytest.raises(StreamError, match=rf"as in lsl:{name}\?unit=mm\.$"):
        opened(name)
    with open_source(f"lsl:{name}?scope=machine&timeout=10&unit=mm") as source:
        outlet.push_sample([100.0, 200.0, 400.0], 50.0)
        np.testing.assert_allclose(next(source).markers, [[0.1, 0.2, 0.4]], rtol=1e-15)


@pytest.mark.parametrize("kind", ["MoCap", "Mocap", "MOCAP"])
def test_without_a_name_any_stream_of_the_type_is_found(name: str, kind: str) -> None:
    pylsl = lsl("a test", this_machine=True)
    outlets = [vendor(name, AXES, kind=kind), vendor(name, AXES, kind="EEG")]
    (found,) = pylsl.resolve_bypred(f"{ANY_MOCAP} and name='{name}'", 1, 10)
    assert found.type() == kind
    del outlets


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"kind": "EEG"}, "of type MoCap, found EEG"),
        ({"form": "int16"}, "channels of float32 or double64"),
    ],
)
def test_a_stream_that_does_not_fit_is_refused(
    options: dict[str, Any], says: str, name: str
) -> None:
    outlet = vendor(name, AXES, **options)
    with pytest.raises(StreamError) as refused:
        opened(name)
    assert says in str(refused.value)
    del outlet


def test_where_a_stream_is_missing_those_that_are_there_are_named(name: str) -> None:
    with LslOutlet(["A"], 100.0, name=name):
        with pytest.raises(StreamError, match=rf"within 0.3 s, found .*{name} \(MoCap"):
            open_source(f"lsl:{name}-2?scope=machine&timeout=0.3")
    with pytest.raises(StreamError, match="without one of the quotes"):
        opened("'\"")


def test_uneven_stamps_are_reported_and_no_frame_is_called_lost(name: str) -> None:
    outlet = vendor(name, AXES)
    stamps = 50 + np.array([0, 0.010, 0.034, 0.035, 0.041, 0.050])
    with opened(name) as source:
        for k, stamp in enumerate(stamps):
            outlet.push_sample([k, k, k], stamp)
        frames = [next(source) for _ in stamps]
    assert [f.number for f in frames] == [0, 1, 2, 3, 4, 5]
    assert [f.device_time for f in frames] == list(stamps)
    assert source.continuity.counts.dropped == 0
    told = [event.text for event in source.events]
    assert ["stamps are uneven" in text for text in told] == [True]


def test_a_stream_that_pauses_but_answers_is_kept(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ikns.live.stream.lsl_feed._SILENCE", 0.1)
    there = recording(5)
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with opened(name) as source:
            assert source.read(0.5) is None
            outlet.push(there.markers[0])
            assert source.read(10.0) is not None
            assert not source.events
        # Leaving is leaving: the other side sees it, if not at once.
        give_up = time.monotonic() + 20
        while outlet.has_listener:
            assert time.monotonic() < give_up
            outlet.push(there.markers[0])
            time.sleep(0.01)


def test_silence_is_reported_and_iterating_gives_up(name: str) -> None:
    there = recording(5)
    with LslOutlet(there.labels, there.rate, name=name) as outlet:
        with opened(name, read_timeout=1.2) as source:
            with pytest.raises(StreamError, match=r"no frame for 1.2 s\."):
                next(source)
            assert any("no frame for 1" in event.text for event in source.events)
            outlet.push(there.markers[0])
            assert source.read(10.0) is not None
            assert "frames resumed after" in source.events[-1].text


def test_other_machines_reach_no_port_of_the_outlet(name: str) -> None:
    with LslOutlet(["A"], 100.0, name=name) as outlet:
        assert outlet.open_ports == []
        port = data_ports(name)[0]
        assert answers(port, "127.0.0.1", "127.0.0.1")
        # From an address of this machine beside the loopback, as from another machine.
        assert not answers(port, own_address(), "127.0.0.1") or no_network()
    with LslOutlet(["A"], 100.0, name=f"{name}-open", everywhere=True):
        port = data_ports(f"{name}-open")[0]
        assert answers(port, own_address(), "127.0.0.1")


def test_nor_after_lsl_was_started_for_the_network(name: str) -> None:
    # liblsl reads its settings once, so this takes a process of its own.
    code = f"""
import test_stream_lsl as own
from ikns.live.stream import LslOutlet, open_source
from ikns.live.stream.lsl_library import lsl
lsl("a test", this_machine=False)
with LslOutlet(["A"], 100.0, name="{name}") as outlet:
    assert outlet.open_ports == []
    four, six = own.data_ports("{name}")
    assert own.answers(four, "127.0.0.1", "127.0.0.1")
    assert not own.answers(four, own.own_address(), "127.0.0.1") or own.no_network()
    assert not six or not own.answers(six, "::1", "::1")
    with open_source("lsl:{name}?timeout=10") as source:
        outlet.push([[1, 2, 3]])
        assert next(source).markers.tolist() == [[1, 2, 3]]
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def answers(port: int, source: str, target: str) -> bool:
    family = socket.AF_INET6 if ":" in source else socket.AF_INET
    with socket.socket(family) as caller:
        caller.settimeout(0.5)
        try:
            caller.bind((source, 0))
            caller.connect((target, port))
        except OSError:
            return False
        return True


def data_ports(name: str) -> tuple[int, int]:
    """Ports of a stream for IPv4 and IPv6, 0 where there is none."""
    pylsl = lsl("a test", this_machine=True)
    (info,) = pylsl.resolve_byprop("name", name, 1, 10)
    tree = ElementTree.fromstring(info.as_xml())
    four, six = (tree.findtext(f"v{n}data_port", "0") for n in (4, 6))
    return int(four), int(six)


def own_address() -> str:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])


def no_network() -> bool:
    return own_address().startswith("127.")


def test_settings_of_the_user_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LSLAPICFG", str(tmp_path / "lab.cfg"))
    (tmp_path / "lab.cfg").write_text(
        "[lab]\nKnownPeers = {10.0.0.5}\n[multicast]\nResolveScope = link\n"
    )
    text = lsl_settings(this_machine=True)
    assert "KnownPeers = {10.0.0.5}" in text
    assert "ResolveScope = link" in text
    assert "level = -3" in text
    (tmp_path / "lab.cfg").write_text("[log]\nlevel = 2\n")
    text = lsl_settings(this_machine=False)
    assert "level = 2" in text
    assert "ResolveScope" not in text
