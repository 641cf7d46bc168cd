"""``ikns study``: declare a study and simulate its participants."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ikns.cli.checks import checked
from ikns.cli.options import AsJson, Force
from ikns.cli.output import Estimate, loading, notes, progress, show
from ikns.cli.study_plan import plan
from ikns.errors import InvalidInput

study_app = typer.Typer(
    help="Declare a study, simulate it, plan its size.",
    no_args_is_help=True,
    add_completion=False,
)

#: Interval of progress lines without a terminal, s.
_EVERY = 30.0
#: Most failed cells that are named.
_NAMED = 5

StudyFolder = Annotated[Path, typer.Argument(help="Folder of the study.")]


def init(folder: StudyFolder, force: Force = False, as_json: AsJson = False) -> None:
    """Write a study folder with a commented example: both experiments, 10 people."""
    loading()

    from ikns.experiments.study import init_study, read_study

    path = init_study(folder, force=force)
    study = read_study(folder)
    show(
        {"study": path, "name": study.name, "participants": study.participants},
        f"{path}: {study.participants} simulated participants, "
        f"{' and '.join(study.designs)}",
        f"Change it as you like, then: ikns study run {folder}",
        as_json=as_json,
    )


def run(
    folder: StudyFolder,
    jobs: Annotated[
        int,
        typer.Option(help="Number of processes; -1: one per core.", min=-1, max=1024),
    ] = -1,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Address of a Dask scheduler to compute on, tcp://HOST:PORT."
        ),
    ] = None,
    worker_timeout: Annotated[
        float,
        typer.Option(
            help="Longest time that the scheduler may be without workers, s.", min=1.0
        ),
    ] = 60.0,
    participants: Annotated[
        int | None,
        typer.Option(help="Simulate only the first N participants.", min=1, max=5000),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate the visits that a study lacks; a stopped run continues where it was.

    Results are bit-identical for any number of processes, here or on a cluster.
    """
    if scheduler is not None and not re.fullmatch(r"\w+://[^\s/].*", scheduler):
        raise InvalidInput(
            f"expected --scheduler as tcp://HOST:PORT, found '{scheduler}'."
        )
    loading()

    from ikns.experiments.study import read_study, run_study

    study = read_study(folder)
    estimates: dict[str, Any] = {}
    with _progress_or_lines(estimates) as report:
        done = run_study(
            folder,
            n_jobs=jobs,
            scheduler=scheduler,
            participants=participants,
            worker_timeout=worker_timeout,
            on_progress=report,
            on_time_left=lambda left: estimates.update(simulating=left),
        )
    result: dict[str, Any] = {
        "study": folder,
        "name": study.name,
        "simulated": True,
        "cells": done.cells,
        "found": done.found,
        "simulated_now": done.simulated,
        "failed": done.failed,
        "damaged": done.damaged,
        "seconds": done.seconds,
    }
    warned = []
    if done.damaged:
        named = " ".join(list(done.damaged.values())[:_NAMED])
        warned += [
            f"{len(done.damaged)} of {done.cells} cells were damaged and are simulated "
            f"again: {named} What was left of them is next to them, under hidden names."
        ]
    if done.failed:
        few = list(done.failed.items())[:_NAMED]
        named = "; ".join(f"{name}: {reason}" for name, reason in few)
        warned += [
            f"{len(done.failed)} of {done.simulated} cells have no attempts: {named}"
        ]
    show(
        result | {"warnings": warned},
        f"{study.name}: {done.cells} cells, {done.simulated} simulated now in "
        f"{done.seconds:.0f} s, {done.found} there before",
        *notes(warned),
        f"All participants are simulated. Now: ikns report {folder}",
        as_json=as_json,
    )


for command in (init, run, plan):
    study_app.command()(checked(command))


@contextmanager
def _progress_or_lines(
    estimates: Mapping[str, Estimate],
) -> Iterator[Callable[[str, int, int], None]]:
    """Report progress: a bar on a terminal, elsewhere a line now and then."""
    if sys.stderr.isatty():
        with progress(estimates=estimates) as report:
            yield report
        return
    last = time.monotonic()

    def line(step: str, done: int, total: int) -> None:
        nonlocal last
        left = estimates[step].seconds() if step in estimates else None
        if left is None or time.monotonic() - last < _EVERY:
            return
        last = time.monotonic()
        sys.stderr.write(f"{done} of {total} cells, about {_minutes(left)} left\n")
        sys.stderr.flush()

    yield line


def _minutes(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
