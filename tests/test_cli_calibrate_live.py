"""``ikns calibrate --live``: a simulated person streamed as if on camera."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused, contents, one_sentence
from small_person import protocol as person

from ikns.cli import main
from ikns.cli.live_calibration import _Screen
from ikns.live.calibration.protocol import Change, ProtocolStep
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording
from ikns.simulation import Protocol, Unsteadiness, simulate_protocol, virtual_subject

RATE = 50
#: Frames of a countdown. A recording begins as many frames after the frame that began
#: the countdown: that is the first of all, later the last of the step before.
COUNT = 20
#: Frames of the free exploration.
FREE = 390
PROGRAM = "import sys; from ikns.cli import main; sys.exit(main(sys.argv[1:]))"


@cache
def unsteady() -> Protocol:
    """The same person with a hand that wanders at some 0.1 m/s."""
    return simulate_protocol(
        virtual_subject(1),
        seed=1,
        n_points=1,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=1.5,
        rate=RATE,
        unsteadiness=Unsteadiness(drift=15e-3, drift_hz=1.0),
    )


@cache
def segment(name: str) -> np.ndarray:
    """Markers of one step, in the order of the static trial's labels.

    ``static``, ``free``, ``point_01`` and so on; ``unsteady_01``. The free exploration
    is the way from point to point, three times as fast.
    """
    labels = person().static.recording.labels
    kind, _, number = name.partition("_")
    run = unsteady() if kind == "unsteady" else person()
    trial = run.static if kind == "static" else run.points
    rows = slice(0, 3 * FREE, 3) if kind == "free" else slice(None)
    if number:
        (found,) = np.nonzero(trial.point == int(number) - 1)
        rows = slice(found[0], found[-1] + 1)
    seen = trial.recording.markers[rows]
    markers = np.full((len(seen), len(labels), 3), np.nan)
    for i, label in enumerate(labels):
        if label in trial.recording.labels:
            markers[:, i] = seen[:, trial.recording.labels.index(label)]
    return markers


ALL = ["static", "free", *(f"point_{k:02d}" for k in range(1, 11))]
#: What is played: at point 2 the hand is unsteady first.
PLAYED = [*ALL[:3], "unsteady_01", *ALL[3:]]


def film(path: Path, names: Sequence[str]) -> Path:
    """Write a recording that shows these steps, with countdowns before them.

    During a countdown the person stands as in the first frame of the step.
    """
    parts = []
    for name in names:
        wait = COUNT if not parts else COUNT - 1
        parts += [np.tile(segment(name)[:1], (wait, 1, 1)), segment(name)]
    markers = np.concatenate(parts)
    labels = person().static.recording.labels
    write_c3d(path, Recording(np.arange(len(markers)) / RATE, markers, labels))
    return path


def live(film: Path, out: Path, *more: str, speed: str = "max") -> list[str]:
    return [
        *["calibrate", "--live", "--source", f"replay:{film}?speed={speed}"],
        *[
            "--out",
            str(out),
            "--static-seconds",
            "1.2",
            "--free-seconds",
            str(FREE / RATE),
        ],
        *["--point-seconds", "1.5", "--countdown", str(COUNT / RATE)],
        *["--natural-seconds", "0", *more],
    ]


def offline(folder: Path, points: Sequence[str], out: Path, n: int = 10) -> Path:
    """Calibrate with the offline command from files that never went live."""
    labels = person().static.recording.labels
    names = []
    for name in ("static", *points):
        names.append(folder / f"offline_{name}.c3d")
        if not names[-1].exists():
            time_s = np.arange(len(segment(name))) / RATE
            write_c3d(names[-1], Recording(time_s, segment(name), labels))
    argv = ["calibrate", "--static", str(names[0]), "--exploration"]
    argv += [*map(str, names[1:]), "--points", str(n), "--out", str(out)]
    assert main(argv) == 0
    return out


def same_subject(one: Path, other: Path) -> None:
    """Both calibrations saw the same numbers, so they agree to the last bit.

    C3D holds single precision, and what is read from it is written back unchanged.
    """
    for name in ("map.json", "skeleton.urdf", "markers.toml"):
        assert (one / name).read_bytes() == (other / name).read_bytes()


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``person`` and its recordings, live without keys; ``offline`` beside it."""
    folder = tmp_path_factory.mktemp("live")
    argv = live(film(folder / "all.c3d", PLAYED), folder / "person", "--auto")
    assert main(argv) == 0
    offline(folder, ALL[2:], folder / "offline")
    return folder


def test_live_gives_the_map_of_the_offline_command_bit_for_bit(calibrated):
    same_subject(calibrated / "person", calibrated / "offline")


def test_every_step_is_on_disk_with_its_own_frames(calibrated):
    files = [*ALL[:3], "point_02", "point_02_take_2", *ALL[4:]]
    for file, name in zip(files, PLAYED, strict=True):
        recorded = read(calibrated / "person-recordings" / f"{file}.c3d")
        expected = segment(name)
        assert recorded.markers.shape == expected.shape
        # Single precision holds 2 m to 2 * 2^-24 m.
        np.testing.assert_allclose(recorded.markers, expected, rtol=0, atol=1.2e-7)
        assert recorded.rate == pytest.approx(RATE)


def test_every_verdict_is_written_down(calibrated):
    table = json.loads((calibrated / "person-recordings/protocol.json").read_text())
    redone = table["takes"].pop(3)
    assert [take["step"] for take in table["takes"]] == ALL
    assert {take["recommended"] for take in table["takes"]} == {"keep"}
    assert {take["outcome"] for take in table["takes"]} == {"accepted"}
    # The planted hand was told, and without keys a verdict is followed.
    assert (redone["step"], redone["outcome"]) == ("point_02", "redo")
    assert "not steady" in redone["reason"]
    point = table["takes"][-1]["values"]
    assert {"samples", "components", "range_deg", "leak_mm_per_c"} <= set(point)
    # The gate of a verdict is that of the calibration, whose body is measured once more
    # with the explorations: a sample or two at the edge of the gate may change sides.
    report = json.loads((calibrated / "offline/calibration.json").read_text())
    told = np.array([take["values"]["samples"] for take in table["takes"][2:]])
    counted = [row["still_samples"] for row in report["explorations"]]
    assert np.abs(told - counted).max() <= 2
    assert (told > 30).all()


def test_keys_accept_redo_and_skip(calibrated, tmp_path, monkeypatch, capfd):
    """Two keys a step: start and accept; point 2 twice, point 3 left out."""
    used = ["point_01", "point_03", "point_06", "point_08"]
    names = ["static", "free", "point_01", "point_05", *used[1:]]
    keys = "\n\n" * 3 + "\nr" + "\n\n" + "s" + "\n\n" * 2
    read_end, write_end = os.pipe()
    os.write(write_end, keys.encode())
    os.close(write_end)
    out = tmp_path / "person"
    with os.fdopen(read_end) as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        argv = live(film(tmp_path / "film.c3d", names), out, "--points", "5")
        assert main([*argv, "--json"]) == 0
    text, told = capfd.readouterr()
    assert [take["outcome"] for take in json.loads(text)["takes"]] == [
        *["accepted"] * 3,
        "redo",
        *["accepted"] * 3,
    ]
    assert "point_03: skipped." in told
    same_subject(out, offline(calibrated, used, tmp_path / "offline", 5))


def test_after_kill_9_the_rest_is_resumed(calibrated, tmp_path):
    out, folder = tmp_path / "person", tmp_path / "person-recordings"
    argv = live(calibrated / "all.c3d", out, "--auto", speed="16")
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *argv], stderr=subprocess.DEVNULL
    ) as process:
        give_up = time.monotonic() + 120
        while not (folder / "point_03.c3d").exists():
            assert process.poll() is None
            assert time.monotonic() < give_up
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not out.exists()
    kept = {path.stem.partition("_take")[0] for path in folder.glob("*.c3d")}
    assert kept >= set(ALL[:5])  # all that had ended
    before = contents(folder)
    left = [name for name in ALL if name not in kept]
    # What is judged at once takes no time, so a countdown begins with the first frame.
    argv = live(film(tmp_path / "left.c3d", left), out, "--auto", "--resume")
    assert main(argv) == 0
    after = contents(folder)
    assert all(after[n] == v for n, v in before.items() if n.endswith(".c3d"))
    same_subject(out, calibrated / "person")


# --- refusals -----------------------------------------------------------------------


def stopped(argv: list[str], out: Path, capfd: pytest.CaptureFixture[str]) -> str:
    """Run what must end without a subject; return the last sentence."""
    capfd.readouterr()
    assert main(argv) == 2
    text, told = capfd.readouterr()
    assert not out.exists()
    return one_sentence((text, told.splitlines(keepends=True)[-1]))


def test_a_source_that_ends_too_early_loses_nothing(tmp_path, capfd):
    out = tmp_path / "person"
    argv = live(film(tmp_path / "film.c3d", ALL[:3]), out, "--auto", "--points", "4")
    assert "ended at point_02" in stopped(argv, out, capfd)
    kept = [p.stem for p in (tmp_path / "person-recordings").glob("*.c3d")]
    assert sorted(kept) == sorted(ALL[:3])


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("\n\n" + "ssssss", "at least 4 accepted points, found a static trial and 0"),
        ("\n\n" + "sq", "stopped with 0 of 5 points accepted"),
        ("", "stopped with 0 of 5 points accepted"),
    ],
)
def test_too_few_points_are_reported_and_recordings_stay(
    tmp_path, monkeypatch, capfd, keys, says
):
    (tmp_path / "keys").write_text(keys)
    out = tmp_path / "person"
    with (tmp_path / "keys").open() as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        argv = live(film(tmp_path / "film.c3d", ["static"]), out, "--points", "5")
        assert says in stopped(argv, out, capfd)
    assert (tmp_path / "person-recordings/protocol.json").exists()
    assert (tmp_path / "person-recordings/static.c3d").exists() == bool(keys)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--static", "a.c3d"], "--static"),
        (["--static", "a.c3d", "--exploration", "b.c3d"], "one or the other"),
        (["--resume"], "no live calibration to continue"),
        (["--recordings", "no/where"], "does not exist"),
        (["--recordings", "taken"], "--resume"),
        (["--points", "0"], "0"),
        (["--n-dof", "8"], "1 to 7 for --n-dof"),
        (["--radius", "-1"], "radius"),
        (["--countdown", "-1"], "countdown"),
        (["--min-static", "9"], "--static-seconds"),
        (["--min-still", "nan"], "for --min-still, found nan"),
        (["--marker-set", "lost"], "lost"),
        (["--marker-set", "ue_adl"], "use --marker-set oxford24"),
        (["--side", "both", "--clavicle"], "--clavicle"),
    ],
)
def test_bad_options_are_reported_before_anything_is_written(
    calibrated, tmp_path, monkeypatch, capfd, more, says
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").mkdir()
    argv = live(calibrated / "all.c3d", tmp_path / "person", "--auto", *more)
    assert says in check_refused(argv, tmp_path, capfd)
    assert not (tmp_path / "person-recordings").exists()


def test_without_a_source_or_without_live_is_reported(calibrated, tmp_path, capfd):
    out = ["--out", str(tmp_path / "person")]
    for argv, says in (
        (["--live", *out], "--source"),
        (["--source", "lsl:Nobody", *out], "--live"),
        (["--auto", "--resume", *out], "--resume and --auto needs --live"),
        (out, "and --exploration, or --live"),
        (["--static", "s.c3d", *out], "expected --exploration"),
        (["--live", "--source", "tape:1", *out], "unknown source"),
        (["--live", "--source", "replay:no.c3d", *out], "no.c3d"),
    ):
        assert says in check_refused(["calibrate", *argv], tmp_path, capfd)
    there = ["--out", str(calibrated / "person")]
    argv = ["calibrate", "--live", "--source", "replay:no.c3d", *there]
    assert "--force" in check_refused(argv, calibrated, capfd)


def test_labels_that_are_missing_are_reported(tmp_path, capfd):
    whole = film(tmp_path / "film.c3d", ["static"])
    recording = read(whole)
    worn = [label for label in recording.labels if label not in ("RFIN", "LFIN")]
    path = tmp_path / "less.c3d"
    write_c3d(path, recording.select(worn))
    argv = live(path, tmp_path / "person", "--auto")
    # That of the left hand takes no part.
    said = check_refused(argv, tmp_path, capfd)
    assert "expected markers RFIN of" in said


def test_whoever_has_two_freedoms_is_told_to_turn_the_hand_too(capsys):
    step = ProtocolStep("point1", "point", 5.0)
    for turn in (False, True):
        screen = _Screen([step], auto=True, turn=turn)
        screen.change(Change(0.0, step, "countdown"), None, "10 cm to the left")
        assert ("turn the hand" in capsys.readouterr().err) == turn
