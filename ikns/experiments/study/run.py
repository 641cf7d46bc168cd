"""Run a study: simulate the missing visits, and write each when it is done."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.experiments.study.cells import (
    SimulatedVisit,
    Task,
    check_libraries,
    simulate,
)
from ikns.experiments.study.damage import set_damaged_aside
from ikns.experiments.study.declaration import FILE, read_study
from ikns.experiments.study.results import (
    check_declaration,
    missing_tasks,
    restore_declaration,
    run_lock,
    save_declaration,
)
from ikns.experiments.study.time_left import Kind, TimeLeft
from ikns.experiments.study.workers import compute, processes
from ikns.experiments.visits import write_visit
from ikns.live.warm_up import compiled_before, warm_up

#: Longest time to wait for workers, s.
_DAY = 86400.0


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
    damaged : dict of str to str
        What was wrong with visits that were found damaged and simulated again, by
        folder. What was left of each is beside it, as ``.sub-01_tracking.damaged``.
    """

    cells: int
    found: int
    simulated: int
    failed: dict[str, str]
    seconds: float
    damaged: dict[str, str] = field(default_factory=dict)


def run_study(
    folder: str | Path,
    *,
    n_jobs: int = -1,
    scheduler: str | None = None,
    worker_timeout: float = 60.0,
    on_progress: Callable[[str, int, int], None] | None = None,
    on_time_left: Callable[[TimeLeft], None] | None = None,
    participants: int | None = None,
) -> StudyRun:
    """Simulate the missing visits of a study.

    A run that was killed at any time continues where it stopped: each visit is there
    whole or not at all. Visits that were damaged since (files cut off, changed, empty
    or gone) are renamed and simulated again. The same study gives the same bits,
    independent of workers and order. Memory does not grow with the cohort.

    Parameters
    ----------
    folder : str or Path
        With ``study.toml``; results are written into its ``visits``.
    n_jobs : int
        Processes, as in joblib: -1 is one for each core.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers are used instead; they need only this
        package. The tasks of a worker that dies are given to another one.
    worker_timeout : float
        Longest time that the scheduler may be without any worker, s.
    on_progress : callable, optional
        Called with (step, visits done, visits in total); the steps are "checking", for
        visits that are there, and "simulating".
    on_time_left : callable, optional
        Called once, with what tells at any time how long the rest takes.
    participants : int, optional
        Simulate only the first ones. Default: all.

    Raises
    ------
    FileError
        When the study file is missing, or its saved copy or a file is unreadable.
    InvalidInput
        When the study is of people, changed since the first result, or is running
        already, or a library is missing.
    StreamError
        When the scheduler does not answer or has no workers, a process dies, or several
        workers do with the same participant.
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
    if not 1.0 <= worker_timeout <= _DAY:
        raise InvalidInput(
            f"expected a worker timeout of 1 to {_DAY:g} s, found {worker_timeout:g}."
        )
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
        restore_declaration(top, study)
        found, damaged = set_damaged_aside(
            top, study, participants=people, report=report
        )
        left = TimeLeft(map(_kind, missing_tasks(top, study, participants=people)))
        if on_time_left is not None:
            on_time_left(left)
        report("simulating", found, cells)
        for finished in compute(
            simulate,
            missing_tasks(top, study, participants=people),
            n_jobs=n_jobs,
            scheduler=scheduler,
            worker_timeout=worker_timeout,
            on_workers=left.take_workers,
        ):
            left.done(_kind_of_visits(finished), _seconds(finished))
            if not done:
                save_declaration(top, study)
            for visit in finished:
                place = top / "visits" / visit.name
                write_visit(place, visit.about, visit.attempts, visit.others)
                done += 1
                if visit.about["reason"]:
                    failed[visit.name] = visit.about["reason"]
                report("simulating", found + done, cells)
    seconds = time.perf_counter() - began
    return StudyRun(cells, found, done, failed, seconds, damaged)


def _kind(task: Task) -> Kind:
    return task.variation, ("person", *task.experiments)


def _kind_of_visits(visits: list[SimulatedVisit]) -> Kind:
    experiments = (str(visit.about["experiment"]) for visit in visits)
    return str(visits[0].about["variation"]), ("person", *experiments)


def _seconds(visits: list[SimulatedVisit]) -> dict[str, float]:
    return {part: took for visit in visits for part, took in visit.seconds.items()}
