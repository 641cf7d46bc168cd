"""What goes to Rerun: the numbers, where they are, and what must not be shown."""

import importlib.util
import json
import math
import sys

import numpy as np
import pytest
import rerun_stand_in
from command_line import check_refused
from scipy.spatial.transform import Rotation
from test_publish import BODY, moving, session_of
from test_publish import subject as subject  # a fixture

from ikns.cli import main
from ikns.finger import SimulatedFinger
from ikns.live.publish import Publisher
from ikns.live.runtime import run
from ikns.live.session import read_run
from ikns.live.stream import Source
from ikns.live.stream.replay import Replay
from ikns.motion.marker_ik import MarkerIK
from ikns.view.timeline import RerunLog, RerunSink, log_recording
from ikns.view.timeline.entries import frame_entries

LABELS = BODY.marker_set.labels
# The library is too large to be installed for a test alone (170 MB to load).
REAL = importlib.util.find_spec("rerun") is not None


def read_rrd(path):
    """Rows by path, as :func:`rerun_stand_in.read`, from a file of Rerun itself."""
    from rerun.chunk import RrdReader

    columns = {
        "Scalars:scalars": None,
        "TextLog:text": None,
        "Points3D:positions": "Points3D:labels",
        "LineStrips3D:strips": None,
    }
    found = {}
    for chunk in RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        for values, labels in columns.items():
            if values in batch.schema.names:
                times = batch.column("time").cast("int64").to_pylist()
                numbers = batch.column(values).to_pylist()
                told_too = labels in batch.schema.names
                names = [None] * len(numbers)
                if told_too:
                    names = batch.column(labels).to_pylist()
                rows = found.setdefault(chunk.entity_path.lstrip("/"), [])
                for at, told, named in zip(times, numbers, names, strict=True):
                    single = values.startswith(("Scalars", "Text"))
                    rows.append((at / 1e9, told[0] if single else told, named))
    return {
        where: sorted(rows, key=lambda row: row[0]) for where, rows in found.items()
    }


@pytest.fixture(params=["stand-in", "real"] if REAL else ["stand-in"])
def read_back(request, monkeypatch):
    if request.param == "real":
        return read_rrd
    monkeypatch.setitem(sys.modules, "rerun", rerun_stand_in)
    return rerun_stand_in.read


def posture(seed):
    rng = np.random.default_rng(seed)
    q = BODY.neutral()
    q[:3] = rng.normal(size=3)
    q[3:7] = Rotation.random(rng=rng).as_quat()
    q[7:] += rng.uniform(-0.2, 0.2, len(q) - 7)
    return q


@pytest.mark.parametrize("seed", range(3))
def test_arms_are_in_the_world_with_their_markers(seed):
    q = posture(seed)
    markers = BODY.markers_in_world(q)
    moved = markers + [0, 0, 0.01]
    shown = frame_entries(BODY, LABELS, moved, q, {})
    # The hand's origin, by the model's own frames, carried into the world here.
    hands = BODY.hands_in_thorax(q)[0]
    turn = Rotation.from_quat(q[3:7]).as_matrix()
    right, left, between = shown["world/arms"].strips
    for arm, hand in ((right, hands[0]), (left, hands[1])):
        np.testing.assert_allclose(arm[-1], turn @ hand + q[:3], atol=1e-12)
    np.testing.assert_array_equal(between, [right[0], left[0]])
    # A residual leads from each marker to its place in the pose.
    for (seen, placed), marker in zip(
        shown["world/residuals"].strips, markers, strict=True
    ):
        np.testing.assert_allclose(seen - placed, [0, 0, 0.01], atol=1e-12)
        np.testing.assert_array_equal(placed, marker)


def test_what_is_not_known_is_not_shown():
    q = BODY.neutral()
    markers = BODY.markers_in_world(q)
    markers[2] = np.nan
    numbers = {"signal/c": math.nan, "signal/flexion": 0.25}
    shown = frame_entries(BODY, LABELS, markers, np.full_like(q, np.nan), numbers)
    assert LABELS[2] not in shown["world/markers"].names
    assert len(shown["world/markers"].places) == len(LABELS) - 1
    # Empty, so that what was drawn before goes.
    assert len(shown["world/arms"].strips) == len(shown["world/residuals"].strips) == 0
    assert "signal/c" not in shown
    assert shown["signal/flexion"] == 0.25


def test_a_live_run_is_logged_as_the_session_has_it(subject, tmp_path, read_back):
    path = tmp_path / "run.rrd"
    sink = RerunSink(RerunLog(path, title="live"), BODY)
    with (
        Publisher("rerun", sink) as publisher,
        session_of(subject, tmp_path / "s") as s,
    ):
        with Source(Replay(moving(30), speed=2)) as source:
            run(source, subject, SimulatedFinger(), session=s, listener=publisher)
    assert (publisher.dropped, publisher.fault) == (0, "")
    kept, rows = read_run(tmp_path / "s"), read_back(path)
    table = kept.model
    c = np.array([[at, value] for at, value, _ in rows["signal/c"]])
    np.testing.assert_array_equal(c[:, 1], table["c"])
    # The session rounds to microseconds, Rerun to nanoseconds.
    np.testing.assert_allclose(c[:, 0], kept.receive_time, rtol=0, atol=1e-6)
    rms = [value for _, value, _ in rows["residual/rms_mm"]]
    np.testing.assert_allclose(rms, 1e3 * np.array(table["residual"]), atol=5.1e-4)
    said = [words for _, words, _ in rows["events"]]
    assert said[0].startswith("start: ")
    assert said[1:] == [f"{kind}: {value}" for _, _, kind, value in kept.events]
    shown = rows["world/markers"]
    # All are seen in every frame, so names are told once.
    assert [tuple(names) for _, _, names in shown if names] == [LABELS]
    for (_, places, _), markers in zip(shown, kept.markers, strict=True):
        np.testing.assert_allclose(places, markers, atol=1e-6)  # Rerun has float32


def test_a_recording_is_logged_frame_by_frame(tmp_path, read_back):
    recording = moving(5)
    motion = MarkerIK(BODY).track(recording, chain="right_arm")
    log = RerunLog(tmp_path / "a.rrd", title="a")
    c = np.linspace(0, 1, 10).reshape(5, 2)
    assert log_recording(log, BODY, motion, recording, c) == 5
    log.close()
    rows = read_back(tmp_path / "a.rrd")
    for k in range(2):
        found = [(at, value) for at, value, _ in rows[f"signal/c_{k + 1}"]]
        np.testing.assert_allclose(found, np.c_[recording.time, c[:, k]], atol=1e-9)
    assert len(rows["world/arms"]) == 5


def test_commands_write_a_file(files, tmp_path, capfd, read_back):
    person, free = str(files / "person"), str(files / "free.c3d")
    shown = tmp_path / "view.rrd"
    assert main(["view", person, free, "--rrd", str(shown), "--to", "1", "--json"]) == 0
    result = json.loads(capfd.readouterr().out)
    rows = read_back(shown)
    assert len(rows["world/markers"]) == result["frames"] > 20
    assert 0 < len(rows["signal/c"]) <= result["frames"]
    assert not (tmp_path / "view.html").exists()
    live = tmp_path / "run.rrd"
    argv = [
        *("run", "--subject", person, "--source", f"replay:{free}?speed=max"),
        *("--dry-run", "--json", "--rrd", str(live)),
    ]
    assert main(argv) == 0
    result = json.loads(capfd.readouterr().out)
    assert result["published"]["dropped"] == 0
    assert len(read_back(live)["world/markers"]) == result["frames"]
    assert "exists already" in check_refused(argv, files, capfd)


def test_wrong_uses_are_one_sentence(files, tmp_path, capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", rerun_stand_in)
    person, free = str(files / "person"), str(files / "free.c3d")
    view = ["view", person, free]
    rrd = ["--rrd", str(tmp_path / "a.rrd")]
    for more, words in (
        (["--rrd", str(tmp_path / "a.html")], "with the ending .rrd"),
        (["--rrd", str(tmp_path / "none" / "a.rrd")], "does not exist"),
        ([*rrd, "--rerun"], "--rerun or --rrd, found both"),
        ([*rrd, "--out", str(tmp_path / "a.html")], "leave out --out"),
    ):
        assert words in check_refused([*view, *more], files, capfd)
    assert "show a recording" in check_refused(["view", person, *rrd], files, capfd)
    monkeypatch.setitem(sys.modules, "rerun", None)  # as if it were not installed
    said = check_refused([*view, *rrd], files, capfd)
    assert "--rerun and --rrd need rerun; pip install 'ikns[rerun]'" in said


def test_without_a_viewer_the_way_out_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", rerun_stand_in)
    # A program that ends at once, as the viewer does without a screen.
    monkeypatch.setattr("ikns.view.timeline.rerun.sys.executable", "/bin/false")
    with pytest.raises(ValueError, match="write a file with --rrd"):
        RerunLog(None, title="a")
