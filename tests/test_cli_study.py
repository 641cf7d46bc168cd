"""``ikns study init`` and ``run``: a folder, cells, and sentences."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from command_line import check_refused

from ikns.cli import main
from ikns.cli import study as command

STUDY: dict[str, Any] = {
    "study": {"name": "quick", "seed": 5},
    "cohort": {"participants": 1},
    "tracking": {"profiles": ["T1"], "repeats": 1, "seconds": 15},
    "parameters": {"rate": 50, "point_seconds": 2},
}


Captured = pytest.CaptureFixture[str]


def call(capfd: Captured, *argv: str | Path) -> str:
    assert main(["study", *map(str, argv)]) == 0
    return capfd.readouterr().out


def test_a_new_user_gets_an_example_and_is_told_what_is_next(
    tmp_path: Path, capfd: Captured
) -> None:
    folder = tmp_path / "study"
    done = call(capfd, "init", folder)
    assert "10 simulated participants, tracking and picking" in done
    assert f"ikns study run {folder}" in done
    again = ["study", "init", str(folder)]
    assert "exists already; use --force" in check_refused(again, tmp_path, capfd)
    found = json.loads(call(capfd, "init", folder, "--force", "--json"))
    assert found["study"] == str(folder / "study.toml")
    assert found["participants"] == 10


def test_a_run_says_what_it_did_and_then_that_nothing_is_left(
    tmp_path: Path, capfd: Captured
) -> None:
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY))
    first = json.loads(call(capfd, "run", tmp_path, "--jobs", "1", "--json"))
    assert (first["cells"], first["simulated_now"], first["found"]) == (1, 1, 0)
    assert first["simulated"] is True
    assert first["failed"] == {}
    again = call(capfd, "run", tmp_path, "--jobs", "1")
    assert re.search(r"quick: 1 cells, 0 simulated now in \d+ s, 1 there before", again)
    assert "All participants are simulated" in again
    changed = STUDY | {"study": {"name": "quick", "seed": 6}}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(changed))
    assert "results with seed = 5, found 6" in check_refused(
        ["study", "run", str(tmp_path)], tmp_path, capfd
    )


def test_a_run_names_whom_it_could_not_simulate(
    tmp_path: Path, capfd: Captured
) -> None:
    strict = STUDY["parameters"] | {"max_hand_speed": 1e-6}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY | {"parameters": strict}))
    told = call(capfd, "run", tmp_path, "--jobs", "1")
    assert "Note: 1 of 1 cells have no attempts: sub-01_tracking: " in told


@pytest.mark.parametrize(
    ("tables", "options", "sentence"),
    [
        (None, [], "no such file; `ikns study init`"),
        (
            {"cohort": {"people": 3}},
            [],
            "expected one of participants in [cohort], found 'people'",
        ),
        ({}, ["--participants", "2"], "1 to 1 participants, found 2"),
        ({}, ["--jobs", "0"], "one process, found 0"),
        ({}, ["--job", "1"], "has no option --job"),
        ({"study": {"name": "x", "simulated": False}}, [], "found one of people"),
    ],
)
def test_bad_input_is_one_sentence(
    tables: dict | None,
    options: list[str],
    sentence: str,
    tmp_path: Path,
    capfd: Captured,
) -> None:
    if tables is not None:
        (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY | tables))
    argv = ["study", "run", str(tmp_path), *options]
    assert sentence in check_refused(argv, tmp_path, capfd)


def test_time_left_is_told_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "_EVERY", 0.0)
    estimates: dict[str, Countdown] = {}
    with command._progress_or_lines(estimates) as report:
        report("compiling", 1, 2)
        report("simulating", 4, 8)
        estimates["simulating"] = Countdown([None, 600.0, 7200.0])
        for done in (4, 5, 6):
            report("simulating", done, 8)
    assert capsys.readouterr().err.splitlines() == [
        "5 of 8 cells, about 10 min left",
        "6 of 8 cells, about 2.0 h left",
    ]
    assert command._minutes(80) == "80 s"


class Countdown:
    """An estimate that says one thing after the other."""

    def __init__(self, said: list[float | None]) -> None:
        self._said = iter(said)

    def seconds(self) -> float | None:
        return next(self._said)

    def share(self) -> float:
        return 0.5
