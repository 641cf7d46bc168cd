"""Commands that read a recording of a known person refuse one that must not be used."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import small_person
from command_line import check_refused

from ikns.calibration.judged_motion import judged_motion
from ikns.cli import main
from ikns.errors import MarkerMismatch
from ikns.recording.recording import Recording

COMMANDS = {
    "ik": ["--out", "new.csv"],
    "control": ["--out", "new.csv"],
    "compare": [],
    "ucm": [],
    "check": [],
}
Change = Callable[[Recording], Recording]


def placed(recording: Recording, markers: np.ndarray) -> Recording:
    return Recording(recording.time, markers, recording.labels, recording.source)


def swap(recording: Recording, a: str, b: str) -> Recording:
    labels = [{a: b, b: a}.get(label, label) for label in recording.labels]
    return Recording(recording.time, recording.markers, labels, recording.source)


def scaled(recording: Recording, factor: float | list[float]) -> Recording:
    return placed(recording, recording.markers * factor)


def not_seen_as_a_number(recording: Recording) -> Recording:
    return placed(recording, np.nan_to_num(recording.markers, nan=-9.999))


#: What a sentence about each must say.
WRONG: dict[str, tuple[Change, str]] = {
    "exchanged": (partial(swap, a="RWRA", b="RWRB"), "swap RWRA and RWRB"),
    "unit": (partial(scaled, factor=10.0), "correct the unit"),
    "not seen": (not_seen_as_a_number, "empty cells"),
}


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A file of each kind."""
    folder = tmp_path_factory.mktemp("wrong")
    points = small_person.protocol().points.recording
    return {
        kind: small_person.write(folder, kind.replace(" ", "_"), change(points))
        for kind, (change, _) in WRONG.items()
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_another_person_than_in_the_subject_folder_is_told(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    points, person = small_person.protocol().points.recording, small_person.subject()
    if command in ("check", "control", "ik"):  # the others need all places
        points = small_person.cut(points, 0, 100)
    ben = Recording(
        points.time, points.markers, [f"Ben:{one}" for one in points.labels], "ben"
    )
    path = small_person.write(tmp_path, "ben", ben)
    static = person.report["static"] | {"subjects": ["ann"]}
    replace(person, report=person.report | {"static": static}).save("ann")
    assert main([command, str(path), "--subject", "ann", *COMMANDS[command]]) == 0
    assert "was calibrated as ann" in " ".join(capfd.readouterr().out.split())


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("command", COMMANDS)
def test_what_must_not_be_used_is_refused_with_what_is_wrong(
    command: str,
    kind: str,
    files: Path,
    wrong: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    argv = [command, str(wrong[kind]), "--subject", str(files / "person")]
    argv += COMMANDS[command]
    if command == "check":  # which prints its table too
        assert main(argv) == 2
        sentence = capfd.readouterr().err
    else:
        sentence = check_refused(argv, tmp_path, capfd, names=wrong[kind])
    assert WRONG[kind][1] in sentence


def test_natural_movement_reaches_and_recordings_beside_a_static_trial_are_judged_too(
    files: Path,
    wrong: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    static, points = str(files / "static.c3d"), str(files / "points.c3d")
    bad = wrong["exchanged"]
    for argv in (
        ["compare", points, "--subject", str(files / "person"), "--reaches", str(bad)],
        ["ik", str(bad), "--static", static, "--out", "new.csv"],
        [
            *("calibrate", "--static", static, "--exploration", points),
            *("--natural", str(bad), "--out", "new"),
        ],
    ):
        check_refused(argv, tmp_path, capfd, names=bad)


def test_a_static_trial_too_short_is_refused_by_all_in_one_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = small_person.protocol().static.recording
    short = str(small_person.write(tmp_path, "short", small_person.cut(whole, 0, 15)))
    points, free = (str(files / f"{name}.c3d") for name in ("points", "free"))
    out = ["--out", str(tmp_path / "new")]
    lines = {
        "check": [free, "--static", short],
        "check alone": [short],
        "ik": [free, "--static", short, "--out", str(tmp_path / "new.csv")],
        "markers check": ["oxford24", short],
        "markers new": [short, "--guess", "--out", str(tmp_path / "new.toml")],
        "calibrate": ["--static", short, "--exploration", points, *out],
    }
    told = set()
    for name, rest in lines.items():
        assert main([*name.removesuffix(" alone").split(), *rest]) == 2
        told.add(capfd.readouterr().err)
    (sentence,) = told
    assert "lasts 0.30 s, expected at least 1 s" in sentence
    words = sentence.rstrip(".\n").split()
    option = words[words.index("--min-static") :]
    assert main(["check", free, "--static", short, *option]) == 0
    assert list(tmp_path.glob("new*")) == []


def test_a_wrong_recording_can_be_looked_at(
    files: Path,
    wrong: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    argv = ["view", str(files / "person"), str(wrong["exchanged"])]
    assert main([*argv, "--to", "2", "--out", str(tmp_path / "view.html")]) == 0
    assert "swap RWRA and RWRB" in capsys.readouterr().err


def test_what_spoils_a_moment_is_said_and_the_rest_is_used() -> None:
    person = small_person.subject()
    points = small_person.protocol().points.recording
    markers = np.array(points.markers)
    rows, column = slice(300, 310), points.labels.index("RFIN")
    markers[rows, column] += 0.3
    motion, warned = judged_motion(
        person.skeleton, placed(points, markers), chain=person.chain
    )
    clean, nothing = judged_motion(person.skeleton, points, chain=person.chain)
    assert nothing == []
    assert any("RFIN" in sentence and "301-310" in sentence for sentence in warned)
    assert any("10 of" in sentence and "left out" in sentence for sentence in warned)
    lost = np.isnan(motion.angles) & np.isfinite(clean.angles)
    assert lost.any(axis=1)[rows].all()
    assert not lost[:300].any()


def test_a_single_frame_is_judged() -> None:
    person = small_person.subject().skeleton
    points = small_person.protocol().points.recording
    seen = np.isfinite(points.markers).all(axis=(1, 2))
    one = small_person.cut(points, int(np.argmax(seen)), int(np.argmax(seen)) + 1)
    motion, warned = judged_motion(person, one)
    assert (len(motion.time), warned) == (1, [])
    with pytest.raises(MarkerMismatch, match="swap RWRA and RWRB"):
        judged_motion(person, swap(one, "RWRA", "RWRB"))
