"""Vicon: against a stand-in with the call shape of the vendor's SDK."""

import sys
import time
import types
from collections.abc import Iterator

import numpy as np
import pytest
import vicon_sdk

from ikns.errors import StreamError
from ikns.live.stream import open_source


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> Iterator[vicon_sdk.Stage]:
    package = types.ModuleType("vicon_dssdk")
    package.ViconDataStream = vicon_sdk  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "vicon_dssdk", package)
    monkeypatch.setitem(sys.modules, "vicon_dssdk.ViconDataStream", vicon_sdk)
    vicon_sdk.stage = vicon_sdk.Stage()
    yield vicon_sdk.stage
    vicon_sdk.stage.hangs.set()


def test_frames_arrive_in_meters_with_hidden_markers_as_nan(
    stage: vicon_sdk.Stage,
) -> None:
    stage.subjects["Bob"] = ["RSHO"]
    for number in (7, 8, 10):
        stage.frames.put((number, {"Ann:RSHO": (number, 2.0, 3.0), "Bob:RSHO": "gone"}))
    with open_source("vicon:cameras?timeout=10") as source:
        frames = [next(source) for _ in range(3)]
        assert source.labels == ("Ann:RSHO", "Ann:RELB", "Bob:RSHO")
        assert source.rate == 100
        assert source.device == {"latency": 0.004, "overruns": 0}
        assert ["marker Bob:RSHO is gone" in e.text for e in source.events] == [True]
    assert stage.calls == ["Connect cameras:801"]
    assert [f.number for f in frames] == [7, 8, 10]
    assert source.continuity.counts.dropped == 1
    for frame in frames:
        np.testing.assert_allclose(
            frame.markers,
            [[1e-3 * frame.number, 2e-3, 3e-3], [np.nan] * 3, [np.nan] * 3],
        )
        assert frame.device_time == frame.number / 100


def test_zeros_are_a_marker_that_was_not_seen(stage: vicon_sdk.Stage) -> None:
    # Not flagged as occluded, as some versions of the software send it.
    stage.frames.put((1, {"Ann:RSHO": (0.0, 0.0, 0.0), "Ann:RELB": (0.0, 0.0, 9.0)}))
    with open_source("vicon:cameras?timeout=10") as source:
        frame = next(source)
    assert np.isnan(frame.markers).all(axis=1).tolist() == [True, False]


def test_a_connection_that_breaks_is_made_again(stage: vicon_sdk.Stage) -> None:
    stage.frames.put((1, {}))
    with open_source("vicon:cameras?timeout=10") as source:
        assert next(source).number == 1
        stage.frames.put(None)
        stage.frames.put((500, {}))
        assert next(source).number == 500
        told = [event.text for event in source.events]
    assert told == [
        "vicon:cameras: Vicon disconnected.",
        "vicon:cameras: Vicon is back.",
    ]
    assert len(stage.calls) == 2


def test_other_markers_after_a_break_are_not_read(stage: vicon_sdk.Stage) -> None:
    stage.frames.put((1, {}))
    with open_source("vicon:cameras?timeout=10") as source:
        next(source)
        stage.subjects["Ann"] = ["RSHO"]
        stage.frames.put(None)
        stage.frames.put((2, {}))
        give_up = time.monotonic() + 20
        while not any("different markers" in event.text for event in source.events):
            assert time.monotonic() < give_up
            assert source.read(0.05) is None


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ("refuses", "answer at cameras:801 within 0.2 s"),
        ("hangs", "answer at cameras:801 within 0.2 s"),
        ("silent", "sends no frames within 0.2 s"),
        ("bare", "expected labeled markers, found none"),
        ("rate", "rate above 0"),
    ],
)
def test_a_server_without_what_is_needed_is_refused(
    stage: vicon_sdk.Stage, fault: str, says: str
) -> None:
    if fault != "silent":
        stage.frames.put((1, {}))
    if fault == "bare":
        stage.subjects.clear()
    if fault == "rate":
        stage.rate = 0.0
    if fault == "hangs":
        stage.hangs.clear()
    stage.refuses = fault == "refuses"
    with pytest.raises(StreamError) as refused:
        open_source("vicon:cameras?timeout=0.2")
    assert says in str(refused.value)


def test_without_the_sdk_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "vicon_dssdk", None)
    with pytest.raises(StreamError, match="install Vicon's DataStream SDK"):
        open_source("vicon:cameras")
