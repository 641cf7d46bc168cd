"""State of a study folder: the saved declaration, and the missing visits."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput, plain, unreadable
from ikns.experiments.study.cells import Task, visit_name
from ikns.experiments.study.declaration import FILE, Study
from ikns.experiments.visits import EXPERIMENTS, list_visits
from ikns.output.file import write_text
from ikns.output.lock import hold_lock

#: Copy of the declaration from before the first result, and lock file of a run.
_DECLARED, _LOCK = "declared.json", ".run.lock"


def check_declaration(folder: Path, study: Study) -> None:
    """Check that the study file still agrees with the results.

    More participants, another experiment, more variations and another name are allowed.
    A changed margin is not: it must be declared before the results.

    Raises
    ------
    InvalidInput
        When anything else was changed since the first result.
    FileError
        When the copy of the declaration is damaged.
    """
    before, now = _saved_declaration(folder), study.declared()
    if before is None:
        return
    place = folder / FILE
    for key in ("seed", "simulated", "parameters"):
        _check_unchanged(place, key, before.get(key), now[key])
    for key in EXPERIMENTS:
        if before.get(key) is not None:
            _check_unchanged(place, key, before[key], now[key])
    for name, changes in before.get("variations", {}).items():
        _check_unchanged(
            place, f"variations.{name}", changes, now["variations"].get(name)
        )


def save_declaration(folder: Path, study: Study) -> None:
    """Save the declaration before the first result, and later what was added."""
    check_declaration(folder, study)
    before, now = _saved_declaration(folder), study.declared()
    kept = now if before is None else {**now, "participants": before["participants"]}
    if before is not None:
        for key in EXPERIMENTS:
            kept[key] = now[key] if before.get(key) is None else before[key]
    if kept == before:
        return
    place = folder / "visits" / _DECLARED
    place.parent.mkdir(exist_ok=True)
    write_text(place, json.dumps(kept, indent=1) + "\n")


def restore_declaration(folder: Path, study: Study) -> None:
    """Save the declaration again if there are results, and it is gone."""
    if list_visits(folder) and not (folder / "visits" / _DECLARED).exists():
        save_declaration(folder, study)


@contextmanager
def run_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of a study; that of a killed run is taken over.

    Raises
    ------
    InvalidInput
        When another run holds it.
    FileError
        When the folder cannot be written.
    """
    visits = folder / "visits"
    try:
        visits.mkdir(exist_ok=True)
    except OSError as error:
        raise FileError(f"{visits}: cannot be created: {plain(error)}.") from None
    with hold_lock(visits / _LOCK, "to run a study"):
        for left in visits.glob(f".{_DECLARED}.*.part"):  # by a run that was killed
            left.unlink(missing_ok=True)
        yield


def visit_names(study: Study, *, participants: int) -> Iterator[str]:
    """Yield the names of all visits of the first participants."""
    for number in range(participants):
        for variation in ("", *study.variations):
            for experiment in study.designs:
                yield visit_name(experiment, number, variation)


def missing_tasks(folder: Path, study: Study, *, participants: int) -> Iterator[Task]:
    """Yield the missing visits: the first task of each kind, then the others.

    Tasks of one kind have the same variation and experiments. So the first results tell
    what everything costs. Lazily: a visit is looked for when its turn comes.
    """
    first: dict[tuple[str, tuple[str, ...]], Task] = {}
    for task in _missing(folder, study, participants):
        first.setdefault((task.variation, task.experiments), task)
    yield from first.values()
    begun = {(task.number, task.variation) for task in first.values()}
    for task in _missing(folder, study, participants):
        if (task.number, task.variation) not in begun:
            yield task


def _missing(folder: Path, study: Study, participants: int) -> Iterator[Task]:
    for number in range(participants):
        for variation in ("", *study.variations):
            missing = tuple(
                experiment
                for experiment in study.designs
                if not os.path.lexists(
                    folder / "visits" / visit_name(experiment, number, variation)
                )
            )
            if missing:
                yield Task(study, number, variation, missing)


def _saved_declaration(folder: Path) -> dict[str, Any] | None:
    if not list_visits(folder):  # a declaration without results may change
        return None
    place = folder / "visits" / _DECLARED
    try:
        table = json.loads(place.read_text(encoding="utf-8"))
        table["participants"]
    except FileNotFoundError:
        return None
    except OSError as error:
        raise unreadable(place, error) from None
    except (ValueError, LookupError, TypeError):
        raise FileError(
            f"{place}: cannot be read as the declaration from before the first result; "
            f"delete it if {FILE} has not been changed since."
        ) from None
    return dict(table)


def _check_unchanged(place: Path, key: str, before: Any, now: Any) -> None:
    if before == now:
        return
    if isinstance(before, dict) and isinstance(now, dict):
        for name in before:
            _check_unchanged(place, f"{key}.{name}", before[name], now.get(name))
    raise InvalidInput(
        f"{place}: there are results with {key} = {before}, found {now}; restore it "
        "or make a new study."
    )
