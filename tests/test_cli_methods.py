"""``--method`` of the commands that read recordings."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused

import ikns
from ikns.analysis.compare import crosstalk
from ikns.cli import main
from ikns.live.control.recorded import control_table
from ikns.view.scene import recording_scene


@pytest.fixture(scope="module")
def old(files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A subject folder from before there were other methods."""
    folder = tmp_path_factory.mktemp("old") / "old"
    shutil.copytree(files / "person", folder)
    for name in ("proximal", "intent"):
        (folder / f"{name}.json").unlink()
    report = json.loads((folder / "calibration.json").read_text())
    del report["methods"]
    (folder / "calibration.json").write_text(json.dumps(report))
    return folder


def test_control_says_what_a_subject_has(files, old, tmp_path, capsys):
    advised = shutil.copytree(files / "person", tmp_path / "advised")
    report = json.loads((advised / "calibration.json").read_text())
    assert report["methods"]["summary"]["recommended"] is None  # too few reaches
    report["methods"]["summary"]["recommended"] = "intent"
    (advised / "calibration.json").write_text(json.dumps(report))
    advice = "; its calibration recommends intent"
    subjects = (advised, 3, advice), (files / "person", 3, ""), (old, 1, "")
    for folder, known, more in subjects:
        argv = ["control", "--subject", str(folder), str(files / "free.c3d")]
        out = tmp_path / f"{folder.name}.csv"
        assert main([*argv, "--out", str(out), "--json"]) == 0
        names = ["paper", "proximal", "intent"][:known]
        assert json.loads(capsys.readouterr().out)["methods"] == names
        assert main([*argv, "--out", str(out), "--force"]) == 0
        text = " ".join(capsys.readouterr().out.split())
        assert f"this subject has {', '.join(names)}{more}." in text


@pytest.mark.parametrize("command", ["control", "compare", "view"])
def test_a_method_that_an_old_folder_lacks_is_named(
    command, files, old, tmp_path, capfd
):
    recording, out = str(files / "free.c3d"), str(tmp_path / "new.")
    argv = {
        "control": ["control", recording, "--subject", str(old), "--out", f"{out}csv"],
        "compare": ["compare", recording, "--subject", str(old)],
        "view": ["view", str(old), recording, "--out", f"{out}html"],
    }[command]
    sentence = check_refused([*argv, "--method", "intent"], tmp_path, capfd, names=old)
    assert "has the method paper only; calibrate" in sentence


def test_compare_reads_crosstalk_by_the_method_and_directions_by_the_paper(
    files, capsys
):
    person, points = files / "person", files / "points.c3d"
    argv = ["compare", "--subject", str(person), str(points), "--json"]
    argv += ["--task", "pose", "--chain", "own", "--intervals", "0"]
    assert main(argv) == 0
    paper = json.loads(capsys.readouterr().out)
    assert main([*argv, "--method", "intent"]) == 0
    intent = json.loads(capsys.readouterr().out)
    assert intent["points"] == paper["points"]
    assert intent["comparisons"] == paper["comparisons"]
    assert any("intent uses no such direction" in note for note in intent["warnings"])
    subject = ikns.Subject.load(person)
    motion = ikns.MarkerIK(subject.skeleton).track(ikns.read(points), chain="right_arm")
    c = subject.readout("intent").control_signal(subject.skeleton, motion)
    hand = motion.task_position("right_arm")
    by_hand = crosstalk(c, motion.hand_speed("right_arm"), hand, resamples=0)
    assert intent["crosstalk"]["mean_change"] == pytest.approx(by_hand.mean_change)
    assert paper["crosstalk"]["mean_change"] != intent["crosstalk"]["mean_change"]


def test_view_plays_the_c_of_the_method(files, tmp_path, capsys, monkeypatch):
    page = tmp_path / "new.html"
    person, recording = files / "person", files / "free.c3d"
    played = []

    def noted(*args, c, **own):
        played.append(c)
        return recording_scene(*args, c=c, **own)

    monkeypatch.setattr("ikns.view.scene.recording_scene", noted)
    argv = ["view", str(person), str(recording), "--out", str(page), "--json"]
    assert main([*argv, "--method", "intent"]) == 0
    assert json.loads(capsys.readouterr().out)["method"] == "intent"
    assert "c is read by the method intent" in page.read_text(encoding="utf-8")
    subject, frames = ikns.Subject.load(person), ikns.read(recording)
    motion = ikns.MarkerIK(subject.skeleton).track(frames, chain="right_arm")
    c = subject.readout("intent").control_signal(subject.skeleton, motion)
    # As `ikns control` has it, before it is clipped: empty where it is too uncertain.
    table = control_table(subject, motion, recording=frames, method="intent")
    np.testing.assert_array_equal(np.clip(played[0][:, 0], 0, 1), table.rows[:, 1])
    assert np.nanmax(played[0]) > 1
    scene = recording_scene(
        subject.skeleton,
        subject.null_space_map,
        "right_arm",
        motion,
        frames,
        simulated=True,
        c=c,
    )
    np.testing.assert_array_equal(scene.c, c[::2])  # 50 Hz to 25
    assert "c is read by" not in scene.caption


def test_view_of_a_map_alone_is_the_paper_s(files, tmp_path, capfd):
    argv = ["view", str(files / "person"), "--method", "intent"]
    sentence = check_refused(
        [*argv, "--out", str(tmp_path / "x.html")], tmp_path, capfd
    )
    assert "--method intent needs a recording to compute c from" in sentence
