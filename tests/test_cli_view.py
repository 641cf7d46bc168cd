"""``ikns view``: a page of the map, with a recording to play, and a picture."""

import json
from pathlib import Path

import numpy as np
import pytest
import small_person
from command_line import check_refused

from ikns.cli import main


@pytest.fixture(name="no_browser")
def _no_browser(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Hide every browser: an empty folder is all of the path."""
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delenv("CHROME", raising=False)


def test_view_writes_a_page_of_the_map_where_one_stands(
    files: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["view", str(files / "person")]) == 0
    text = capsys.readouterr()
    assert text.err == ""
    assert "Wrote view.html" in text.out
    assert [path.name for path in tmp_path.iterdir()] == ["view.html"]
    page = (tmp_path / "view.html").read_text(encoding="utf-8")
    assert "<h1>Null-space map of person</h1>" in page
    assert "Simulated" not in page.split("<script")[0]  # nothing says that it is


def test_view_plays_a_recording_and_says_how_many_frames(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "free.html"
    argv = ["view", str(files / "person"), str(files / "free.c3d"), "--json"]
    assert main([*argv, "--point", "3", "--out", str(out)]) == 0
    result = json.loads(capsys.readouterr().out)
    given = len(small_person.protocol().free.recording.time)
    assert result["frames_of_the_recording"] == given
    # 50 Hz to 25: every second frame, the first and the last among them if it falls so.
    assert result["frames_played"] == (given + 1) // 2
    assert result["seconds"] == pytest.approx((given - 1) // 2 * 2 / 50, abs=1e-6)
    assert result["page_bytes"] == out.stat().st_size
    page = out.read_text(encoding="utf-8")
    assert "<h1>free.c3d, person</h1>" in page
    assert "at point 3" in page


@pytest.mark.usefixtures("no_browser")
def test_without_a_browser_page_and_picture_are_written_and_the_message_helps(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, png = tmp_path / "view.html", tmp_path / "view.png"
    argv = ["view", str(files / "person"), "--out", str(out), "--png", str(png)]
    assert main([*argv, "--json"]) == 0
    text = capsys.readouterr()
    assert "apt install chromium" in text.err
    assert text.err.count("\n") == 1
    result = json.loads(text.out)
    assert result["notes"][0] in text.err
    assert out.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert png.read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {
        "bin",
        "view.html",
        "view.png",
    }


@pytest.mark.parametrize("how", ["report", "summary", "truth"])
def test_what_is_known_to_be_simulated_is_called_so(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], how: str
) -> None:
    small_person.subject().save(tmp_path / "person")
    argv = ["view", str(tmp_path / "person"), "--json"]
    if how == "report":
        path = tmp_path / "person" / "calibration.json"
        report = json.loads(path.read_text()) | {"simulated": True}
        path.write_text(json.dumps(report))
    elif how == "summary":  # as `ikns demo` leaves it
        (tmp_path / "summary.json").write_text('{"simulated": true}')
    else:  # as simulated recordings have it beside them
        (tmp_path / "free.c3d").write_bytes((files / "free.c3d").read_bytes())
        (tmp_path / "truth.json").write_text('{"simulated": true}')
        argv.insert(2, str(tmp_path / "free.c3d"))
    out = tmp_path / "view.html"
    assert main([*argv, "--out", str(out)]) == 0
    assert json.loads(capsys.readouterr().out)["simulated"] is True
    assert "Simulated subject" in out.read_text(encoding="utf-8")


def test_view_opens_the_page_that_it_wrote(
    files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python's own webbrowser runs what ``BROWSER`` names; ours writes the address."""
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {tmp_path}/asked\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    monkeypatch.setattr("webbrowser._tryorder", None)  # it asks once a process
    out = tmp_path / "view.html"
    assert main(["view", str(files / "person"), "--out", str(out), "--open"]) == 0
    assert (tmp_path / "asked").read_text().strip() == out.resolve().as_uri()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--point", "0"], "from 1 to 10, found 0"),
        (["--point", "11"], "from 1 to 10, found 11"),
        (["--point", "one"], "--point"),
        (["--out", "no/view.html"], "no/view.html"),
        (["--png", "no/view.png"], "no/view.png"),
        (["--out", "same", "--png", "./same"], "same"),
        (["--png", "same.png", "--animation", "same.png"], "same.png"),
        (["--animation", "moving.mp4"], ".gif or .png"),
        (["--animation", "no/view.gif"], "no/view.gif"),
        (["--out", "old.html"], "--force"),
        (["--png", "old.html"], "ends in .png, found .html"),
        (["nowhere.c3d"], "nowhere.c3d"),
        (["old.html"], "old.html"),
    ],
)
def test_bad_arguments_are_told_in_a_sentence(
    files: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.html").write_text("precious")
    argv = ["view", str(files / "person"), *options]
    assert said in check_refused(argv, tmp_path, capfd)


@pytest.mark.parametrize("damage", ["nobody", "map.json", "skeleton.urdf"])
def test_a_bad_subject_is_told_in_a_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], damage: str
) -> None:
    folder = tmp_path / "person"
    if damage != "nobody":
        small_person.subject().save(folder)
        path = folder / damage
        path.write_bytes(path.read_bytes()[:500])
    argv = ["view", str(folder), "--out", str(tmp_path / "view.html")]
    check_refused(argv, tmp_path, capfd)


def test_a_recording_of_somebody_else_is_told_in_a_sentence(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    recording = small_person.protocol().free.recording
    strange = small_person.write(
        tmp_path,
        "strange",
        type(recording)(
            recording.time,
            recording.markers,
            [f"Q{label}" for label in recording.labels],
            "strange",
        ),
    )
    argv = ["view", str(files / "person"), str(strange)]
    argv += ["--out", str(tmp_path / "view.html")]
    check_refused(argv, tmp_path, capfd, names=strange)


def test_force_replaces_the_page_and_the_picture(
    files: Path, tmp_path: Path, no_browser: None
) -> None:
    out, png = tmp_path / "view.html", tmp_path / "view.png"
    out.write_text("old")
    png.write_text("old")
    argv = ["view", str(files / "person"), "--out", str(out), "--png", str(png)]
    assert main(argv) == 2
    assert main([*argv, "--force"]) == 0
    assert out.stat().st_size > 1000
    assert png.stat().st_size > 1000
    assert np.frombuffer(png.read_bytes()[:1], np.uint8)[0] == 0x89
