"""A stream must carry one subject, of the size that was calibrated."""

import sys
import threading
import types
import uuid
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_person
import vicon_sdk
from command_line import check_refused
from qtm_server import QtmServer
from test_stream_lsl import marker, vendor

from ikns.body.marker_set import MarkerSet
from ikns.errors import MarkerMismatch, StreamError
from ikns.live.runtime import run
from ikns.live.stream import Source, open_source
from ikns.live.stream.replay import Replay
from ikns.live.stream.subjects import subjects_of
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording

WORN = MarkerSet.load("oxford24").without_static()


@pytest.fixture
def stage(monkeypatch: pytest.MonkeyPatch) -> vicon_sdk.Stage:
    """A Vicon server with two people, each with half of the markers, and a wand."""
    package = types.ModuleType("vicon_dssdk")
    package.ViconDataStream = vicon_sdk  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "vicon_dssdk", package)
    monkeypatch.setitem(sys.modules, "vicon_dssdk.ViconDataStream", vicon_sdk)
    vicon_sdk.stage = vicon_sdk.Stage()
    labels = list(WORN.labels)
    vicon_sdk.stage.subjects = {
        "Mia": labels[:-2], "Noa": labels[-2:], "Wand": ["Tip", "End"]
    }  # fmt: skip
    vicon_sdk.stage.frames.put((1, {"Mia:C7": (10.0, 20.0, 30.0)}))
    return vicon_sdk.stage


def test_markers_of_two_subjects_are_not_put_together(stage: vicon_sdk.Stage) -> None:
    with pytest.raises(MarkerMismatch) as refused:
        open_source("vicon:cameras?timeout=10", needs=WORN)
    sentence = str(refused.value)
    assert "found those of Mia and Noa; choose one" in sentence
    assert sentence.endswith("?subject=Mia.")


@pytest.mark.parametrize(
    ("subject", "first"), [("mia", [0.01, 0.02, 0.03]), ("Noa", [np.nan] * 3)]
)
def test_one_of_two_subjects_is_read(
    stage: vicon_sdk.Stage, subject: str, first: list[float]
) -> None:
    stage.subjects["Noa"] = list(WORN.labels)
    stage.subjects["Mia"] = list(WORN.labels[::-1])
    address = f"vicon:cameras?timeout=10&subject={subject}"
    with open_source(address, needs=WORN) as source:
        assert sorted(source.labels) == sorted(WORN.labels)
        frame = next(source)
    np.testing.assert_allclose(frame.markers[source.labels.index("C7")], first)


def test_a_subject_that_is_not_there_is_refused(stage: vicon_sdk.Stage) -> None:
    with pytest.raises(MarkerMismatch, match="markers of the subject 'Ida'"):
        open_source("vicon:cameras?timeout=10&subject=Ida", needs=WORN)


@pytest.mark.parametrize("option", ["", "&subject=Noa"])
def test_qualisys_names_subjects_with_an_underscore(option: str) -> None:
    labels = [f"{who}_{label}" for who in ("Mia", "Noa") for label in WORN.labels]
    with QtmServer(labels) as server:

        def first() -> None:
            server.streaming.wait(10)
            server.send(1, 10, np.arange(3.0 * len(labels)).reshape(-1, 3))

        sender = threading.Thread(target=first)
        sender.start()
        address = f"qualisys:127.0.0.1:{server.port}?timeout=10{option}"
        if option:
            with open_source(address, needs=WORN) as source:
                frame = next(source)
            assert source.labels == WORN.labels
            assert frame.markers[0, 0] == 3.0 * len(WORN.labels)
        else:
            with pytest.raises(MarkerMismatch, match="those of Mia and Noa; choose"):
                open_source(address, needs=WORN)
        sender.join()


def test_a_subject_is_found_by_its_markers_only() -> None:
    assert subjects_of(["Mia:C7", "MIA:RELB", "RSHO", "T_10", "x:y:C7"], WORN) == [
        "Mia", "x:y"
    ]  # fmt: skip
    assert subjects_of(WORN.labels, WORN) == []


def test_the_loop_refuses_two_subjects_too() -> None:
    labels = [f"Mia:{label}" for label in WORN.labels]
    labels[3] = labels[3].replace("Mia", "Noa")
    there = Recording([0.0, 0.01], np.ones((2, len(labels), 3)), labels)
    with Source(Replay(there)) as source, pytest.raises(MarkerMismatch, match="Noa"):
        run(source, small_person.subject())
    # The name of the only subject is no obstacle.
    labels[3] = labels[3].replace("Noa", "Mia")
    there = Recording([0.0, 0.01], np.ones((2, len(labels), 3)), labels)
    with Source(Replay(there, speed=0)) as source:
        assert run(source, small_person.subject()).frames == 2


@pytest.fixture(scope="module")
def points() -> Recording:
    return small_person.cut(small_person.protocol().points.recording, 0, 30)


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_body_ten_times_off_is_refused_before_anything_is_written(
    files: Path,
    points: Recording,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    factor: float,
) -> None:
    write_c3d(tmp_path / "off.c3d", replace(points, markers=factor * points.markers))
    argv = ["run", "--subject", str(files / "person"), "--session", str(tmp_path / "s"),
            "--source", f"replay:{tmp_path / 'off.c3d'}"]  # fmt: skip
    sentence = check_refused(argv, tmp_path, capfd)
    assert f"the body is {factor:g} times as large as at calibration" in sentence


def test_a_tall_relative_and_a_ghost_are_not_refused(
    points: Recording, tmp_path: Path
) -> None:
    # Half again as large is no unit; one marker 30 m away is no size.
    subject = small_person.subject()
    large, ghost = 1.5 * points.markers, points.markers.copy()
    ghost[:, points.labels.index("RUPA")] += 30.0
    for markers in (large, ghost, points.markers):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.c3d"
        write_c3d(path, replace(points, markers=markers))
        with open_source(f"replay:{path}?speed=max", subject=subject) as source:
            assert len(list(source)) == len(points.time)  # looked at, not read


@pytest.mark.parametrize(
    ("said", "per_meter", "factor", "repair"),
    [("m", 1000.0, "1000", "mm"), ("mm", 100.0, "0.1", "cm"), ("cm", 1.0, "0.01", "m")],
)
def test_a_wrong_unit_over_lsl_is_named_and_its_repair_works(
    points: Recording, said: str, per_meter: float, factor: str, repair: str
) -> None:
    name = f"size-{uuid.uuid4().hex[:8]}"
    labels = points.labels
    channels = [marker(label, axis, said) for label in labels for axis in "XYZ"]
    outlet = vendor(name, channels, form="double64")
    stop = threading.Event()

    def push() -> None:
        while not stop.wait(0.01):
            for frame in points.markers:
                outlet.push_sample((per_meter * frame).ravel().tolist())

    thread = threading.Thread(target=push)
    thread.start()
    address = f"lsl:{name}?scope=machine&timeout=10"
    try:
        with pytest.raises(StreamError) as refused:
            open_source(address, subject=small_person.subject())
        sentence = str(refused.value)
        assert f"{factor} times as large as at calibration" in sentence
        assert sentence.endswith(f"as in lsl:{name}?unit={repair}.")
        with open_source(
            f"{address}&unit={repair}", subject=small_person.subject()
        ) as source:
            assert np.nanmax(np.abs(next(source).markers)) < 10.0
    finally:
        stop.set()
        thread.join()


def test_a_size_is_not_judged_by_what_is_hidden(tmp_path: Path, files: Path) -> None:
    # Markers of one segment only: two distances are too few.
    points = read(files / "free.c3d")
    keep = [points.labels.index(label) for label in ("RUPA", "RUPB")]
    markers = np.full_like(points.markers, np.nan)
    markers[:, keep] = 10 * points.markers[:, keep]
    write_c3d(tmp_path / "few.c3d", replace(points, markers=markers))
    address = f"replay:{tmp_path / 'few.c3d'}"
    open_source(address, subject=small_person.subject()).close()


def test_swapped_sides_are_not_replayed(tmp_path: Path, files: Path) -> None:
    free = read(files / "free.c3d")
    other = {"R": "L", "L": "R"}
    swapped = [other.get(name[0], name[0]) + name[1:] for name in free.labels]
    write_c3d(tmp_path / "swapped.c3d", replace(free, labels=tuple(swapped)))
    subject, address = small_person.subject(), f"replay:{tmp_path / 'swapped.c3d'}"
    with pytest.raises(MarkerMismatch, match="left and right are swapped"):
        open_source(address, subject=subject)
    back = dict(zip(swapped, free.labels, strict=True))
    open_source(address, subject=subject, names=back).close()
    # Two that are exchanged leave the choice to each frame.
    back |= {"LWRA": "RWRB", "LWRB": "RWRA"}
    open_source(address, subject=subject, names=back).close()
