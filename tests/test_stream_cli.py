"""``ikns stream`` in one process, a reader in another."""

import json
import signal
import subprocess
import sys
import uuid
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused

from ikns.live.stream import open_source
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    markers = np.random.default_rng(1).normal(size=(60, 3, 3))
    markers[5:9, 1] = np.nan
    path = tmp_path / "walk.c3d"
    write_c3d(path, Recording(np.arange(60) / 100, markers, ["A", "B", "C"]))
    return path


@pytest.fixture
def name() -> str:
    return f"test-{uuid.uuid4().hex[:8]}"


def start(*argv: str) -> subprocess.Popen[str]:
    code = "import sys; from ikns.cli import main; sys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-c", code, "stream", *argv, "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_file_served_is_the_file_read(walk: Path, name: str) -> None:
    with start(str(walk), "--name", name, "--speed", "2") as server:
        with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
            frames = [next(source) for _ in range(60)]
        out, err = server.communicate(timeout=60)
    there = read(walk)
    assert (server.returncode, err) == (0, "")
    assert source.labels == there.labels
    assert source.rate == pytest.approx(2 * there.rate)
    np.testing.assert_array_equal([f.markers for f in frames], there.markers)
    told = json.loads(out)
    assert told["frames"] == 60
    assert told["faults"] == {}
    assert told["seconds"] >= 59 / 200


def test_interrupting_an_endless_stream_is_its_normal_end(
    walk: Path, name: str
) -> None:
    argv = [str(walk), "--name", name, "--loop", "--fault", "drop=0.2", "--seed", "7"]
    with start(*argv) as server:
        with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
            while source.continuity.counts.received < 90:
                next(source)
            counts = source.continuity.counts
            # The next one shows that the server has counted those before.
            while source.continuity.counts.received == counts.received:
                next(source)
        server.send_signal(signal.SIGINT)
        out, err = server.communicate(timeout=60)
    assert (server.returncode, err) == (0, "")
    told = json.loads(out)
    assert told["frames"] >= 90
    assert told["faults"]["drop"] >= counts.dropped > 0


def test_a_stream_that_dies_without_a_word_is_noticed_and_found_again(
    walk: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A stopped process, as a cut wire, leaves the connection open and answers nothing.
    monkeypatch.setattr("ikns.live.stream.lsl_feed._SILENCE", 0.3)
    monkeypatch.setattr("ikns.live.stream.lsl_feed._ALIVE_TIMEOUT", 0.5)
    with start(str(walk), "--name", name, "--loop") as server:
        with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
            next(source)
            server.send_signal(signal.SIGSTOP)
            while not any("was interrupted" in event.text for event in source.events):
                source.read(0.1)
            server.send_signal(signal.SIGCONT)
            before = source.continuity.counts.received
            while source.continuity.counts.received == before:
                next(source)
            assert any("is back" in event.text for event in source.events)
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=60)
    assert server.returncode == 0


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--speed", "0"], "--speed must be above 0, found 0."),
        (["--speed", "nan"], "finite number for --speed, found nan"),
        (["--fault", "lose=0.1"], "unknown fault 'lose=0.1', expected drop, late"),
        (["--seed", "-1"], "--seed must be 0 or more, found -1."),
        (["--wait", "0.2"], "no one listened within 0.2 s"),
    ],
)
def test_what_cannot_be_served_is_refused(
    options: list[str],
    says: str,
    walk: Path,
    name: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    argv = ["stream", str(walk), "--name", name, *options]
    assert says in check_refused(argv, walk.parent, capfd)


def test_a_file_that_is_no_recording_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes.c3d").write_text("not a recording")
    argv = ["stream", str(tmp_path / "notes.c3d")]
    check_refused(argv, tmp_path, capfd, names=tmp_path / "notes.c3d")
