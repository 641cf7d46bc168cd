"""Run a study: simulate what is missing, write each cell as it comes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ikns.errors import InvalidInput
from ikns.experiments.study.cells import check_libraries, simulate
from ikns.experiments.study.declaration import FILE, read_study
from ikns.experiments.study.results import alone, check_declared, keep_declared, tasks
from ikns.experiments.study.workers import compute, processes
from ikns.experiments.visits import write_visit
from ikns.live.warm_up import compiled_before, warm_up

__all__ = ["StudyRun", "run_study"]


@dataclass(frozen=True)
class StudyRun:
    """What a run did.

    Parameters
    ----------
    cells : int
        Of the study, or of as many participants as were asked for.
    found, simulated : int
        Cells that were there before, and those of this run.
    failed : dict of str to str
        Of those of this run that have no attempts, why; by the visit's folder.
    seconds : float
        How long it took.
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
    """Simulate the cells of a study that are not there yet.

    A run that is killed at any instant goes on where it stopped when it is called
    again: a cell is there whole or not at all. The same study gives the same bits,
    whoever computes them in whatever order. Memory does not grow with the cohort.

    Parameters
    ----------
    folder : str or Path
        With ``study.toml``; results go into ``visits`` there.
    n_jobs : int
        Processes, as in joblib: -1 is one for each core.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute instead; they need this
        package and nothing else.
    on_progress : callable, optional
        Called with ("simulating", cells done, cells in all).
    participants : int, optional
        Only the first so many. Default: all.

    Raises
    ------
    FileError
        When the study file is missing or a visit is damaged.
    InvalidInput
        When the study is of people, was changed since the first result, or is being
        run already, or a library is missing.
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
    processes(n_jobs)  # refused before anything is written
    people = participants or most
    cells = people * len(study.designs) * (1 + len(study.variations))
    report = on_progress or (lambda step, done, total: None)
    failed: dict[str, str] = {}
    done = 0
    if scheduler is None and not compiled_before():
        warm_up(on_progress)  # once, and not in every worker
    with alone(top):
        check_declared(top, study)
        left = sum(
            len(task.experiments) for task in tasks(top, study, participants=people)
        )
        found = cells - left
        report("simulating", found, cells)
        for finished in compute(
            simulate,
            tasks(top, study, participants=people),
            n_jobs=n_jobs,
            scheduler=scheduler,
        ):
            if not done:
                keep_declared(top, study)
            for cell in finished:
                write_visit(
                    top / "visits" / cell.name, cell.about, cell.attempts, cell.others
                )
                done += 1
                if cell.about["reason"]:
                    failed[cell.name] = cell.about["reason"]
                report("simulating", found + done, cells)
    return StudyRun(cells, found, done, failed, time.perf_counter() - began)
