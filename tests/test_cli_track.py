"""``ikns track``: a visit from the command line, with pages that a script plays."""

import json
import math
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import check_refused, contents
from visit_page import Page, play

from ikns.calibration.subject import Subject
from ikns.cli import main
from ikns.experiments.study.summary import summarize
from ikns.experiments.visits import read_visit, tracking_record
from ikns.live.session import read_run
from ikns.view.study_report.map_section import map_figure

SHORT = ["--profiles", "T1", "--repeats", "1", "--training", "0", "--seconds", "12"]


def run(
    argv: list[str], script: Any, monkeypatch: pytest.MonkeyPatch, code: int = 0
) -> play:
    pages = play(script)
    monkeypatch.setattr("webbrowser.open", pages)
    assert main(argv) == code
    pages.done()
    return pages


def test_a_virtual_operator_plays_by_itself_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "v"

    async def look(address: str) -> None:
        panel = Page("panel")
        await panel.come(address)
        assert panel.hello["simulated"] is True
        await panel.until("track")  # nobody has begun it
        await panel.wait(lambda shown: shown["trial"].get("time", 0) > 1.5)
        await panel.submit("end")

    argv = ["track", str(folder), "--conditions", "virtual", *SHORT, "--align", "1"]
    pages = run([*argv, "--json"], look, monkeypatch)
    result = json.loads(capfd.readouterr().out)
    assert result["left"] == 1
    assert result["simulated"] is True
    assert len(pages.addresses) == 2
    assert all(a.startswith("http://127.0.0.1:") for a in pages.addresses)
    assert all("?token=" in a for a in pages.addresses)
    visit = read_visit(folder, experiment="tracking")
    assert visit.about["simulated"] is True
    assert visit.about["input"] == {"virtual": "virtual operator"}
    (row,) = visit.attempts
    assert row["outcome"] == "aborted"
    record = tracking_record(row)
    # It was at the line within 2.5 s, and stayed there.
    near = record.time > 0
    assert np.abs(record.y - record.target)[near].max() < 15.0
    # The same command without its options is the same visit.
    run(["track", str(folder)], look, monkeypatch)
    assert "(simulated)" in capfd.readouterr().out
    again = read_visit(folder)
    assert [r["outcome"] for r in again.attempts] == ["aborted", "aborted"]
    assert again.about == visit.about
    # Another design is not.
    said = check_refused([*argv, "--rest", "7"], tmp_path, capfd)
    assert "expected rest 120.0" in said
    other = ["track", str(folder), "--participant", "02", "--no-browser"]
    assert 'expected participant "01"' in check_refused(other, tmp_path, capfd)


@pytest.mark.parametrize("how", ["emergency", "signal"])
def test_the_arm_drives_the_pointer_and_the_finger(
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    how: str,
) -> None:
    folder = tmp_path / "v"

    async def conduct(address: str) -> None:
        panel = Page("panel")
        await panel.come(address)
        await panel.wait(lambda shown: shown["c"] is not None)
        await panel.submit("begin")
        await panel.until("track")
        await panel.wait(lambda shown: shown["trial"].get("time", 0) > 1.0)
        drive = panel.shown["source"]
        assert drive["state"] == "active"
        assert drive["finger"] == "active"
        assert drive["latency"] > 0
        assert isinstance(drive["refused"], str)
        assert panel.hello["view"].startswith("http://127.0.0.1:")
        if how == "signal":
            os.kill(os.getpid(), signal.SIGINT)
            return
        await panel.submit("emergency")
        await panel.until("stopped")
        await panel.submit("begin")
        await panel.wait(lambda shown: "stopped" in shown["message"])
        await panel.submit("end")

    argv = ["track", str(folder), "--conditions", "ikns", *SHORT, "--align", "0.5"]
    argv += ["--subject", str(files / "person"), "--finger", "sim:"]
    argv += ["--source", f"replay:{files / 'free.c3d'}?loop=yes", "--json"]
    code = 128 + signal.SIGINT if how == "signal" else 0
    run(argv, conduct, monkeypatch, code)
    result = json.loads(capfd.readouterr().out)
    assert result["stopped"] == (how == "emergency")
    visit = read_visit(folder)
    (row,) = visit.attempts
    assert (row["outcome"], row["condition"]) == ("aborted", "ikns")
    assert "emergency" in row["reason"] or how == "signal"
    # The session beside it holds the same signal, and when the trial was.
    session = folder / visit.about["session"]
    recorded = read_run(session)
    told = [(what, words) for _, _, what, words in recorded.events]
    begins = [words for what, words in told if what == "trial begins"]
    assert begins == [row["key"]]
    assert ("trial ends", f"1 {row['key']} aborted") in told
    assert any(words.endswith("stop requested") for _, words in told)
    c = recorded.model["c"]
    known = row["c"][np.isfinite(row["c"])]
    # Both are kept to the bit; a row of the one belongs to a row of the other.
    assert len(known) > 20
    assert np.isin(known, c).all()
    assert main(["replay", str(session), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["same"]
    # A report draws where the hand went, and from which samples the map was learned.
    (group,) = summarize(folder).groups
    drawn = map_figure(group)
    assert drawn is not None
    left, right, *_ = drawn.figure.axes
    hand = np.array([recorded.model[f"hand_{axis}"] for axis in "zxy"])
    np.testing.assert_array_equal(left.lines[0].get_data_3d(), hand)
    samples = Subject.load(files / "person").samples
    assert samples is not None
    clouds = {cloud.get_label(): cloud for cloud in right.collections}
    for point in np.unique(samples[:, 3]):
        name = f"point {point:.0f}" if point else "still, discarded"
        of_point = samples[samples[:, 3] == point][:, [2, 0, 1]]
        np.testing.assert_array_equal(np.transpose(clouds[name]._offsets3d), of_point)


def test_nothing_is_written_where_the_source_does_not_answer(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    argv = ["track", str(tmp_path / "v"), "--conditions", "ikns", "--no-browser"]
    argv += ["--subject", str(files / "person"), "--source", "replay:none.c3d"]
    assert "none.c3d" in check_refused(argv, tmp_path, capfd)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ([], "needs --subject"),
        (["--conditions", "ikns", "--subject", "nobody"], "needs --source"),
        (["--conditions", "telepathy"], "found 'telepathy'"),
        (["--conditions", "mouse,mouse"], "distinct conditions"),
        (["--conditions", ""], "a value for --conditions"),
        (["--conditions", "virtual,mouse"], "people or the virtual operator"),
        (["--conditions", "mouse", "--repeats", "0"], "1 to 1000 for --repeats"),
        (
            ["--conditions", "mouse", "--seconds", "3"],
            "3600 for --seconds, found 3",
        ),
        (["--conditions", "mouse", "--align", "-1"], "for --align, found -1"),
        (["--conditions", "mouse", "--rest", "nan"], "for --rest, found nan"),
        (["--conditions", "mouse", "--rate", "0"], "--rate"),
        (["--conditions", "mouse", "--seed", "-1"], "--seed"),
        (["--conditions", "mouse", "--profiles", "T9"], "found 'T9'"),
        (["--conditions", "mouse", "--participant", "Jane Doe"], "letters and digits"),
        (["--conditions", "mouse", "--participant", "abc"], "--number"),
        (["--conditions", "mouse", "--port", "99999"], "0 to 65535 for --port"),
        (["--conditions", "mouse", "--study", "here"], "found both"),
        (["--conditions", "mouse", "--finger", "gpio:7"], "unknown finger"),
    ],
)
def test_bad_input_is_one_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], more: list[str], says: str
) -> None:
    argv = ["track", str(tmp_path / "v"), "--no-browser", *more]
    assert says in check_refused(argv, tmp_path, capfd)
    assert not (tmp_path / "v").exists()


def test_neither_visit_nor_study(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert "found neither" in check_refused(["track"], tmp_path, capfd)


STUDY = """
[study]
name = "people"
seed = 5
simulated = false
[cohort]
participants = 4
[tracking]
conditions = ["keyboard", "mouse"]
repeats = 1
seconds = 25.0
align = 1.5
training = 0
"""


def test_a_study_says_what_is_done_and_where(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "study.toml").write_text(STUDY)

    async def look(address: str) -> None:
        page = Page("participant")
        await page.come(address)
        assert page.hello["participant"] == "03"
        await page.submit("end")  # not the participant's to say
        await page.link.write_message(json.dumps({"by": "keyboard", "c": 0.5}))
        panel = Page("panel")
        await panel.come(address)
        assert not math.isnan(panel.shown["trials_left"])
        await panel.submit("end")

    study = ["track", "--study", str(tmp_path)]
    run([*study, "--participant", "03"], look, monkeypatch)
    visit = read_visit(tmp_path / "visits" / "sub-03_tracking")
    assert visit.about["study"] == "people"
    assert visit.about["design"]["conditions"] == ["keyboard", "mouse"]
    assert visit.about["participant_number"] == 2
    assert visit.about["design"]["seed"] == 5
    before = contents(tmp_path)
    more = [*study, "--participant", "03", "--repeats", "2"]
    assert "no --repeats" in check_refused(more, tmp_path, capfd)
    assert "--participant" in check_refused(study, tmp_path, capfd)
    (tmp_path / "study.toml").write_text(STUDY.replace("false", "true"))
    assert check_refused([*study, "--participant", "04"], tmp_path, capfd)
    assert set(contents(tmp_path)) == set(before)
