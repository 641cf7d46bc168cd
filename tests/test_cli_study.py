"""``ikns study init`` and ``run``: a folder, cells, and sentences."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from typer.testing import CliRunner, Result

from ikns.cli import study as command
from ikns.cli.study import study_app
from ikns.errors import FileError, IknsError, InvalidInput

STUDY: dict[str, Any] = {
    "study": {"name": "quick", "seed": 5},
    "cohort": {"participants": 1},
    "tracking": {"profiles": ["T1"], "repeats": 1, "seconds": 15},
    "parameters": {"rate": 50, "point_seconds": 2},
}


def call(*argv: str | Path) -> Result:
    return CliRunner().invoke(study_app, [str(word) for word in argv])


def refused(kind: type[IknsError], *argv: str | Path) -> str:
    """What ``ikns`` would print as one sentence before leaving with 2."""
    found = call(*argv).exception
    assert isinstance(found, kind)
    assert "\n" not in str(found)
    return str(found)


def test_a_new_user_gets_an_example_and_is_told_what_is_next(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    done = call("init", folder)
    assert done.exit_code == 0
    assert "10 simulated participants, tracking and picking" in done.stdout
    assert f"ikns study run {folder}" in done.stdout
    assert "exists already; use --force" in refused(InvalidInput, "init", folder)
    found = json.loads(call("init", folder, "--force", "--json").stdout)
    assert found["study"] == str(folder / "study.toml")
    assert found["participants"] == 10


def test_a_run_says_what_it_did_and_then_that_nothing_is_left(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY))
    first = json.loads(call("run", tmp_path, "--jobs", "1", "--json").stdout)
    assert (first["cells"], first["simulated_now"], first["found"]) == (1, 1, 0)
    assert first["simulated"] is True
    assert first["failed"] == {}
    again = call("run", tmp_path, "--jobs", "1").stdout
    assert re.search(r"quick: 1 cells, 0 simulated now in \d+ s, 1 there before", again)
    assert "All participants are simulated" in again


def test_a_run_names_whom_it_could_not_simulate(tmp_path: Path) -> None:
    strict = STUDY["parameters"] | {"max_hand_speed": 1e-6}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY | {"parameters": strict}))
    done = call("run", tmp_path, "--jobs", "1")
    assert done.exit_code == 0
    assert "Note: 1 of 1 cells have no attempts: sub-01_tracking: " in done.stdout


def test_bad_input_is_one_sentence(tmp_path: Path) -> None:
    assert "expected the file of a study" in refused(FileError, "run", tmp_path)
    table = STUDY | {"cohort": {"people": 3}}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(table))
    assert "expected one of participants in [cohort], found 'people'" in refused(
        InvalidInput, "run", tmp_path
    )
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY))
    assert "1 to 1 participants, found 2" in refused(
        InvalidInput, "run", tmp_path, "--participants", "2"
    )
    assert "one process, found 0" in refused(
        InvalidInput, "run", tmp_path, "--jobs", "0"
    )
    assert call("run").exit_code == 2


def test_time_left_is_told_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "_EVERY", 0.0)
    with command._told() as report:
        report("compiling", 1, 2)
        for done in (4, 5, 6):  # four were there before
            report("simulating", done, 8)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == ["5 of 8 cells", "6 of 8 cells"]
    assert all(line.endswith("0 s left") for line in lines)
    assert [command._minutes(s) for s in (80, 600, 7200)] == ["80 s", "10 min", "2.0 h"]
