"""No command replaces what it reads, whatever name its output goes by.

The commands and their paths are those of the program itself: a new one must be entered
here, or a test fails.
"""

import inspect
import os
import shutil
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from command_line import check_refused

from ikns.cli.app import command_parser

#: Options and arguments that name something to write, by command.
FILES_OUT = {
    "scale": ["out"],
    "ik": ["out"],
    "control": ["out", "figure"],
    "convert": ["target"],
    "markers new": ["out"],
    "compare": ["figure"],
    "robot": ["figure"],
    "ucm": ["figure"],
    "view": ["out", "png", "animation", "rrd"],
    "replay": ["export"],
    "study plan": ["figure"],
}
FOLDERS_OUT = {
    "calibrate": ["out"],
    "demo": ["out"],
    "report": ["out"],
    "docs": ["pictures"],
}
#: Written too, but only where nothing is or what the command itself began: --force is
#: not offered.
NEW_OUT = {
    "calibrate": ["recordings"],
    "run": ["session", "rrd"],
    "servo": ["link"],
    "track": ["visit", "session", "rrd"],
    "pick": ["visit", "session", "rrd"],
    "study init": ["folder"],
}
#: A command that reads, and one valid use of all paths that it reads, by option.
PERSON = {"subject": "person"}
NAMES = {"labels": "names.txt"}
READS: dict[str, tuple[list[str], dict[str, str]]] = {
    "scale": (["--stature", "1.75", "--mass", "70", "--sex", "male"], {}),
    "ik": ([], {"recording": "free.c3d", **PERSON, **NAMES}),
    "check": ([], {"recordings": "free.c3d", **PERSON, **NAMES}),
    "convert": ([], {"source": "free.c3d", **NAMES}),
    "markers list": ([], {}),
    "markers show": (["oxford24"], {}),
    "markers sites": ([], {}),
    "markers check": (
        ["oxford24"],
        {"static": "static.c3d", "movement": "free.c3d", **NAMES},
    ),
    "markers new": (
        [],
        {
            "static": "static.c3d",
            "movement": "free.c3d",
            "sites": "sites.txt",
            **NAMES,
        },
    ),
    "control": ([], {"recording": "free.c3d", **PERSON, **NAMES}),
    "compare": (
        [],
        {"recording": "points.c3d", "reaches": "free.c3d", **PERSON, **NAMES},
    ),
    "robot": (["--frame", "tip"], {"urdf": "model.urdf", "angles": "free.csv"}),
    "ucm": ([], {"recordings": "points.c3d", **PERSON, **NAMES}),
    "view": ([], {"subject": "person", "recording": "free.c3d", **NAMES}),
    "replay": ([], {"session": "session"}),
    "calibrate": ([], {"static": "static.c3d", "exploration": "points.c3d", **NAMES}),
    "demo": ([], {}),
    "docs": ([], {}),
    "run": (["--source", "replay:free.c3d"], {**PERSON, **NAMES}),
    "servo": ([], {}),
    "track": ([], {"study": "study", **PERSON, **NAMES}),
    "pick": ([], {"study": "study", **PERSON, **NAMES}),
    "report": ([], {"study": "study"}),
    "study init": ([], {}),
    "study run": ([], {"folder": "study"}),
    "study plan": ([], {"study": "study", "pilot": "pilot"}),
    "stream": ([], {"recording": "free.c3d", **NAMES}),
}


#: Paths that a command reads besides or instead of one of those.
INSTEAD = {"ik": ["static"], "check": ["static"], "calibrate": ["natural", "subject"]}


def leaves(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    below = getattr(command, "commands", None)
    if below is None:
        yield name, command
    for part, each in (below or {}).items():
        yield from leaves(each, f"{name} {part}".strip())


COMMANDS = dict(leaves(command_parser()))


def paths(command: Any) -> list[str]:
    hints = typing.get_type_hints(inspect.unwrap(command.callback))
    return [name for name, hint in hints.items() if "Path" in str(hint)]


def options(command: Any) -> dict[str, Any]:
    return {p.name: p for p in command.params}


@pytest.mark.parametrize("name", COMMANDS)
def test_it_is_known_which_paths_a_command_reads_and_which_it_writes(name: str) -> None:
    written = [
        option
        for outputs in (FILES_OUT, FOLDERS_OUT, NEW_OUT)
        for option in outputs.get(name, [])
    ]
    read = [*READS[name][1], *INSTEAD.get(name, [])]
    assert sorted(written + read) == sorted(paths(COMMANDS[name]))
    forced = "force" in options(COMMANDS[name])
    assert forced == (
        name in FILES_OUT or name in FOLDERS_OUT or name == "study init"
    ), "what is written with --force must be in FILES_OUT or FOLDERS_OUT"


@pytest.fixture
def desk(files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with everything that a command may read."""
    place = tmp_path / "desk"
    shutil.copytree(files, place)
    monkeypatch.chdir(place)
    for name in ("study", "pilot", "session"):
        (place / name / "visits").mkdir(parents=True)
        (place / name / "study.toml").write_text("declared")
    (place / "names.txt").write_text("ELBOW=RELB")
    (place / "sites.txt").write_text("RELB=right_lateral_epicondyle")
    for name in ("model.urdf", "free.csv"):
        (place / name).write_text("needed")
    return place


def argv(name: str, output: str, target: Path) -> list[str]:
    command, (fixed, inputs) = options(COMMANDS[name]), READS[name]
    words = [*name.split(), *fixed]
    for option, value in [*inputs.items(), (output, str(target))]:
        if command[option].param_type_name == "argument":
            words.append(value)
        else:
            words += [command[option].opts[0], value]
    return [*words, "--force"]


def symlink(target: Path, source: Path) -> None:
    target.symlink_to(source)


def chain_of_links(target: Path, source: Path) -> None:
    (target.parent / "between").symlink_to(source)
    target.symlink_to("between")


DISGUISES: dict[str, Callable[[Path, Path], None]] = {
    "symlink": symlink,
    "chain": chain_of_links,
    "hard link": lambda target, source: os.link(source, target),
}
SUFFIX = {
    "target": ".c3d",
    "figure": ".png",
    "png": ".png",
    "animation": ".gif",
    "export": ".csv",
    "rrd": ".rrd",
}
READERS = [
    (name, output, option)
    for name, outputs in FILES_OUT.items()
    for output in outputs
    for option in READS[name][1]
]


def one_file(place: Path) -> Path:
    """The input itself, or a file of it."""
    return (
        next(p for p in sorted(place.rglob("*")) if p.is_file())
        if (place.is_dir())
        else place
    )


@pytest.mark.parametrize(("name", "output", "option"), READERS)
def test_force_never_replaces_a_file_that_is_read(
    name: str,
    output: str,
    option: str,
    desk: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    source = one_file(desk / READS[name][1][option])
    # Under its own name, on a way round, and where the ending allows it as what it is.
    for plain in (source, desk / "person" / ".." / source.relative_to(desk)):
        check_refused(argv(name, output, plain), desk, capfd)
    for disguise in DISGUISES.values():
        target = desk / f"out{SUFFIX.get(output, '.csv')}"
        disguise(target, source)
        sentence = check_refused(argv(name, output, target), desk, capfd, names=target)
        assert "this file is also an input" in sentence
        target.unlink()
        (desk / "between").unlink(missing_ok=True)


@pytest.mark.parametrize(
    ("name", "output", "option"),
    [(n, o, i) for n, outs in FOLDERS_OUT.items() for o in outs for i in READS[n][1]],
)
def test_force_never_replaces_a_folder_with_what_is_read(
    name: str,
    output: str,
    option: str,
    desk: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    source = desk / READS[name][1][option]
    around = source if source.is_dir() else source.parent
    (desk.parent / "link").symlink_to(around)
    for target in (around, desk.parent / "link", around / ".." / around.name):
        check_refused(argv(name, output, target), desk, capfd)


def test_a_marker_set_in_the_subject_folder_stays(
    desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # All files of the folder are our own, so --force alone would replace it.
    words = [*argv("calibrate", "out", desk / "person"), "--marker-set"]
    for given in (desk / "person" / "markers.toml", desk / "linked.toml"):
        if not given.exists():
            os.link(desk / "person" / "markers.toml", given)
        sentence = check_refused([*words, str(given)], desk, capfd)
        assert "which is an input" in sentence


def test_what_comes_from_standard_input_is_not_replaced(
    desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (desk / "in.c3d").symlink_to("/dev/stdin")
    words = ["ik", "--subject", "person", "in.c3d", "--out", "free.c3d", "--force"]
    kept = os.dup(0)
    with (desk / "free.c3d").open("rb") as file:
        os.dup2(file.fileno(), 0)
        try:
            sentence = check_refused(words, desk, capfd)
        finally:
            os.dup2(kept, 0)
            os.close(kept)
    assert "this file is also an input, in.c3d" in sentence
