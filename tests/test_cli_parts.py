"""Other labels and a part of a recording, for every command that reads one."""

import json
from pathlib import Path

import numpy as np
import pytest
import small_person

from ikns.cli import main
from ikns.recording.files import read
from ikns.recording.recording import Recording

PART = ["--from", "2", "--to", "16"]
NAMES = {"RWRA": "wrist in", "RELB": "elbow out"}


def answer(argv: list[str], capsys: pytest.CaptureFixture[str]) -> dict:
    capsys.readouterr()
    assert main([*argv, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture
def renamed(files: Path, tmp_path: Path) -> Path:
    """The points with labels of another laboratory."""
    points = read(files / "points.c3d")
    labels = [NAMES.get(label, label) for label in points.labels]
    return small_person.write(
        tmp_path, "renamed", Recording(points.time, points.markers, labels)
    )


def mapping(folder: Path) -> Path:
    path = folder / "names.txt"
    path.write_text("".join(f"{new}={old}\n" for old, new in NAMES.items()))
    return path


def test_converted_files_have_the_new_labels(
    files: Path, renamed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "new.trc"
    argv = ["convert", str(renamed), str(target), "--rename", "wrist in=RWRA"]
    assert "elbow out" in answer(argv, capsys)["names"]
    argv += ["--labels", str(mapping(tmp_path)), "--force"]
    assert main([*argv, "--rename", "lost=RFIN"]) == 2
    assert "label lost of --rename" in capsys.readouterr().err
    assert main(argv) == 0
    assert read(target).labels == read(files / "points.c3d").labels


def test_a_renaming_says_that_it_applies_to_the_static_trial_too(
    files: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    argv = ["check", str(files / "points.c3d"), "--rename", "RFIN=LFIN"]
    assert main(argv) == 2
    assert "--static" not in capsys.readouterr().err
    assert main([*argv, "--static", str(files / "static.c3d")]) == 2
    said = capsys.readouterr().err
    assert said.endswith("; --rename and --labels apply to --static too.\n")
    monkeypatch.setenv("COLUMNS", "200")
    for command, told in (("check", True), ("ik", True), ("markers check", False)):
        assert main([*command.split(), "--help"]) == 0
        assert ("every recording, --static too" in capsys.readouterr().out) == told


def test_a_replayed_recording_drives_the_finger_under_its_new_labels(
    files: Path, renamed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["run", "--subject", str(files / "person"), "--dry-run"]
    plain = [*argv, "--source", f"replay:{files / 'points.c3d'}?speed=max"]
    other = [*argv, "--source", f"replay:{renamed}?speed=max"]
    assert main(other) == 2
    assert "RELB, RWRA" in capsys.readouterr().err
    found = answer([*other, "--labels", str(mapping(tmp_path))], capsys)
    as_before = answer(plain, capsys)
    for key in ("frames", "rejections"):
        assert found[key] == as_before[key]


@pytest.mark.parametrize("command", ["compare", "ucm"])
def test_a_part_counts_as_a_recording_of_its_own(
    command: str, files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, cut = str(files / "points.c3d"), str(tmp_path / "points.c3d")
    assert main(["convert", whole, cut, *PART]) == 0
    person = ["--subject", str(files / "person")]
    few = ["--intervals", "0"] if command == "compare" else ["--surrogates", "10"]
    part, alone, everything = (
        answer([command, *given, *person, *few], capsys)["points"]
        for given in ([whole, *PART], [cut], [whole])
    )
    # Positions are written as 32-bit numbers of mm, so the parts agree to 1e-4.
    assert _near(part, alone)
    assert not _near(part, everything)


def test_a_part_alone_is_judged(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = read(files / "points.c3d")
    markers = points.markers.copy()
    markers[20:25, points.labels.index("RFIN")] += 0.3
    ghost = Recording(points.time, markers, points.labels)
    path = small_person.write(tmp_path, "ghost", ghost)
    argv = ["check", str(path), "--subject", str(files / "person")]
    assert [found["kind"] for found in answer(argv, capsys)["findings"]] == ["ghost"]
    assert answer([*argv, *PART], capsys)["findings"] == []


def test_a_part_of_every_exploration_is_learned_from(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    static, points = str(files / "static.c3d"), str(files / "points.c3d")
    argv = ["calibrate", "--static", static, "--exploration", points, *PART]
    found = answer([*argv, "--out", str(tmp_path / "new")], capsys)
    assert found["explorations"][0]["duration_s"] == pytest.approx(14, abs=0.05)


def _near(a: object, b: object) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_near(a[k], b[k]) for k in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_near, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return a == pytest.approx(b, rel=1e-2, abs=1e-4)
    return a == b


def test_a_still_part_of_a_recording_makes_a_marker_set(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = read(files / "static.c3d")
    # The right hand goes 10 cm forward and back before the person stands still.
    end = len(still.time) / still.rate
    markers = np.concatenate([still.markers, still.markers])
    times = np.arange(len(markers)) / still.rate
    hand = [still.labels.index(label) for label in ("RWRA", "RWRB", "RFIN")]
    ahead = 0.05 * (1 - np.cos(2 * np.pi * times / end)) * (times < end)
    markers[:, hand, 0] += ahead[:, None]
    path = small_person.write(tmp_path, "both", Recording(times, markers, still.labels))
    made = str(tmp_path / "mine.toml")
    argv = ["markers", "new", str(path), "--guess", "--out", made]
    assert main(argv) == 2
    assert "moves" in capsys.readouterr().err
    part = ["--from", f"{end:.2f}"]
    assert main([*argv, *part]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert f"ikns markers check {made} {path} {' '.join(part)}" in words
    assert main(["markers", "check", made, str(path), *part]) == 0
    assert main(["markers", "check", made, str(path)]) == 2
