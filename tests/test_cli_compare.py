"""``ikns compare``: everything in JSON, a table that fits a page, a picture."""

import json
import shutil
from pathlib import Path

import pytest
import small_person
from command_line import check_refused, contents

from ikns.cli import main

QUICK = ["--intervals", "20"]


def compare(files: Path, *rest: str) -> list[str]:
    person = ["--subject", str(files / "person"), str(files / "points.c3d")]
    return ["compare", *person, *QUICK, *rest]


@pytest.fixture(scope="module")
def result(files: Path, tmp_path_factory: pytest.TempPathFactory) -> dict:
    folder = tmp_path_factory.mktemp("compare")
    picture, out = folder / "picture.png", folder / "result.json"
    # As simulated recordings come: with their truth beside them.
    beside = tmp_path_factory.mktemp("simulated")
    shutil.copy(files / "points.c3d", beside)
    (beside / "truth.json").write_text('{"simulated": true}')
    reaches = ["--reaches", str(beside / "points.c3d")]
    argv = compare(files, *reaches, "--figure", str(picture), "--json")
    with out.open("w") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        assert main(argv) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in folder.iterdir()} == {"picture.png", "result.json"}
    return dict(json.loads(out.read_text()))


def test_every_chain_and_task_is_in_the_json(result: dict) -> None:
    made = [(each["chain"], each["task"]) for each in result["comparisons"]]
    chains = ("right_arm", "right_arm_clavicle")
    assert made == [(c, t) for c in chains for t in ("pose", "position")]
    dimensions = [each["null_space_dimensions"] for each in result["comparisons"]]
    assert dimensions == [1, 4, 3, 6]  # joints less what is held
    for each in result["comparisons"]:
        assert [row["point"] for row in each["points"]] == list(range(1, 11))
        joints = 9 if "clavicle" in each["chain"] else 7
        assert len(each["points"][0]["direction"][0]) == joints
        low, high = each["pooled"]["leak_m"]["interval"]
        assert 0 <= low < high
        assert low <= each["pooled"]["leak_corrected_m"]["value"] <= high
    assert result["simulated"] is True
    assert result["settings"] == {
        "resamples": 20,
        "seed": 0,
        "level": 0.95,
        "max_hand_speed_m_s": 0.05,  # as calibrated
        "min_duration_s": 0.0,
    }
    assert result["crosstalk"]["reaches"] == len(result["crosstalk"]["changes"]) > 0


def test_both_ways_to_compare_agree_where_they_measure_the_same(result: dict) -> None:
    full = result["comparisons"][0]["points"]
    for row, own in zip(result["points"], full, strict=True):
        # The same map, samples and null space, by two programs.
        assert row["samples"] == own["samples"]
        assert row["angle_deg"] == pytest.approx(own["angles_deg"], abs=1e-6)
        assert row["learned_leak_m"] == pytest.approx(own["leak_m"][0])
        assert row["inside"] == pytest.approx(own["inside"])


def test_the_tables_fit_a_hundred_columns(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(compare(files, "--coordinates", "all", "--chain", "own")) == 0
    text = capsys.readouterr().out
    tables = [line for line in text.splitlines() if "  " in line and ":" not in line]
    assert max(map(len, tables)) <= 100
    assert "\N{HORIZONTAL ELLIPSIS}" not in text  # nothing cut short
    for word in ("ISB", "vector", "internal", "Crosstalk", "While c goes from 0 to 1"):
        assert word in text


def test_coordinates_are_compared_side_by_side(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = ["--chain", "own", "--task", "pose", "--coordinates", "all", "--json"]
    assert main(compare(files, *own)) == 0
    found = json.loads(capsys.readouterr().out)["comparisons"]
    ends = {
        each["coordinates"]: each["pooled"]["straight_leak_m"]["value"]
        for each in found
    }
    assert ends["rotation_vector"] < ends["internal"] < ends["isb"]


def test_without_intervals_there_are_none(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = compare(files, "--chain", "own", "--task", "position", "--json")
    assert main([*argv, "--intervals", "0"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["comparisons"][0]["pooled"]["angle_deg"]["interval"] == [None, None]


def test_a_picture_is_only_overwritten_by_force(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "old.svg"
    picture.write_text("precious")
    argv = compare(files, "--chain", "own", "--task", "pose", "--figure", str(picture))
    assert "--force" in check_refused(argv, tmp_path, capfd, names=picture)
    assert main([*argv, "--force"]) == 0
    assert b"<svg" in contents(tmp_path)[str(picture)]


@pytest.mark.parametrize(
    ("rest", "said"),
    [
        (["--figure", "picture.gif"], ".png, .svg or .pdf"),
        (["--figure", "nowhere/picture.png"], "nowhere"),
        (["--intervals", "-1"], "--intervals"),
        (["--coordinates", "polar"], "polar"),
        (["--chain", "leg"], "leg"),
        (["--reaches", "lost.c3d"], "lost.c3d"),
    ],
)
def test_bad_options_are_told_in_a_sentence(
    files: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    rest: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in check_refused(compare(files, *rest), tmp_path, capfd)


def test_a_recording_without_reaches_is_told(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = small_person.protocol().points
    held = small_person.cut(run.recording, 5, 60)
    path = small_person.write(tmp_path, "held", held)
    argv = compare(files, "--reaches", str(path))
    assert "reaches of 0.05 m or more" in check_refused(
        argv, tmp_path, capfd, names=path
    )
