"""``ikns report``: what it writes and prints, and how it refuses."""

import json
import shutil
from pathlib import Path

import pytest
import small_visits as small
from command_line import check_refused, contents

from ikns.cli import main
from ikns.experiments.study import init_study
from ikns.view.study_report import report_files

ERRORS = {("ikns", "T1"): 2.0}


@pytest.fixture(scope="module")
def visited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One simulated participant's visit."""
    study = tmp_path_factory.mktemp("visited")
    small.tracking(study, 1, ERRORS)
    return study


@pytest.fixture
def study(tmp_path: Path, visited: Path) -> Path:
    return Path(shutil.copytree(visited, tmp_path / "study"))


def test_a_report_appears_in_the_study_and_is_not_overwritten(
    study: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = contents(study / "visits")
    assert main(["report", str(study)]) == 0
    out, err = capfd.readouterr()
    assert err == ""
    assert "Simulated participants: RMSE of tracking, of 100" in out
    assert "Not tested: one condition only, ikns." in out
    assert (study / "report" / "report.html").is_file()
    assert contents(study / "visits") == before
    held = [p for p in (study / "report").rglob("*") if p.is_file()]
    names = {path.relative_to(study / "report").as_posix() for path in held}
    assert names <= set(report_files())
    assert {"numbers.json", "tables/tracking.csv"} < names
    figures = sorted((study / "report" / "figures").iterdir())
    assert [path.suffix for path in figures] == [".pdf", ".svg"] * 4
    for path in figures:
        assert path.name.startswith("simulated_")
        assert path.read_bytes().startswith(b"%PDF" if path.suffix == ".pdf" else b"<?")
    sentence = check_refused(["report", str(study)], study, capfd)
    assert "use --force" in sentence
    (study / "visits" / "sub-01_tracking" / "visit.json").unlink()
    check_refused(["report", str(study), "--force"], study, capfd)


def test_json_holds_all_numbers_of_a_single_visit(
    study: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    visit = study / "visits" / "sub-01_tracking"
    out = tmp_path / "one"
    assert main(["report", str(visit), "--out", str(out), "--json"]) == 0
    result = json.loads(capfd.readouterr().out)
    assert result["report"] == str(out / "report.html")
    (group,) = result["groups"]
    assert group["simulated"] is True
    means = [cell["over"]["mean"] for cell in group["tracking"]["rmse"]]
    assert means == pytest.approx([2.0, 2.0])
    assert set(result) == {
        "report",
        "study",
        "simulated",
        "visits",
        "left_out",
        "groups",
    }


def test_what_is_no_study_is_refused_in_one_sentence(
    tmp_path: Path, study: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    check_refused(["report", str(tmp_path / "nowhere")], tmp_path, capfd)
    empty = init_study(tmp_path / "empty").parent
    assert "ikns study run" in check_refused(["report", str(empty)], empty, capfd)
    about = study / "visits" / "sub-01_tracking" / "visit.json"
    about.write_text(about.read_text().replace('"format": 1', '"format": 2'))
    sentence = check_refused(["report", str(study)], study, capfd)
    assert "expected a visit of format 1, found 2" in sentence
    about.write_text("[")
    check_refused(["report", str(study)], study, capfd)


def test_a_faulty_study_file_or_output_folder_is_refused(
    tmp_path: Path, study: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (study / "study.toml").write_text(
        '[study]\nnam = "x"\n[cohort]\nparticipants = 1\n'
    )
    assert "'name'" in check_refused(["report", str(study)], study, capfd)
    (study / "study.toml").unlink()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    argv = ["report", str(study), "--out", str(other), "--force"]
    assert "thesis.txt" in check_refused(argv, tmp_path, capfd)
    argv = ["report", str(study), "--out", str(tmp_path / "a" / "b")]
    assert "does not exist" in check_refused(argv, tmp_path, capfd)
