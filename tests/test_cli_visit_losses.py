"""A visit and its session: one program at a time, and nothing lost in silence."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import check_refused
from visit_page import Page, play

from ikns.cli import main
from ikns.experiments.visits import read_visit
from ikns.live.session import read_run
from ikns.live.session.row_file import RowFile

PROGRAM = "import sys; from ikns.cli import main; sys.exit(main(sys.argv[1:]))"
SHORT = ["--profiles", "T1", "--repeats", "1", "--training", "0", "--seconds", "12"]


def track(folder: Path, *more: str) -> list[str]:
    return ["track", str(folder), *SHORT, "--align", "0.5", *more]


def run(
    argv: list[str], script: Any, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    pages = play(script)
    monkeypatch.setattr("webbrowser.open", pages)
    assert main(argv) == code
    pages.done()


def test_a_second_program_at_a_visit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "v"
    argv = track(folder, "--conditions", "mouse")  # it waits for a person
    refused = []

    async def another(address: str) -> None:
        panel = Page("panel")
        await panel.come(address)
        command = [sys.executable, "-c", PROGRAM, *argv, "--no-browser"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as second:
            # Meanwhile this page answers, as a page does.
            await panel.wait(lambda shown: second.poll() is not None, seconds=300)
            assert second.stderr is not None
            refused.append((second.returncode, second.stderr.read()))
        await panel.submit("end")

    run(argv, another, monkeypatch, 0)
    ((code, said),) = refused
    assert code == 2
    assert said.count("\n") == 1
    assert f"found another run, process {os.getpid()} on " in said
    assert str(folder) in said
    capfd.readouterr()
    assert not (folder / ".lock").exists()
    assert read_visit(folder).about["participant"] == "01"


def test_a_start_that_fails_leaves_no_visit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def taken(self: object) -> None:
        raise OSError(errno.EADDRINUSE, "address already in use")

    folder = tmp_path / "study" / "v"
    argv = track(folder, "--conditions", "virtual", "--no-browser")
    with monkeypatch.context() as patch:
        patch.setattr("ikns.experiments.cockpit.Cockpit.__enter__", taken)
        check_refused(argv, tmp_path, capfd)
    assert list(tmp_path.iterdir()) == []

    async def end(address: str) -> None:
        panel = Page("panel")
        await panel.come(address)
        await panel.submit("end")

    # So another design may follow, and from then on none.
    other = track(folder, "--conditions", "virtual", "--rest", "7")
    run(other, end, monkeypatch, 0)
    with monkeypatch.context() as patch:
        patch.setattr("ikns.experiments.cockpit.Cockpit.__enter__", taken)
        check_refused([*other, "--no-browser"], tmp_path, capfd)
    assert read_visit(folder).about["design"]["rest"] == 7.0


def test_rows_that_a_visit_loses_are_on_the_panel_and_in_the_exit_code(
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    folder, shown = tmp_path / "v", {}

    def full(self: RowFile) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    async def fill(address: str) -> None:
        panel = Page("panel")
        await panel.come(address)
        await panel.wait(lambda shown: shown["source"].get("session") == "")
        monkeypatch.setattr(RowFile, "_append", full)
        await panel.wait(lambda shown: shown["source"].get("session"))
        shown.update(panel.shown["source"])
        await panel.submit("end")

    argv = track(folder, "--conditions", "ikns", "--finger", "sim:", "--json")
    argv += ["--subject", str(files / "person")]
    argv += ["--source", f"replay:{files / 'free.c3d'}?loop=yes"]
    run(argv, fill, monkeypatch, 1)
    assert "cannot be written: no space left on device" in shown["session"]
    out, err = capfd.readouterr()
    losses = json.loads(out)["losses"]
    assert losses
    for sentence in losses:
        assert "rows are missing (cannot be written: no space left" in sentence
        assert sentence.rstrip(".") in err
    # A frame has a row in two files, and the disk may be full between the two.
    kept = []
    for name in ("markers", "model"):
        (told,) = [each for each in losses if name in each]
        lost = int(told.split(": ")[1].split()[0])
        kept.append(int(told.split(" of ")[1].split()[0]) - lost)
    session = folder / read_visit(folder).about["session"]
    assert len(read_run(session).frame) == min(kept)
