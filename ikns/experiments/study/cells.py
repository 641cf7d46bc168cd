"""Simulates the cells of a study: a participant, an experiment, a variation each."""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ikns.calibration.subject import Subject
from ikns.errors import IknsError, InvalidInput
from ikns.experiments.picking.schedule import PickStep
from ikns.experiments.study.declaration import Study
from ikns.experiments.study.design import Parameters, PickingDesign, TrackingDesign
from ikns.experiments.study.people import study_participant
from ikns.experiments.study.versions import library_versions
from ikns.experiments.tracking.profiles import draw_profile
from ikns.experiments.tracking.schedule import TrackingStep
from ikns.experiments.tracking.virtual import virtual_step
from ikns.experiments.tracking.visit import Attempt
from ikns.experiments.visits import table_bytes, tracking_row
from ikns.simulation.operator import Participant

S = TypeVar("S", TrackingStep, PickStep)

#: Errors that keep one virtual person from taking part, and do not end the run.
_FAULTS = (IknsError, ArithmeticError, np.linalg.LinAlgError)
_INPUTS = {
    "ikns": "virtual operator through body, cameras and map (simulated)",
    "gamepad": "virtual operator with a stick, direct (simulated)",
    "ring": "virtual operator with a ring button (simulated)",
}


@dataclass(frozen=True)
class Task:
    """Cells to simulate of one participant under one variation.

    One worker does them together: drawing and calibrating the person takes a third of
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
class SimulatedVisit:
    """A simulated visit, ready to be written.

    Parameters
    ----------
    name : str
        Of its folder, relative to ``visits``.
    about : dict
        Content of ``visit.json``.
    attempts : bytes
        Parquet file.
    others : dict of str to bytes
        Other files, by their names in the folder: the subject of the first participant,
        for the report.
    seconds : dict of str to float
        How long it took to draw and calibrate the "person", in the first visit of a
        task, and to simulate the experiment, by its name. Not written.
    """

    name: str
    about: dict[str, Any]
    attempts: bytes
    others: dict[str, bytes] = field(default_factory=dict, repr=False)
    seconds: dict[str, float] = field(default_factory=dict, compare=False)


def visit_name(experiment: str, number: int, variation: str = "") -> str:
    """Return the folder of a participant's visit, relative to ``visits``.

    >>> visit_name("tracking", 0), visit_name("picking", 99, "gate")
    ('sub-01_tracking', 'gate/sub-100_picking')
    """
    name = f"sub-{number + 1:02d}_{experiment}"
    return f"{variation}/{name}" if variation else name


def check_libraries(study: Study) -> None:
    """Check that the libraries for simulating a study are installed.

    Raises
    ------
    InvalidInput
        When one is missing.
    """
    if study.picking is not None and find_spec("mujoco") is None:
        raise InvalidInput(
            "picking is simulated with mujoco, found none; install it with pip install "
            "'ikns[study]'."
        )


def simulate(task: Task) -> list[SimulatedVisit]:
    """Simulate the visits of a task; the result depends on the task alone.

    If no one of 20 persons drawn can do the protocol, or the calibration fails, the
    visits have no attempts, and ``visit.json`` says why.
    """
    study, parameters = task.study, task.study.parameters_of(task.variation)
    check_libraries(study)  # a worker on another machine may lack one
    person, fault, began = None, "", time.perf_counter()
    try:
        person = study_participant(
            task.number,
            seed=study.seed,
            parameters=parameters,
            other_methods=task.number == 0,  # whose subject is saved
        )
    except _FAULTS as error:
        fault = str(error)
    visits = []
    seconds = {"person": time.perf_counter() - began}
    for experiment in task.experiments:
        began = time.perf_counter()
        rows: list[dict[str, Any]] = []
        reason = fault
        try:
            if person is not None:
                rows = list(_attempts(experiment, person, study, parameters))
        except _FAULTS as error:
            rows, reason = [], str(error)
        about = _about(task, experiment, parameters, person, reason)
        name = visit_name(experiment, task.number, task.variation)
        others = {}
        if person is not None and task.number == 0:
            others = _subject_files(person.subject)
        attempts = table_bytes(experiment, rows)
        seconds[experiment] = time.perf_counter() - began
        visits.append(SimulatedVisit(name, about, attempts, others, seconds))
        seconds = {}
    return visits


def _subject_files(subject: Subject) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        subject.save(Path(folder) / "subject")
        return {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(Path(folder).glob("subject/*"))
        }


def _attempts(
    experiment: str, person: Participant, study: Study, parameters: Parameters
) -> Iterator[dict[str, Any]]:
    design = study.designs[experiment]
    if isinstance(design, TrackingDesign):
        yield from _tracking(person, design, study.seed, parameters)
    else:
        yield from _picking(person, design, study.seed, parameters)


def _tracking(
    person: Participant, design: TrackingDesign, seed: int, parameters: Parameters
) -> Iterator[dict[str, Any]]:
    from ikns.live.control.settings import ControlSettings

    settings = ControlSettings() if parameters.smoothing else None
    trials = _trials(design.steps(person.number, seed=seed))
    for number, (step, practised) in enumerate(trials, start=1):
        record = virtual_step(
            person,
            step,
            draw_profile(step.profile, step.seed, seconds=step.seconds),
            practised=practised,
            rate=parameters.rate,
            latency=parameters.latency,
            align=design.align,
            settings=settings,
        )
        attempt = Attempt(step.key, "done", "", record)
        yield tracking_row(
            number, step, attempt, align=design.align, practised=practised
        )


def _picking(
    person: Participant, design: PickingDesign, seed: int, parameters: Parameters
) -> Iterator[dict[str, Any]]:
    from ikns.experiments.picking.virtual import virtual_pick_step

    trials = _trials(design.steps(person.number, seed=seed))
    for number, (step, practised) in enumerate(trials, start=1):
        yield {"number": number} | virtual_pick_step(
            person,
            step,
            practised=practised,
            rate=parameters.rate,
            latency=parameters.latency,
        )


def _trials(steps: Iterable[S]) -> Iterator[tuple[S, int]]:
    """Yield the trials, each with the count of earlier ones in its condition.

    Training trials are counted but not simulated: only their count has an effect.
    """
    done: Counter[str] = Counter()
    for step in steps:
        if step.kind == "rest":
            continue
        if step.kind == "trial":
            yield step, done[step.condition]
        done[step.condition] += 1


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
        "versions": library_versions(picking=experiment == "picking"),
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
