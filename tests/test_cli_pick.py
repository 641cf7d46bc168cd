"""``ikns pick``: objects from the command line, with pages that a script plays."""

import json
from pathlib import Path
from typing import Any

import pytest
from command_line import check_refused
from visit_page import Page, play

from ikns.cli import main
from ikns.experiments.visits import read_visit

SHORT = ["--objects", "A", "--training", "0", "--rest", "0.1"]


def run(argv: list[str], script: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pages = play(script)
    monkeypatch.setattr("webbrowser.open", pages)
    assert main(argv) == 0
    pages.done()


def test_an_object_by_ring_and_by_arm(
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "v"
    order: list[str] = []

    async def conduct(address: str) -> None:
        panel, page = Page("panel"), Page("participant")
        await panel.come(address)
        await page.come(address)
        for _ in range(2):
            await panel.wait(
                lambda s: (
                    s["state"] == "waiting"
                    and s["page_connected"]
                    and s["c"] is not None
                )
            )
            order.append(panel.shown["condition"])
            await panel.submit("begin")
            await panel.until("ready")
            await page.submit("toggle")
            await panel.until("running")
            if order[-1] == "ring":
                await page.submit("press")
                await panel.wait(lambda s: (s["source"].get("measured") or 0) > 0.3)
                await panel.submit("toggle")
                await panel.until("judge")
                await panel.submit("success", "well held")
            else:
                await panel.wait(lambda s: s["source"].get("state") == "active")
                await panel.submit("dropped")
            await panel.until("waiting", "rest", "finished")
        await panel.submit("end")

    argv = ["pick", str(folder), *SHORT, "--subject", str(files / "person")]
    argv += ["--source", f"replay:{files / 'free.c3d'}?loop=yes", "--json"]
    run(argv, conduct, monkeypatch)
    result = json.loads(capfd.readouterr().out)
    assert result["left"] == 0
    assert sorted(order) == ["ikns", "ring"]
    visit = read_visit(folder, experiment="picking")
    by = {row["condition"]: row for row in visit.attempts}
    assert (by["ring"]["outcome"], by["ring"]["comment"]) == ("success", "well held")
    assert by["ikns"]["outcome"] == "dropped"
    assert all(0 < row["time"] < 20 for row in visit.attempts)
    assert "button" in visit.about["input"]["ring"]
    assert (folder / visit.about["session"] / "participants.tsv").exists()


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ([], "needs --subject"),
        (["--conditions", "gamepad"], "found 'gamepad'"),
        (["--conditions", "ring", "--objects", "Z"], "found 'Z'"),
        (["--conditions", "ring", "--objects", ""], "a value for --objects"),
        (["--conditions", "ring", "--limit", "0"], "--limit must be above 0, found 0."),
        (["--conditions", "ring", "--finger", "gpio:1"], "unknown finger"),
        (["--conditions", "ring", "--number", "-1"], "for --number, found -1"),
    ],
)
def test_bad_input_is_one_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], more: list[str], says: str
) -> None:
    argv = ["pick", str(tmp_path / "v"), "--no-browser", *more]
    assert says in check_refused(argv, tmp_path, capfd)
    assert not (tmp_path / "v").exists()
