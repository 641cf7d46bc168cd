"""Run a study: simulate the missing visits, and write each when it is done."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.experiments.study.cells import check_libraries, simulate
from ikns.experiments.study.declaration import FILE, read_study
from ikns.experiments.study.results import (
    check_declaration,
    missing_tasks,
    run_lock,
    save_declaration,
)
from ikns.experiments.study.workers import compute, processes
from ikns.experiments.visits import write_visit
from ikns.live.warm_up import compiled_before, warm_up


@dataclass(frozen=True)
class StudyRun:
    """Result of a run.

    Parameters
    ----------
    cells : int
        Visits in the study, or of the participants that were requested.
    found, simulated : int
        Visits that existed before, and those of this run.
    failed : dict of str to str
        Why visits of this run have no attempts, by folder.
    seconds : float
        Duration of the run.
    """

    cells: int
    found: int
    simulated: int
    failed: dict[str, str]
    seconds: float


def run_study(
    folder: str | Path,
    *,
    n_jobs: int = -1,
    scheduler: str | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
    participants: int | None = None,
) -> StudyRun:
    """Simulate the missing visits of a study.

    A run that was killed at any time continues where it stopped: each visit is there
    whole or not at all. The same study gives the same bits, independent of workers and
    order. Memory does not grow with the cohort.

    Parameters
    ----------
    folder : str or Path
        With ``study.toml``; results are written into its ``visits``.
    n_jobs : int
        Processes, as in joblib: -1 is one for each core.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers are used instead; they need only this
        package.
    on_progress : callable, optional
        Called with ("simulating", visits done, visits in total).
    participants : int, optional
        Simulate only the first ones. Default: all.

    Raises
    ------
    FileError
        When the study file is missing, or a visit is damaged.
    InvalidInput
        When the study is of people, changed since the first result, or is running
        already, or a library is missing.
    StreamError
        When the scheduler does not answer or a worker dies.
    """
    top, began = Path(folder), time.perf_counter()
    study = read_study(top)
    if not study.simulated:
        raise InvalidInput(
            f"{top / FILE}: expected a simulated study to run, found one of people; "
            "record them with ikns track and ikns pick."
        )
    check_libraries(study)
    most = study.participants
    if participants is not None and not 1 <= participants <= most:
        raise InvalidInput(f"expected 1 to {most} participants, found {participants}.")
    processes(n_jobs)  # checked before anything is written
    people = participants or most
    cells = people * len(study.designs) * (1 + len(study.variations))
    report = on_progress or (lambda step, done, total: None)
    failed: dict[str, str] = {}
    done = 0
    if scheduler is None and not compiled_before():
        warm_up(on_progress)  # once, instead of in every worker
    with run_lock(top):
        check_declaration(top, study)
        left = sum(
            len(task.experiments)
            for task in missing_tasks(top, study, participants=people)
        )
        found = cells - left
        report("simulating", found, cells)
        for finished in compute(
            simulate,
            missing_tasks(top, study, participants=people),
            n_jobs=n_jobs,
            scheduler=scheduler,
        ):
            if not done:
                save_declaration(top, study)
            for visit in finished:
                place = top / "visits" / visit.name
                write_visit(place, visit.about, visit.attempts, visit.others)
                done += 1
                if visit.about["reason"]:
                    failed[visit.name] = visit.about["reason"]
                report("simulating", found + done, cells)
    return StudyRun(cells, found, done, failed, time.perf_counter() - began)
