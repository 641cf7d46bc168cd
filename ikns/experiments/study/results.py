"""What a study folder holds so far: what was declared, which cells are done."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput
from ikns.experiments.study.cells import Task, visit_name
from ikns.experiments.study.declaration import FILE, Study
from ikns.experiments.visits import EXPERIMENTS, list_visits

__all__ = ["alone", "check_declared", "keep_declared", "tasks"]

#: Copy of the declaration that the results were made under, and the lock of a run.
_DECLARED, _LOCK = "declared.json", ".run.lock"


def check_declared(folder: Path, study: Study) -> None:
    """Make sure that results and study file mean the same.

    More participants, another experiment, more variations and another name are no
    change of what is there. A margin is: it has to be declared before the results.

    Raises
    ------
    InvalidInput
        When anything else was changed since the first result.
    FileError
        When the copy of the declaration is damaged.
    """
    before, now = _before(folder), study.declared()
    if before is None:
        return
    place = folder / FILE
    for key in ("seed", "simulated", "parameters"):
        _same(place, key, before.get(key), now[key])
    for key in EXPERIMENTS:
        if before.get(key) is not None:
            _same(place, key, before[key], now[key])
    for name, changes in before.get("variations", {}).items():
        _same(place, f"variations.{name}", changes, now["variations"].get(name))


def keep_declared(folder: Path, study: Study) -> None:
    """Write down what was declared, before the first result; later what was added."""
    check_declared(folder, study)
    before, now = _before(folder), study.declared()
    kept = now if before is None else {**now, "participants": before["participants"]}
    if before is not None:
        for key in EXPERIMENTS:
            kept[key] = now[key] if before.get(key) is None else before[key]
    if kept == before:
        return
    place = folder / "visits" / _DECLARED
    part = place.with_suffix(".part")
    place.parent.mkdir(exist_ok=True)
    part.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    part.replace(place)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keep a second run off the same study; a killed one is in nobody's way.

    Raises
    ------
    InvalidInput
        When another run goes on.
    """
    visits = folder / "visits"
    visits.mkdir(exist_ok=True)
    with (visits / _LOCK).open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InvalidInput(
                f"{folder}: expected to run a study once at a time, found another run "
                "that goes on."
            ) from None
        yield


def tasks(folder: Path, study: Study, *, participants: int) -> Iterator[Task]:
    """Go through what is not there yet, one participant after the other.

    Lazily: whether a visit is there is asked when its turn comes.

    Raises
    ------
    FileError
        When a visit's folder is there without its table.
    """
    for variation in ("", *study.variations):
        for number in range(participants):
            missing = tuple(
                experiment
                for experiment in study.designs
                if not _done(
                    folder / "visits" / visit_name(experiment, number, variation)
                )
            )
            if missing:
                yield Task(study, number, variation, missing)


def _done(visit: Path) -> bool:
    if not visit.exists():
        return False
    if not (visit / "visit.json").is_file():
        raise FileError(
            f"{visit}: expected a visit with visit.json, found none; move the folder "
            "away."
        )
    return True


def _before(folder: Path) -> dict[str, Any] | None:
    if not list_visits(folder):  # a run that came to nothing declares nothing
        return None
    place = folder / "visits" / _DECLARED
    try:
        table = json.loads(place.read_text(encoding="utf-8"))
        table["participants"]
    except FileNotFoundError:
        return None
    except OSError as error:
        raise FileError(f"{place}: cannot be read: {error.strerror}.") from None
    except (ValueError, LookupError, TypeError):
        raise FileError(f"{place}: cannot be read as what was declared.") from None
    return dict(table)


def _same(place: Path, key: str, before: Any, now: Any) -> None:
    if before == now:
        return
    if isinstance(before, dict) and isinstance(now, dict):
        for name in before:
            _same(place, f"{key}.{name}", before[name], now.get(name))
    raise InvalidInput(
        f"{place}: there are results with {key} = {before}, found {now}; restore it "
        "or make a new study."
    )
