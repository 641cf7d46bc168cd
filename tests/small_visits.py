"""Visits on disk whose numbers are known beforehand: a pointer at a known distance."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ikns.experiments.tracking import (
    Profile,
    TrackingRecord,
    TrackingStep,
    draw_profile,
)
from ikns.experiments.tracking.visit import Attempt
from ikns.experiments.visits import create_visit, tracking_row, write_attempts

SECONDS, RATE, ALIGN = 15.0, 50.0, 1.0
TRAJECTORIES = ("T1", "T3")
Pointer = Callable[[Profile, np.ndarray], np.ndarray]


def visit(
    study: Path,
    who: int,
    experiment: str,
    rows: Sequence[Mapping[str, Any]],
    *,
    simulated: bool = True,
    variation: str = "",
    **about: Any,
) -> Path:
    """Put a visit on disk."""
    folder = study / "visits" / variation / f"sub-{who:02d}_{experiment}"
    create_visit(
        folder,
        {
            "experiment": experiment,
            "participant": f"{who:02d}",
            "simulated": simulated,
            "study": "small",
            "variation": variation,
            "variation_settings": {"latency": 0.1} if variation else {},
            "design": {"repeats": 1, "training": 0, "rest": 60.0, "seed": 0},
            "participant_number": who - 1,
            "seed": 0,
            "input": {"ikns": "replay:arm.c3d", "gamepad": "gamepad"},
            "session": None,
            "versions": {"ikns": "0.1.0"},
        }
        | about,
    )
    write_attempts(folder, rows)
    return folder


def attempt(
    number: int,
    condition: str,
    trajectory: str,
    pointer: Pointer,
    *,
    repeat: int = 0,
    practised: int = 0,
    kind: str = "trial",
    outcome: str = "done",
    reason: str = "",
) -> dict[str, Any]:
    """Row of a trial; the pointer's height is a function of profile and time."""
    step = TrackingStep(kind, condition, trajectory, 0, repeat, SECONDS)
    profile = draw_profile(trajectory, 0, seconds=SECONDS)
    time = np.arange(-round(ALIGN * RATE), round(SECONDS * RATE) + 1) / RATE
    c = pointer(profile, time) / 100
    record = TrackingRecord(profile, time, profile.at(time), c, "done")
    done = Attempt(step.key, outcome, reason, record if outcome == "done" else None)
    return tracking_row(number, step, done, align=ALIGN, practised=practised)


def off_by(error: float) -> Pointer:
    """Pointer at a constant distance above the target: RMSE and MAE are that distance.

    Targets lie within 8 to 92, so nothing is cut off up to 8.
    """
    return lambda profile, time: profile.at(time) + error


def tracking(
    study: Path,
    who: int,
    errors: Mapping[tuple[str, str], float | Sequence[float]],
    **about: Any,
) -> Path:
    """Visit with constant errors, by condition and trajectory; several: repeats."""
    rows: list[dict[str, Any]] = []
    done: dict[str, int] = {}
    for (condition, trajectory), sizes in errors.items():
        for repeat, size in enumerate(np.atleast_1d(sizes)):
            row = attempt(
                len(rows) + 1,
                condition,
                trajectory,
                off_by(float(size)),
                repeat=repeat,
                practised=done.get(condition, 0),
            )
            done[condition] = done.get(condition, 0) + 1
            rows.append(row)
    return visit(study, who, "tracking", rows, **about)


def picking_rows(
    outcomes: Mapping[tuple[str, str], tuple[str, float]], *, limit: float = 20.0
) -> list[dict[str, Any]]:
    """Rows of picking by (condition, object): outcome and time, s."""
    done: dict[str, int] = {}
    rows = []
    for number, ((condition, thing), (outcome, time)) in enumerate(
        outcomes.items(), start=1
    ):
        rows.append(
            {
                "number": number,
                "key": f"{condition}/trial/{thing}/0",
                "kind": "trial",
                "condition": condition,
                "object": thing,
                "repeat": 0,
                "outcome": outcome,
                "reason": "",
                "practised": done.get(condition, 0),
                "time": time,
                "limit": limit,
                "comment": "",
            }
        )
        done[condition] = done.get(condition, 0) + 1
    return rows


def small_study(study: Path, *, people: int = 4, **about: Any) -> Path:
    """Study of both experiments, everybody a little different."""
    rng = np.random.default_rng(5)
    for who in range(1, people + 1):
        errors = {
            (condition, trajectory): rng.uniform(1.5, 4.0, 3) + 0.4 * k
            for k, condition in enumerate(("ikns", "gamepad"))
            for trajectory in TRAJECTORIES
        }
        tracking(study, who, errors, **about)
        outcomes = {
            (condition, thing): ("success", float(rng.uniform(4, 7)) + late)
            for condition, late in (("ikns", 2.0), ("ring", 0.0))
            for thing in "ABC"
        }
        outcomes["ikns", "B"] = ("dropped", 3.0) if who % 2 else ("timeout", 20.0)
        visit(study, who, "picking", picking_rows(outcomes), **about)
    return study
