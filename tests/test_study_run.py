"""Running a study: the same bits whoever computes them, and nothing done twice."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from cheap_study import contents, write_study

from ikns.calibration.subject import Subject
from ikns.errors import FileError, InvalidInput, StreamError
from ikns.experiments.picking.virtual import virtual_pick_step
from ikns.experiments.study import read_study, run_study, workers
from ikns.experiments.study.people import study_participant
from ikns.experiments.study.results import visit_names
from ikns.experiments.tracking import draw_profile, measure, virtual_step
from ikns.experiments.visits import list_visits, read_visit, tracking_record

#: Quick people: a coarse clock, one profile, short stays.
STUDY = {
    "study": {"name": "quick", "seed": 5},
    "cohort": {"participants": 2},
    "tracking": {
        "profiles": ["T1"],
        "repeats": 1,
        "training": 2,
        "seconds": 15,
        "align": 2.0,
    },
    "picking": {"objects": ["A"], "training": 1},
    "parameters": {"rate": 50, "point_seconds": 2},
}
#: No hand is as still as that.
STRICT = {"max_hand_speed": 1e-6}
RUN = """
import sys
from ikns.experiments.study import run_study
if __name__ == "__main__":
    run_study(sys.argv[1], n_jobs=2)
"""


def make(folder: Path, **tables: dict) -> Path:
    return write_study(folder, **(STUDY | tables))


def children(process: int) -> list[int]:
    """Processes that this one started."""
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study as one process makes it."""
    study = make(tmp_path_factory.mktemp("one") / "study")
    run_study(study, n_jobs=1)
    return study


def test_a_killed_run_continues_and_two_processes_make_the_bits_of_one(
    done: Path, tmp_path: Path
) -> None:
    study = make(tmp_path / "killed")
    with subprocess.Popen([sys.executable, "-c", RUN, str(study)]) as running:
        while not list_visits(study) and running.poll() is None:
            time.sleep(0.01)
        with pytest.raises(InvalidInput, match="found another run"):
            run_study(study)
        left_behind = children(running.pid)
        running.send_signal(signal.SIGKILL)
    found = list_visits(study)
    assert 1 <= len(found) < 4
    assert not any("part" in path.name for path in found)
    # What a kill may leave beside it: a visit that has no name yet, a torn declaration.
    names = list(visit_names(read_study(study), participants=2))
    missing = next(name for name in names if study / "visits" / name not in found)
    torn = study / "visits" / f".{missing}.part"
    torn.mkdir(exist_ok=True)
    (torn / "attempts.parquet").write_bytes(b"PAR1 half")
    foreign = study / "visits" / "notes.txt"
    foreign.write_text("mine")
    before = {path: path.stat().st_mtime_ns for path in found}
    told: list[tuple] = []
    run = run_study(study, n_jobs=2, on_progress=lambda *row: told.append(row))
    assert (run.cells, run.found, run.failed) == (4, len(found), {})
    assert run.simulated == 4 - len(found)
    there = [k for k, name in enumerate(names) if study / "visits" / name in found]
    assert told[: len(found)] == [("checking", k, 4) for k in there]
    assert told[len(found) :] == [("simulating", k, 4) for k in range(len(found), 5)]
    assert {path: path.stat().st_mtime_ns for path in found} == before
    assert foreign.read_text() == "mine"
    foreign.unlink()
    assert not any(Path(f"/proc/{worker}").exists() for worker in left_behind)
    assert contents(study) == contents(done)


def test_a_cohort_grows_without_doing_anything_twice(
    done: Path, tmp_path: Path
) -> None:
    study = make(tmp_path / "part")
    one = run_study(study, n_jobs=1, participants=1)
    assert (one.cells, one.simulated) == (2, 2)
    more = run_study(study, n_jobs=1, participants=2)
    assert (more.cells, more.found, more.simulated) == (4, 2, 2)
    assert len(list_visits(study)) == 4
    whole = contents(done)
    for name, content in contents(study).items():
        assert content == whole[name] or name in ("declared.json", ".run.lock")
    with pytest.raises(InvalidInput, match="expected 1 to 2 participants, found 4"):
        run_study(study, participants=4)


def test_a_tracking_visit_equals_the_participant_s_own_trials(done: Path) -> None:
    study = read_study(done)
    assert study.tracking is not None
    visit = read_visit(done / "visits" / "sub-02_tracking", experiment="tracking")
    person = study_participant(1, seed=5, parameters=study.parameters)
    trials = [s for s in study.tracking.steps(1, seed=5) if s.kind == "trial"]
    assert [row["key"] for row in visit.attempts] == [step.key for step in trials]
    for row, step in zip(visit.attempts, trials, strict=True):
        assert row["practised"] == 2  # of training, which is counted
        record = virtual_step(
            person,
            step,
            draw_profile("T1", step.seed, seconds=15.0),
            practised=2,
            rate=50.0,
            align=2.0,
        )
        kept = tracking_record(row)
        assert kept.c.tobytes() == record.c.tobytes()
        assert kept.time.tobytes() == record.time.tobytes()
        assert measure(kept) == measure(record)
    about = visit.about
    assert (about["simulated"], about["participant"], about["seed"]) == (True, "02", 5)
    assert "simulated" in about["input"]["ikns"]
    assert about["design"] == study.tracking.arguments(seed=5)
    assert about["subject"]["stature_m"] == person.protocol.subject.adult.stature_m


def test_the_subject_of_the_first_participant_is_saved(done: Path) -> None:
    study = read_study(done)
    person = study_participant(0, seed=5, parameters=study.parameters)
    for experiment in ("tracking", "picking"):
        kept = Subject.load(done / "visits" / f"sub-01_{experiment}" / "subject")
        learned, meant = kept.null_space_map, person.subject.null_space_map
        np.testing.assert_array_equal(learned.directions_, meant.directions_)
        assert kept.samples is not None
        assert len(kept.samples) == len(meant.labels_)
    assert not (done / "visits" / "sub-02_tracking" / "subject").exists()


def test_a_picking_visit_equals_the_participant_s_own_picks(done: Path) -> None:
    study = read_study(done)
    assert study.picking is not None
    visit = read_visit(done / "visits" / "sub-02_picking", experiment="picking")
    person = study_participant(1, seed=5, parameters=study.parameters)
    trials = [s for s in study.picking.steps(1, seed=5) if s.kind == "trial"]
    assert [row["condition"] for row in visit.attempts] == ["ring", "ikns"]
    for row, step in zip(visit.attempts, trials, strict=True):
        again = virtual_pick_step(person, step, practised=1, rate=50.0)
        assert repr({"number": row["number"]} | again) == repr(row)
    assert "mujoco" in visit.about["versions"]


def test_a_failed_calibration_is_reported_and_does_not_end_the_run(
    tmp_path: Path,
) -> None:
    study = make(
        tmp_path / "strict",
        cohort={"participants": 1},
        parameters=STUDY["parameters"] | STRICT,
        variations={"usual": {"max_hand_speed": 0.05}},
    )
    run = run_study(study, n_jobs=1)
    assert (run.cells, run.simulated) == (4, 4)
    assert list(run.failed) == ["sub-01_tracking", "sub-01_picking"]
    other, strict, _, usual = (read_visit(path) for path in list_visits(study))
    assert strict.attempts == other.attempts == []
    assert strict.about["reason"] == run.failed["sub-01_tracking"]
    assert "slower than 1e-06 m/s" in strict.about["reason"]
    assert len(usual.attempts) == 2
    assert usual.about["reason"] == ""
    assert usual.about["variation_settings"] == {"max_hand_speed": 0.05}
    assert run_study(study, n_jobs=1).simulated == 0


def test_a_changed_study_is_not_mixed_with_its_results(
    done: Path, tmp_path: Path
) -> None:
    study = make(tmp_path / "changed")
    (study / "visits").mkdir()
    for name, content in contents(done).items():
        path = study / "visits" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    before = contents(study)
    table = STUDY | {"study": {"name": "quick", "seed": 6}}
    (study / "study.toml").write_text(tomli_w.dumps(table))
    with pytest.raises(InvalidInput, match="there are results with seed = 5, found 6"):
        run_study(study)
    assert contents(study) == before


def test_a_study_of_people_and_one_that_is_not_there_are_not_run(
    tmp_path: Path,
) -> None:
    people = make(tmp_path / "people", study={"name": "real", "simulated": False})
    with pytest.raises(InvalidInput, match="found one of people"):
        run_study(people)
    with pytest.raises(FileError, match="nowhere: there is no such folder"):
        run_study(tmp_path / "nowhere")


def test_missing_and_dead_workers_are_reported() -> None:
    with pytest.raises(InvalidInput, match="at least one process, found 0"):
        workers.compute(abs, [1], n_jobs=0)
    assert list(workers.compute(abs, iter([-1, 2]), n_jobs=1)) == [1, 2]
    with pytest.raises(StreamError, match="a worker process died"):
        list(workers.compute(_die, [1], n_jobs=2))


def _die(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)
