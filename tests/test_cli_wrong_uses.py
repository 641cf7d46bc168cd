"""Hundreds of wrong uses: each is one sentence, exit code 2, and nothing is written."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import one_sentence, stamps
from wrong_uses import ALL, options, undescribed

from ikns.cli import main
from ikns.experiments.study import init_study

#: Longest time that a refusal may take, s. The slowest took 0.8 s when measured.
PATIENCE = 5

LINKS = '<link name="base"/><link name="arm"/><link name="tip"/>'
TURN = (
    '<joint name="turn" type="{type}"><parent link="base"/><child link="arm"/>'
    '<origin xyz="{origin}"/><axis xyz="{axis}"/>'
    '<limit lower="{low}" upper="1" effort="1" velocity="1"/></joint>'
)
END = (
    '<joint name="end" type="revolute"><parent link="arm"/><child link="{child}"/>'
    '<origin xyz="1 0 0"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
)


def robot(
    *,
    type: str = "revolute",
    axis: str = "0 0 1",
    origin: str = "1 0 0",
    low: str = "-1",
    child: str = "tip",
    more: str = "",
) -> str:
    turn = TURN.format(type=type, axis=axis, origin=origin, low=low)
    return f'<robot name="r">{LINKS}{turn}{END.format(child=child)}{more}</robot>'


URDFS = {
    "urdf": robot(),
    "nested": "<robot>" + "<link>" * 200_000 + "</link>" * 200_000 + "</robot>",
    "still_axis": robot(axis="0 0 0"),
    "nan_axis": robot(axis="nan 0 1"),
    "loop": robot(child="base"),
    "no_parent": robot().replace('<parent link="base"/>', ""),
    "bad_origin": robot(origin="1 x 0"),
    "bad_limit": robot(low="low"),
    "two_roots": robot(more='<link name="island"/>'),
    "twins": robot(more='<link name="arm"/>'),
    "entities": '<!DOCTYPE r [<!ENTITY a "&b;&b;"><!ENTITY b "x">]>'
    + robot(more="&c;"),
    "not_robot": "<html><body/></html>",
    "strange_type": robot(type="magnetic"),
    "no_type": robot().replace(' type="revolute"', "", 1),
}


@pytest.fixture(scope="module")
def places(files: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What braces stand for."""
    shelf = tmp_path_factory.mktemp("shelf")
    found = {name: str(files / f"{name}.c3d") for name in ("static", "points", "free")}
    found |= {"person": str(files / "person"), "nowhere": str(shelf / "nowhere")}
    for name, text in URDFS.items():
        (shelf / f"{name}.urdf").write_text(text)
        found[name] = str(shelf / f"{name}.urdf")
    (shelf / "angles.csv").write_text(
        "time_s,turn_rad,end_rad\n"
        + "".join(f"{k / 10},{k / 100},{-k / 50}\n" for k in range(50))
    )
    (shelf / "folder").mkdir()
    (shelf / "folder" / "mine.txt").write_text("mine")
    (shelf / "binary.c3d").write_bytes(bytes(range(256)) * 8)
    (shelf / "empty.c3d").write_bytes(b"")
    argv = f"run --subject {found['person']} --source replay:{found['free']} --dry-run"
    assert main([*argv.split(), "--session", str(shelf / "session"), "--json"]) == 0
    init_study(shelf / "study")
    return found | {
        "angles": str(shelf / "angles.csv"),
        "folder": str(shelf / "folder"),
        "binary": str(shelf / "binary.c3d"),
        "empty": str(shelf / "empty.c3d"),
        "latin": str(shelf / os.fsdecode(b"\xff.c3d")),
        "deep": str(shelf / ("x" * 300)),
        "session": str(shelf / "session"),
        "study": str(shelf / "study"),
        "shelf": str(shelf),
    }


class Hung(BaseException):
    """No command catches it."""


@pytest.fixture(autouse=True)
def _watchdog() -> Iterator[None]:
    """A command that does not end is interrupted."""

    def stop(number: int, frame: object) -> None:
        raise Hung(f"no answer within {PATIENCE} s")

    before = signal.signal(signal.SIGALRM, stop)
    terminate = signal.getsignal(signal.SIGTERM)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
    signal.signal(signal.SIGTERM, terminate)


def test_every_option_is_attacked() -> None:
    assert undescribed() == []
    assert len(ALL) >= 190
    used = {" ".join(words[:2]) for words in ALL} | {w[0] for w in ALL if w}
    assert set(options()) <= used


@pytest.mark.parametrize(
    "words",
    ALL,
    ids=lambda words: ascii(" ".join(words))[1:-1],
)
def test_a_wrong_use_is_one_sentence(
    words: list[str],
    places: dict[str, str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    argv = [word.format(**places) for word in words]
    monkeypatch.chdir(tmp_path)
    shelf = stamps(Path(places["shelf"]))
    capfd.readouterr()
    began = time.monotonic()
    assert main(argv) == 2
    assert time.monotonic() - began < PATIENCE
    out, err = capfd.readouterr()
    if words in ([], ["study"]):  # the help was asked for
        assert err == ""
        return
    one_sentence((out, err))
    assert "Traceback" not in err
    assert len(err) < 1000
    assert list(tmp_path.iterdir()) == []
    assert stamps(Path(places["shelf"])) == shelf
