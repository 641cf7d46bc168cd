"""A cell: one virtual participant in one experiment under one variation."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

from ikns.errors import IknsError
from ikns.experiments.study.declaration import Study
from ikns.experiments.study.design import Parameters, TrackingDesign
from ikns.experiments.study.people import study_participant
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.virtual import virtual_step
from ikns.experiments.tracking.visit import Attempt
from ikns.experiments.visits import table_bytes, tracking_row
from ikns.simulation.operator import Participant

__all__ = ["Cell", "Task", "simulate", "visit_name"]

#: What keeps one virtual person from taking part, without being a fault of the program.
_FAULTS = (IknsError, ArithmeticError)
_INPUTS = {
    "ikns": "virtual operator through body, cameras and map (simulated)",
    "gamepad": "virtual operator with a stick, direct (simulated)",
    "ring": "virtual operator with a ring button (simulated)",
}


@dataclass(frozen=True)
class Task:
    """Cells of one participant under one variation that are to be simulated.

    They go to one worker together: drawing and calibrating the person takes a third of
    the time.

    Parameters
    ----------
    study : Study
    number : int
        Of the participant, from 0.
    variation : str
    experiments : tuple of str
    """

    study: Study
    number: int
    variation: str
    experiments: tuple[str, ...]


@dataclass(frozen=True)
class Cell:
    """A simulated cell, ready to be written.

    Parameters
    ----------
    name : str
        Of its visit's folder, relative to ``visits``.
    about : dict
        Its ``visit.json``.
    attempts : bytes
        Its Parquet file.
    """

    name: str
    about: dict[str, Any]
    attempts: bytes


def visit_name(experiment: str, number: int, variation: str = "") -> str:
    """Folder of a participant's visit, relative to ``visits``.

    >>> visit_name("tracking", 0), visit_name("picking", 99, "gate")
    ('sub-01_tracking', 'gate/sub-100_picking')
    """
    name = f"sub-{number + 1:02d}_{experiment}"
    return f"{variation}/{name}" if variation else name


def simulate(task: Task) -> list[Cell]:
    """Simulate cells; the result depends on the task and on nothing else.

    A person whom nobody of 20 can replace, or whose calibration fails, has visits
    without attempts, and ``visit.json`` says why.
    """
    study, parameters = task.study, task.study.parameters_of(task.variation)
    person, fault = None, ""
    try:
        person = study_participant(task.number, seed=study.seed, parameters=parameters)
    except _FAULTS as error:
        fault = str(error)
    cells = []
    for experiment in task.experiments:
        rows: list[dict[str, Any]] = []
        reason = fault
        try:
            if person is not None:
                rows = list(_attempts(experiment, person, study, parameters))
        except _FAULTS as error:
            rows, reason = [], str(error)
        about = _about(task, experiment, parameters, person, reason)
        name = visit_name(experiment, task.number, task.variation)
        cells.append(Cell(name, about, table_bytes(experiment, rows)))
    return cells


def _attempts(
    experiment: str, person: Participant, study: Study, parameters: Parameters
) -> Iterator[dict[str, Any]]:
    design = study.designs[experiment]
    assert isinstance(design, TrackingDesign)
    yield from _tracking(person, design, study.seed, parameters)


def _tracking(
    person: Participant, design: TrackingDesign, seed: int, parameters: Parameters
) -> Iterator[dict[str, Any]]:
    from ikns.control.controller import Settings

    settings = Settings() if parameters.smoothing else None
    practised = dict.fromkeys(design.conditions, 0)
    number = 0
    for step in design.steps(person.number, seed=seed):
        if step.kind == "rest":
            continue
        before = practised[step.condition]
        practised[step.condition] += 1
        if step.kind == "training":  # what it leaves behind is its count
            continue
        number += 1
        record = virtual_step(
            person,
            step,
            draw_profile(step.profile, step.seed, seconds=step.seconds),
            practised=before,
            rate=parameters.rate,
            latency=parameters.latency,
            settings=settings,
        )
        attempt = Attempt(step.key, "done", "", record)
        yield tracking_row(number, step, attempt, align=design.align, practised=before)


def _about(
    task: Task,
    experiment: str,
    parameters: Parameters,
    person: Participant | None,
    reason: str,
) -> dict[str, Any]:
    study, design = task.study, task.study.designs[experiment]
    about: dict[str, Any] = {
        "experiment": experiment,
        "participant": f"{task.number + 1:02d}",
        "simulated": True,
        "study": study.name,
        "variation": task.variation,
        "variation_settings": dict(study.variations.get(task.variation, {})),
        "parameters": asdict(parameters),
        "design": design.arguments(seed=study.seed),
        "participant_number": task.number,
        "seed": study.seed,
        "input": {c: _INPUTS[c] for c in design.conditions},
        "training": "counted in practised, not simulated",
        "session": None,
        "subject": {},
        "versions": _versions(),
        "redrawn": 0,
        "reason": reason,
    }
    if person is not None:
        adult = person.protocol.subject.adult
        about |= {
            "redrawn": person.redrawn,
            "subject": {
                "stature_m": adult.stature_m,
                "mass_kg": adult.mass_kg,
                "sex": adult.sex,
                "calibration_points": len(person.subject.null_space_map.centers_),
            },
        }
    return about


def _versions() -> dict[str, str]:
    names = ("ikns", "numpy", "scipy", "numba", "pin")
    return {"python": platform.python_version()} | {n: version(n) for n in names}
