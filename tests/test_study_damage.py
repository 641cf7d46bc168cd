"""A study survives what happens to its files: kills, cut files, other bits, nothing."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from cheap_study import cheap_visits, contents, write_study
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.cli import main
from ikns.errors import FileError
from ikns.experiments.study import run, run_study
from ikns.experiments.visits import list_visits, read_visit

VICTIM = "sub-02_tracking"


@pytest.fixture(autouse=True)
def _cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "simulate", cheap_visits)
    monkeypatch.setattr(run, "compiled_before", lambda: True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = write_study(tmp_path_factory.mktemp("whole") / "study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "simulate", cheap_visits)
        patch.setattr(run, "compiled_before", lambda: True)
        run_study(study, n_jobs=1)
    return study


def test_a_run_killed_at_any_operation_leaves_whole_visits_and_is_completed(
    tmp_path: Path,
) -> None:
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, here / "killed_runs.py", tmp_path],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    operations, cut = map(int, done.stdout.split())
    # Two visits of four files, each opened, linked and unlinked.
    assert operations > 2 * 4 * 3
    assert cut >= 4  # in each file of a visit


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def _other(path: Path) -> None:
    """Write the file of another participant: whole, but not this one's."""
    there = path.parents[1] / "sub-01_tracking" / path.name
    path.write_bytes(there.read_bytes())


DAMAGES: dict[str, Callable[[Path], object]] = {
    "cut": _cut,
    "flipped": _flip,
    "empty": lambda path: path.write_bytes(b""),
    "deleted": Path.unlink,
    "another's": _other,
}


@pytest.mark.parametrize("file", ["visit.json", "attempts.parquet", "sums.sha256"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_visit_is_named_and_simulated_again(
    whole: Path, tmp_path: Path, damage: str, file: str
) -> None:
    study = tmp_path / "study"
    shutil.copytree(whole, study)
    path = study / "visits" / VICTIM / file
    DAMAGES[damage](path)
    left = path.read_bytes() if path.exists() else None
    if (damage, file) == ("deleted", "sums.sha256"):
        # A visit of a version without sums: it is read instead.
        assert run_study(study, n_jobs=1).damaged == {}
        return
    with pytest.raises(FileError):
        read_visit(path.parent)
    again = run_study(study, n_jobs=1)
    assert list(again.damaged) == [VICTIM]
    assert VICTIM in again.damaged[VICTIM]
    assert (again.found, again.simulated) == (3, 1)
    found = contents(study)
    aside = f".{VICTIM}.damaged/{file}"
    assert found.get(aside) == left
    kept = {name for name in found if name.startswith(".")}
    assert {n: c for n, c in found.items() if n not in kept} == contents(whole)
    assert len(list_visits(study)) == 4
    assert run_study(study, n_jobs=1).damaged == {}


def test_a_folder_that_holds_no_visit_is_simulated_again(
    whole: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    study = tmp_path / "study"
    shutil.copytree(whole, study)
    visits = study / "visits"
    shutil.rmtree(visits / "sub-01_picking")
    (visits / "sub-01_picking").mkdir()
    shutil.rmtree(visits / "sub-02_picking")
    (visits / "sub-02_picking").write_text("a file")
    shutil.rmtree(visits / VICTIM)
    shutil.copytree(visits / "sub-01_tracking", visits / VICTIM)
    (visits / "sub-01_tracking" / "attempt-0001.parquet").write_bytes(b"PAR1")
    assert main(["study", "run", str(study), "--jobs", "1"]) == 0
    told = " ".join(capfd.readouterr().out.split())
    assert "4 of 4 cells were damaged and are simulated again" in told
    assert "sub-02_picking: expected a folder, found a file" in told
    assert "named after, found participant 01 in tracking" in told
    assert "attempt-0001.parquet: expected only what sums.sha256 names" in told
    found = {n: c for n, c in contents(study).items() if not n.startswith(".")}
    assert found == contents(whole)


def test_damage_that_comes_again_loses_nothing(whole: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    shutil.copytree(whole, study)
    for content in (b"first", b"second"):
        (study / "visits" / VICTIM / "visit.json").write_bytes(content)
        run_study(study, n_jobs=1)
    kept = contents(study)
    assert kept[f".{VICTIM}.damaged/visit.json"] == b"first"
    assert kept[f".{VICTIM}.damaged-2/visit.json"] == b"second"


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_any_single_damage_is_noticed(whole: Path, data: st.DataObject) -> None:
    place = whole / "visits" / VICTIM
    path = place / data.draw(st.sampled_from(["visit.json", "attempts.parquet"]))
    good = path.read_bytes()
    at = data.draw(st.integers(0, len(good) - 1))
    bit = data.draw(st.integers(0, 7))
    cut = data.draw(st.booleans())
    bad = bytearray(good)
    bad[at] ^= 1 << bit
    try:
        path.write_bytes(good[:at] if cut else bad)
        with pytest.raises(FileError, match=VICTIM):
            read_visit(place)
    finally:
        path.write_bytes(good)
    assert len(read_visit(place).attempts) == 1


def test_the_saved_declaration_is_restored_or_said_to_be_damaged(
    whole: Path, tmp_path: Path
) -> None:
    study = tmp_path / "study"
    shutil.copytree(whole, study)
    saved = study / "visits" / "declared.json"
    saved.write_bytes(saved.read_bytes()[:50])
    with pytest.raises(FileError, match="delete it if study.toml has not been changed"):
        run_study(study, n_jobs=1)
    saved.unlink()
    assert run_study(study, n_jobs=1).simulated == 0
    assert contents(study) == contents(whole)


def test_a_visit_of_a_person_is_left_alone(whole: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    shutil.copytree(whole, study)
    person = study / "visits" / VICTIM
    (person / "sums.sha256").unlink()
    about = person / "visit.json"
    about.write_text(
        about.read_text().replace('"simulated": true', '"simulated": false')
    )
    before = contents(study)
    assert run_study(study, n_jobs=1).damaged == {}
    assert contents(study) == before


def test_sha256sum_reads_the_sums(whole: Path) -> None:
    for visit in list_visits(whole):
        command = ["sha256sum", "--check", "--strict", "--quiet", "sums.sha256"]
        assert subprocess.run(command, cwd=visit, check=False).returncode == 0
