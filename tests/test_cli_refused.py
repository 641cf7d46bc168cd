"""What the first hours with the program ran into, each told in one sentence."""

from pathlib import Path

import pytest
from command_line import check_refused

from ikns.cli import main

Refused = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("convert {free} {free}", "one that is read as {free}"),
        ("check {free} {free}", "{free}: given twice; give each recording once."),
        ("ucm --subject {person} {free} {free}", "{free}: given twice"),
        ("study study", "found 'study'; see `ikns study --help`."),
        ("chek", "found 'chek'; did you mean 'check'? See `ikns --help`."),
        (
            "calibrate --static {static} --exploration {points} {points} --out new",
            "{points}: given twice for --exploration",
        ),
        (
            "calibrate --static {static} --exploration {points} --natural {free} "
            "--natural {free} --out new",
            "{free}: given twice for --natural",
        ),
    ],
)
def test_what_is_given_twice_is_not_called_empty(
    words: str, says: str, files: Path, capfd: Refused
) -> None:
    names = {name: str(files / f"{name}.c3d") for name in ("static", "points", "free")}
    names["person"] = str(files / "person")
    argv = [word.format(**names) for word in words.split()]
    assert says.format(**names) in check_refused(argv, files, capfd)


def test_a_static_trial_may_be_compared_with_itself(files: Path) -> None:
    static = str(files / "static.c3d")
    assert main(["check", "--static", static, static]) == 0


def test_a_marker_set_is_not_made_of_a_trial_in_which_the_person_moves(
    files: Path, tmp_path: Path, capfd: Refused
) -> None:
    moving = str(files / "points.c3d")
    calibrated = ["calibrate", "--static", moving, "--exploration", moving]
    said = check_refused([*calibrated, "--out", str(tmp_path / "x")], tmp_path, capfd)
    assert "the person moved: " in said
    made = ["markers", "new", moving, "--guess", "--out", str(tmp_path / "m.toml")]
    places = tmp_path / "places.txt"
    places.write_text("CLAV=sternal_notch\nRELB=right_lateral_epicondyle\n")
    placed = ["markers", "new", moving, "--sites", str(places)]
    assert check_refused(placed, tmp_path, capfd).startswith(f"ikns: {moving}: ")
    for argv in (made, ["markers", "check", "oxford24", moving]):
        assert check_refused(argv, tmp_path, capfd) == said


@pytest.mark.parametrize(
    ("words", "ending"),
    [
        ("control {free} --subject {person} --out {other} --force", ".csv"),
        ("view {person} --out {other} --force", ".html or .htm"),
        ("scale --stature 1.7 --mass 70 --sex male --out {other} --force", ".urdf"),
        ("markers new {static} --guess --out {other} --force", ".toml"),
        ("ucm {free} --subject {person} --figure {other} --force", ".svg or .pdf"),
    ],
)
def test_a_file_of_another_format_is_never_replaced(
    words: str, ending: str, files: Path, tmp_path: Path, capfd: Refused
) -> None:
    other = tmp_path / "other.c3d"
    other.write_bytes((files / "free.c3d").read_bytes())
    names = {name: str(files / f"{name}.c3d") for name in ("static", "free")}
    names |= {"person": str(files / "person"), "other": str(other)}
    argv = [word.format(**names) for word in words.split()]
    said = check_refused(argv, tmp_path, capfd)
    assert said.endswith(f"{ending}, found .c3d.\n")
    argv = [word for word in argv if word != "--force"]
    assert check_refused(argv, tmp_path, capfd) == said


LOST = ("--rename NOPE=RWRA", "no recording has the label NOPE of --rename")
ONE = ("--from 1 --to 1", "points.c3d: the part has 1 frame; at least 2 are needed")
LATE = ("--from 10 --to 5", "--from 10 s is after --to 5 s; give an earlier start.")
PARTS = [
    "check {free} --subject {person}",
    "ik {free} --subject {person} --out new.csv",
    "control {free} --subject {person} --out new.csv",
    "ucm {points} --subject {person}",
    "view {person} {free} --out new.html",
    "compare {points} --subject {person}",
    "convert {free} new.trc",
    "calibrate --static {static} --exploration {points} --out new",
]
WHOLE = [
    "markers check oxford24 {static}",
    "markers new {static} --guess --out new.toml",
    "run --subject {person} --source replay:{free} --dry-run --session new",
]


@pytest.mark.parametrize(
    ("words", "more", "says"),
    [(words, *LOST) for words in (*PARTS, *WHOLE)]
    + [(words, *wrong) for words in PARTS for wrong in (ONE, LATE)],
)
def test_a_label_or_a_part_that_no_recording_has_is_refused(
    words: str,
    more: str,
    says: str,
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: Refused,
) -> None:
    monkeypatch.chdir(tmp_path)
    names = {name: str(files / f"{name}.c3d") for name in ("static", "points")}
    names |= {"person": str(files / "person"), "free": names["points"]}
    argv = [word.format(**names) for word in f"{words} {more}".split()]
    assert says in check_refused(argv, tmp_path, capfd)
