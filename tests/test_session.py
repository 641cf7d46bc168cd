import json
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

from ikns.errors import FileError, InvalidInput
from ikns.live.session import (
    check_session,
    create_session,
    export_run,
    marker_channels,
    mend_session,
    micro,
    model_channels,
    open_run,
    read_run,
    runs,
)
from ikns.live.session.dataset import run_files
from ikns.recording.files import read

LABELS = ["RSHO", "RELB"]
JOINTS = ["right_elbow_flexion", "right_wrist_flexion"]
PROCESS = Path(__file__).with_name("session_process.py")
WIDTH = len(model_channels(JOINTS))


def begun(session, **changes):
    settings = {
        "labels": LABELS,
        "joint_names": JOINTS,
        "rate": 100.0,
        "configuration": {"seed": 1},
        "subject": {"map.json": "{}"},
    }
    return open_run(session, **settings | changes)


def recorded(folder, markers, model, events=()):
    session = create_session(folder)
    with begun(session) as run:
        for i, (seen, made) in enumerate(zip(markers, model, strict=True)):
            run.row("markers", [i, i / 100, i / 100, *np.ravel(seen)])
            run.row("model", made)
        for event in events:
            run.row("events", event)
    return session


def random_rows(n, rng):
    markers = micro(rng.normal(size=(n, 2, 3)))
    markers[rng.random((n, 2)) < 0.2] = np.nan
    model = rng.random((n, WIDTH))
    model[:, [c.name == "inside" for c in model_channels(JOINTS)]] = 1.0
    model[:, [c.name == "state" for c in model_channels(JOINTS)]] = 2.0
    return markers, model


# --- what is written comes back ------------------------------------------------------


def test_a_run_comes_back_as_it_was(tmp_path):
    rng = np.random.default_rng(0)
    markers, model = random_rows(40, rng)
    session = recorded(
        tmp_path / "s", markers, model, [(0.1, 0.0, "armed", "asked\tto")]
    )
    run = read_run(session)
    np.testing.assert_array_equal(run.markers, markers)
    assert run.labels == tuple(LABELS)
    assert run.rate == 100
    assert run.configuration == {"seed": 1}
    assert run.events == [(0.1, 0.0, "armed", "asked to")]
    np.testing.assert_array_equal(run.frame, np.arange(40))
    names = [channel.name for channel in model_channels(JOINTS)]
    for name in ("c", "flexion_asked", "flexion_sent", "flexion_measured"):
        # Bit for bit: printed with as many digits as it takes.
        np.testing.assert_array_equal(run.model[name], model[:, names.index(name)])
    for name in (*JOINTS, "residual"):
        # Six decimals.
        np.testing.assert_allclose(
            run.model[name], model[:, names.index(name)], atol=0.5000001e-6
        )
    assert check_session(session) == []


@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=20))
def test_micrometers_survive_printing(values):
    rounded = micro(values)
    assert [float(f"{value:.6f}") for value in rounded] == rounded.tolist()
    # Half a step, and the rounding of the number itself at 1e4.
    np.testing.assert_allclose(rounded, values, atol=0.5e-6 + 2e-12)
    np.testing.assert_array_equal(micro(rounded), rounded)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    c=st.floats(allow_nan=False, allow_infinity=False),
    text=st.text(min_size=1, max_size=30),
)
def test_any_number_and_any_text_come_back(tmp_path, c, text):
    folder = tmp_path / str(time.monotonic_ns())
    row = [c if channel.name == "c" else np.nan for channel in model_channels(JOINTS)]
    markers = np.full((1, 2, 3), np.nan)
    try:
        text.encode()
    except UnicodeEncodeError:
        text = "no text"
    session = recorded(folder, markers, [row], [(0.0, np.nan, "said", text)])
    run = read_run(session)
    assert run.model["c"].tolist() == [c]
    assert np.isnan(run.model["residual"]).all()
    ((_, duration, what, value),) = run.events
    assert np.isnan(duration)
    assert what == "said"
    assert value == (" ".join(text.split()) or "n/a")


def test_a_second_run_leaves_the_first_alone(tmp_path):
    session = recorded(tmp_path / "s", *random_rows(5, np.random.default_rng(1)))
    before = {p: p.read_bytes() for p in session.rglob("*run-01*") if p.is_file()}
    with begun(session) as run:
        run.row("markers", [0, 0, 0, *[0.0] * 6])
        run.row("model", [0.0] * WIDTH)
    assert runs(session) == [1, 2]
    assert len(read_run(session, 1).frame) == 5
    assert len(read_run(session).frame) == 1
    assert before == {p: p.read_bytes() for p in before}


# --- the standard --------------------------------------------------------------------


def test_the_official_validator_finds_no_error(tmp_path):
    session = recorded(
        tmp_path / "s",
        *random_rows(10, np.random.default_rng(2)),
        [(0.0, 0.0, "start", "n/a")],
    )
    validator = Path(sys.executable).with_name("bids-validator-deno")
    done = subprocess.run(
        [validator, session, "--json"], capture_output=True, text=True, check=False
    )
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [i for i in issues if i["severity"] == "error"] == []
    # It does look: without its channels a motion file is refused.
    for path in session.rglob("*channels.tsv"):
        path.unlink()
    done = subprocess.run(
        [validator, session, "--json"], capture_output=True, check=False
    )
    assert done.returncode != 0


def test_columns_are_those_of_the_standard():
    kinds = {"POS", "ORNT", "JNTANG", "LATENCY", "MISC"}
    parts = {"x", "y", "z", "quat_x", "quat_y", "quat_z", "quat_w", "n/a"}
    for channels in (marker_channels(LABELS), model_channels(JOINTS, 2)):
        names = [channel.name for channel in channels]
        assert len(set(names)) == len(names)
        assert {channel.type for channel in channels} <= kinds
        assert {channel.component for channel in channels} <= parts


# --- faults --------------------------------------------------------------------------


def killed(session, after):
    """When the process handed over its last row, s, before it was killed."""
    lines, start = [], None
    with subprocess.Popen(
        [sys.executable, PROCESS, session], stdout=subprocess.PIPE, text=True
    ) as process:
        for line in process.stdout:
            lines.append(line)
            start = start or time.monotonic()
            if time.monotonic() - start > after:
                process.send_signal(signal.SIGKILL)
                break
        lines += process.stdout.readlines()
    whole = [line.split() for line in lines if line.endswith("\n")]
    return float(whole[-1][1])


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_process_loses_less_than_a_second(tmp_path, seed):
    after = np.random.default_rng(seed).uniform(0.3, 1.6)
    session = create_session(tmp_path / "s")
    last = killed(session, after)
    run = read_run(session)
    assert last - run.device_time[-1] < 1.0
    np.testing.assert_array_equal(run.frame, np.arange(len(run.frame)))
    mend_session(session)
    assert check_session(session) == []
    # Once mended, nothing is left to mend.
    assert mend_session(session) == []


def test_a_torn_row_is_left_out_and_mended(tmp_path):
    session = recorded(tmp_path / "s", *random_rows(8, np.random.default_rng(3)))
    files = run_files(session, "01", 1)
    for name, size in (("markers", 11), ("model", 40), ("events", 2)):
        data = files[name].read_bytes()
        files[name].write_bytes(data[:-size])
    run = read_run(session)
    assert len(run.frame) == 7
    assert run.torn["markers"] > 0
    assert any(
        "ends in the middle of a row" in finding for finding in check_session(session)
    )
    cut = mend_session(session)
    assert len(cut) == 3
    assert len(read_run(session).frame) == 7


@given(cut=st.integers(0, 4000))
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_cut_anywhere_opens(tmp_path, cut):
    folder = tmp_path / str(time.monotonic_ns())
    session = recorded(folder, *random_rows(12, np.random.default_rng(4)))
    path = run_files(session, "01", 1)["markers"]
    whole = path.read_bytes()
    left = whole[: max(0, len(whole) - cut)]
    path.write_bytes(left)
    assert len(read_run(session).frame) == left.count(b"\n")


def test_a_full_disk_is_told_at_once_and_loses_nothing_once_there_is_room(tmp_path):
    session, told = create_session(tmp_path / "s"), []
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # A file that may not grow fails in the middle of a row, as on a full disk.
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with begun(session, on_fault=told.append) as run:
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
            rng = np.random.default_rng(5)
            markers, model = random_rows(100, rng)
            for i in range(100):
                run.row("markers", [i, i / 100, i / 100, *markers[i].ravel()])
                run.row("model", model[i])
            deadline = time.monotonic() + 20
            while not told and time.monotonic() < deadline:
                time.sleep(0.02)
            assert "cannot be written: file too large" in told[0]
            path = run_files(session, "01", 1)["markers"]
            assert path.read_bytes()[-1:] in (b"\n", b"")  # no torn row
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert told[-1] == "the session is being written again."
    assert run.lost == 0
    np.testing.assert_array_equal(read_run(session).markers, markers)
    assert check_session(session) == []


def test_a_deleted_folder_is_told_within_a_second(tmp_path):
    session, told = create_session(tmp_path / "s"), []
    with begun(session, on_fault=told.append) as run:
        run.row("markers", [0, 0, 0, *[0.0] * 6])
        shutil.rmtree(session)
        deadline = time.monotonic() + 20
        while not told and time.monotonic() < deadline:
            time.sleep(0.02)
        run.row("markers", [1, 0, 0, *[0.0] * 6])
    assert "it has been deleted" in told[0]
    # Neither row is on disk, be it that the first was written before.
    assert run.lost == 2
    (sentence,) = [each for each in run.losses if "rows are missing" in each]
    assert "2 of 2 rows are missing (cannot be written: it has been dele" in sentence
    assert not session.exists()


def test_a_row_costs_no_wait(tmp_path, monkeypatch):
    # A disk that writes nothing until every row has been handed over.
    import ikns.live.session.row_file as row_file

    real, disk, wrote = row_file.os.write, threading.Event(), []

    def write(*args):
        wrote.append(disk.wait(5))
        return real(*args)

    monkeypatch.setattr(row_file.os, "write", write)
    session = create_session(tmp_path / "s")
    disk.set()
    with begun(session) as run:
        disk.clear()
        for i in range(200):
            run.row("markers", [i, i / 100, i / 100, *[0.0] * 6])
            assert all(wrote)
        disk.set()
    # A row that waited for the disk would have waited in vain.
    assert wrote
    assert all(wrote)


# --- bad input -----------------------------------------------------------------------


def test_a_folder_that_holds_something_is_not_touched(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InvalidInput, match="exists already; use --resume"):
        create_session(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize("name", ["", "Jane Doe", "1980-01-01", "a/b", "../x"])
def test_a_participant_is_a_pseudonym(tmp_path, name):
    with pytest.raises(InvalidInput, match="letters and digits"):
        create_session(tmp_path / "s", participant=name)


def test_what_is_no_session_is_refused(tmp_path):
    for use in (runs, read_run, check_session, mend_session, begun):
        with pytest.raises(FileError, match="not a session; give a folder that `ikns"):
            use(tmp_path)


def test_an_unknown_version_is_refused(tmp_path):
    session = create_session(tmp_path / "s")
    about = session / "dataset_description.json"
    about.write_text(about.read_text().replace('"IknsFormat": 1', '"IknsFormat": 99'))
    with pytest.raises(FileError, match="format version 1, found 99"):
        runs(session)


def test_a_run_that_is_not_there_is_refused(tmp_path):
    session = recorded(tmp_path / "s", *random_rows(3, np.random.default_rng(6)))
    with pytest.raises(FileError, match="expected run 7, found 1"):
        read_run(session, 7)


def test_a_damaged_row_is_named(tmp_path):
    session = recorded(tmp_path / "s", *random_rows(3, np.random.default_rng(7)))
    path = run_files(session, "01", 1)["markers"]
    lines = path.read_text().splitlines(keepends=True)
    path.write_text(lines[0] + "1\tzwei\n" + lines[2])
    with pytest.raises(FileError, match="row 2: expected 9 numbers or n/a"):
        read_run(session)


def test_a_row_of_the_wrong_width_is_refused(tmp_path):
    with begun(create_session(tmp_path / "s")) as run:
        with pytest.raises(InvalidInput, match="expected 9 values for 'markers'"):
            run.row("markers", [1.0])


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf])
def test_a_rate_of_nothing_is_refused(tmp_path, rate):
    session = create_session(tmp_path / "s")
    with pytest.raises(InvalidInput, match="positive rate"):
        begun(session, rate=rate)


def test_a_folder_that_cannot_be_written_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot be written: not a directory"):
        create_session(tmp_path / "file" / "s")


# --- export --------------------------------------------------------------------------


def test_a_run_is_exported_to_csv_mat_and_c3d(tmp_path):
    markers, model = random_rows(20, np.random.default_rng(8))
    run = read_run(recorded(tmp_path / "s", markers, model))
    for kind in ("csv", "mat", "c3d"):
        export_run(run, tmp_path / f"run.{kind}")
        with pytest.raises((InvalidInput, FileError), match="exists already"):
            export_run(run, tmp_path / f"run.{kind}")
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["c"], run.model["c"])
    np.testing.assert_array_equal(table["RELB_z"], markers[:, 1, 2])
    mat = loadmat(tmp_path / "run.mat", squeeze_me=True)
    np.testing.assert_array_equal(mat["markers"], markers)
    np.testing.assert_array_equal(mat["flexion_sent"], run.model["flexion_sent"])
    assert list(mat["labels"]) == LABELS
    # Single precision of millimeters below ten meters.
    np.testing.assert_allclose(read(tmp_path / "run.c3d").markers, markers, atol=1e-6)


def test_an_unknown_format_is_refused(tmp_path):
    run = read_run(recorded(tmp_path / "s", *random_rows(3, np.random.default_rng(9))))
    with pytest.raises(InvalidInput, match=r"ends in \.csv, \.mat or \.c3d"):
        export_run(run, tmp_path / "run.xlsx")
