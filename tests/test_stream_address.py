"""Sources that cannot be opened are refused in one sentence with the fix."""

from pathlib import Path

import numpy as np
import pytest

from ikns.body.marker_set import MarkerSet
from ikns.errors import IknsError, InvalidInput, MarkerMismatch
from ikns.live.stream import open_source
from ikns.recording.files import write_c3d
from ikns.recording.recording import Recording


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    worn = MarkerSet.load("oxford24").without_static().labels
    for name, n, labels in (
        ("good", 5, worn),
        ("short", 1, worn),
        ("bare", 5, worn[1:]),
    ):
        markers = np.random.default_rng(n).normal(size=(n, len(labels), 3))
        write_c3d(
            tmp_path / f"{name}.c3d",
            Recording(np.arange(n) / 100, markers, labels),
        ) if n > 1 else (tmp_path / "short.trc").write_text(_ONE_FRAME)
    (tmp_path / "notes.c3d").write_text("not a recording")
    return tmp_path


_ONE_FRAME = """PathFileType\t4\t(X/Y/Z)\tshort.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
100\t100\t1\t1\tmm\t100\t1\t1
Frame#\tTime\tA\t\t
\t\tX1\tY1\tZ1

1\t0\t1\t2\t3
"""


@pytest.mark.parametrize(
    ("address", "says"),
    [
        (
            "walk.c3d",
            "replay:FILE, lsl:NAME, qualisys:HOST, vicon:HOST, natnet:HOST or",
        ),
        ("optitrack:host", "unknown source 'optitrack:host', expected replay:FILE"),
        ("", "unknown source ''"),
        ("{}/good.c3d", "HOST or ros2:TOPIC; to play this file, write replay:"),
        ("replay:", "expected replay:FILE"),
        ("vicon:", "vicon:HOST"),
        ("replay:{}/none.c3d", "none.c3d"),
        ("replay:{}/notes.c3d", "notes.c3d: this is not a C3D file"),
        ("replay:{}/notes.txt", "notes.txt: expected a marker file that ends in .c3d"),
        (
            "replay:{}/short.trc",
            "expected at least two frames to determine a rate, found 1",
        ),
        ("replay:{}/good.c3d?speed=-1", "speed of 0 or more, found -1"),
        ("replay:{}/good.c3d?speed=fast", "number for speed, found 'fast'"),
        ("replay:{}/good.c3d?speed=nan", "speed of 0 or more, found nan"),
        ("replay:{}/good.c3d?loop=maybe", "loop=yes or loop=no, found loop=maybe"),
        ("replay:{}/good.c3d?rate=3", "unknown option 'rate', expected speed or loop"),
        ("lsl:x?timeout=0", "lsl:x?timeout=0: expected a timeout above 0 s, found 0"),
        ("lsl:x?scope=moon", "scope=machine or network, found scope=moon"),
        ("qualisys:host:zero", "port from 1 to 65535, found 'zero'"),
        ("vicon:host:70000", "port from 1 to 65535, found '70000'"),
        ("natnet:host:0", "port from 1 to 65535, found '0'"),
        ("natnet:host?scope=machine", "unknown option 'scope', expected timeout or"),
    ],
)
def test_an_address_that_cannot_be_opened(
    address: str, says: str, folder: Path
) -> None:
    with pytest.raises(IknsError) as refused:
        open_source(address.format(folder))
    sentence = str(refused.value)
    assert says in sentence
    assert sentence.endswith(".")
    assert sentence.count(str(folder)) <= 1


def test_a_stream_must_have_the_markers_that_are_worn(folder: Path) -> None:
    worn = MarkerSet.load("oxford24")
    with open_source(f"replay:{folder}/good.c3d", needs=worn) as source:
        assert len(source.labels) == len(worn.without_static().labels)
    missing = worn.without_static().labels[0]
    with pytest.raises(MarkerMismatch, match=f"expected markers {missing}, found only"):
        open_source(f"replay:{folder}/bare.c3d", needs=worn)


def test_a_closed_source_has_ended(folder: Path) -> None:
    source = open_source(f"replay:{folder}/good.c3d?speed=max&loop=yes")
    assert source.read() is not None
    source.close()
    source.close()
    assert source.ended
    assert source.read() is None
    assert list(source) == []


def test_without_its_client_library_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "qtm_rt", None)
    with pytest.raises(
        IknsError, match=r"needs qtm_rt; pip install 'ikns\[qualisys\]'"
    ):
        open_source("qualisys:host")
    monkeypatch.setitem(sys.modules, "pylsl", None)
    monkeypatch.setattr("ikns.live.stream.lsl_library._library", None)
    with pytest.raises(IknsError, match=r"needs pylsl; pip install 'ikns\[lsl\]'"):
        open_source("lsl:name")


def test_speed_zero_and_max_are_the_same(folder: Path) -> None:
    for speed in ("0", "max"):
        with open_source(f"replay:{folder}/good.c3d?speed={speed}") as source:
            assert source.speed == 0
            assert len(list(source)) == 5


def test_a_negative_late_bound_is_no_excuse(folder: Path) -> None:
    with open_source(f"replay:{folder}/good.c3d?speed=100", late_after=-1) as source:
        frames = list(source)
    assert source.continuity.counts.late == len(frames)


def test_bad_rates_are_refused_before_anything_is_sent() -> None:
    from ikns.live.stream import LslOutlet

    for rate in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidInput, match="rate above 0"):
            LslOutlet(["A"], rate, name="x")
    with pytest.raises(InvalidInput, match="one marker or more"):
        LslOutlet([], 100.0, name="x")
