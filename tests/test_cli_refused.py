"""What the first hours with the program ran into, each told in one sentence."""

from pathlib import Path

import pytest
from command_line import check_refused

from ikns.cli import main

Refused = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (
            "convert {free} {free}",
            "{free}: this file is also an input; give the output another name.",
        ),
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


ODD: dict[str, bytes] = {
    "odd.csv": b"a,b\n",
    "bad.toml": b"name = 'x'\n",
    "no.c3d": b"hello",
    "bytes.urdf": b"\xff\xfe\x00",
    "bytes.csv": b"\xff\xfe\x00",
    "one.csv": b"time_s,a_rad\n0,1\n",
    "file": b"x",
}
ARM = (
    '<robot name="r"><link name="base"/><link name="tip"/><joint name="a" '
    'type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("ik adir --static {static}", "adir: this is a folder; give one recording."),
        ("check adir", "adir: this is a folder; give one recording."),
        ("stream adir", "adir: this is a folder; give one recording."),
        ("convert adir new.trc", "adir: this is a folder; give one recording."),
        ("view {person} adir", "adir: this is a folder; give one recording."),
        ("markers new {static} --sites odd.csv", "odd.csv: expected LABEL=PLACE"),
        ("markers show bad.toml", "bad.toml: the line `format = 1` is missing."),
        (
            "scale --stature 1.7 --mass -7 --sex male --out new.urdf",
            "mass is -7 kg, expected 25 to 250 kg.\n",
        ),
        ("check no.c3d", "no.c3d: this is not a C3D file (it starts with the bytes "),
        ("robot bytes.urdf one.csv --frame tip", "this is not a text file"),
        ("robot arm.urdf bytes.csv --frame tip", "this is not a text file."),
        ("robot arm.urdf one.csv --frame tip", "at least 2 rows, found 1 row."),
        ("stream {static} --fault drop=2", "drop=2: a probability must be between"),
        ("stream {static} --fault drop=1,swap=1", "drop=1, swap=1: probabilities"),
        ("replay file", "file: this is a file; give a folder that `ikns run`"),
        ("report file", "file: this is a file; give the folder of a study."),
        ("study run nowhere", "nowhere: there is no such folder; "),
        ("convert {static} no/such/new.trc", "the folder no/such does not exist"),
        (
            "convert {static} file/new.trc",
            "file/new.trc: file is a file; give a folder",
        ),
    ],
)
def test_each_odd_thing_is_called_what_it_is(
    words: str,
    says: str,
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: Refused,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "adir").mkdir()
    for name, content in (ODD | {"arm.urdf": ARM.encode()}).items():
        (tmp_path / name).write_bytes(content)
    names = {"static": str(files / "static.c3d"), "person": str(files / "person")}
    argv = [word.format(**names) for word in words.split()]
    assert says in check_refused(argv, tmp_path, capfd)


def test_a_check_without_a_static_trial_says_so_and_no_zero_has_a_sign(
    files: Path, capfd: Refused
) -> None:
    assert main(["check", str(files / "free.c3d")]) == 0
    said = " ".join(capfd.readouterr().out.split())
    assert "Roles" in said
    assert "movement, without a static trial" in said
    assert main(["markers", "check", "oxford24", str(files / "static.c3d")]) == 0
    assert "-0" not in capfd.readouterr().out.split()
