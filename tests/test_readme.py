"""What the README shows is there and runs as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest
import small_person

from ikns.cli import main

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


#: Commands with commands of their own.
GROUPS = ("markers", "study")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def test_the_examples_run(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "ikns-demo" / "recordings").mkdir(parents=True)
    for trial in small_person.protocol().trials:
        small_person.write(
            tmp_path / "ikns-demo" / "recordings", trial.name, trial.recording
        )
    small_person.subject().save(tmp_path / "ikns-demo" / "subject")
    monkeypatch.chdir(tmp_path)
    offline, live = blocks("python")
    assert len([line for line in offline.splitlines() if line]) <= 15
    names: dict[str, object] = {}
    exec(compile(offline, "README.md", "exec"), names)
    assert "degrees" in capsys.readouterr().out
    assert np.isfinite(names["c"]).all()
    exec(compile(live, "README.md", "exec"), names)
    assert "frames:" in capsys.readouterr().out
    assert names["log"].frames == len(names["points"].time)


def test_set_up_is_two_commands() -> None:
    commands = "".join(blocks("bash")).splitlines()
    assert len(commands) == 2
    assert all(command.startswith("python3 -m venv .venv &&") for command in commands)


def test_every_command_line_shown_is_one_that_the_program_knows(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    shown = [line.split() for line in "".join(blocks("console")).splitlines()]
    assert {line[1] for line in shown} == {
        "calibrate",
        "check",
        "compare",
        "control",
        "convert",
        "ik",
        "markers",
        "pick",
        "replay",
        "report",
        "robot",
        "run",
        "scale",
        "servo",
        "stream",
        "study",
        "track",
        "ucm",
        "view",
    }
    for program, command, *rest in shown:
        assert program == "ikns"
        place = [command, rest.pop(0)] if command in GROUPS else [command]
        assert main([*place, "--help"]) == 0
        text = capsys.readouterr().out
        for option in re.findall(r"--\S+", " ".join(rest)):
            assert option in text


def test_every_link_leads_to_a_file_and_pictures_are_small() -> None:
    links = re.findall(r"\]\((?!https?://)([^)#]+)", README)
    assert links
    for link in links:
        assert (ROOT / link).is_file(), link
    pictures = [ROOT / link for link in links if link.endswith(".png")]
    assert pictures
    assert max(picture.stat().st_size for picture in pictures) < 200_000
