"""Finds visits of a study that were damaged since they were written."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import count
from pathlib import Path

from ikns.errors import FileError, plain
from ikns.experiments.study.cells import visit_name
from ikns.experiments.study.declaration import Study
from ikns.experiments.study.results import visit_names
from ikns.experiments.visits import has_attempts, read_visit
from ikns.experiments.visits.header import HEADER, read_header
from ikns.experiments.visits.sums import check_sums
from ikns.output.file import sync

#: End of the hidden name that a damaged visit gets; no visit is called like that.
ASIDE = ".damaged"


def set_damaged_aside(
    folder: Path,
    study: Study,
    *,
    participants: int,
    report: Callable[[str, int, int], None],
) -> tuple[int, dict[str, str]]:
    """Check every visit that is there; rename damaged ones, to simulate them again.

    Nothing is deleted but empty folders. Visits of people are not checked.

    Parameters
    ----------
    folder : Path
        Of the study.
    study : Study
    participants : int
        Only the first ones.
    report : callable
        Called with ("checking", visits seen, visits in total) for each that is there.

    Returns
    -------
    found : int
        Whole visits.
    damaged : dict of str to str
        What is wrong with the others, by their names.

    Raises
    ------
    FileError
        When a damaged visit cannot be renamed.
    """
    found, damaged = 0, {}
    names = list(visit_names(study, participants=1))
    total = participants * len(names)
    seen = visit_names(study, participants=participants)
    for number, name in enumerate(seen):
        visit = folder / "visits" / name
        if not os.path.lexists(visit):
            continue
        report("checking", number, total)
        fault = _fault(visit, study, number // len(names))
        if fault:
            damaged[name] = fault
            _set_aside(visit)
        found += not fault
    return found, damaged


def _fault(visit: Path, study: Study, number: int) -> str:
    """Say what is wrong with a visit; empty if nothing is."""
    try:
        if visit.is_symlink() and not visit.exists():
            return f"{visit}: expected a folder, found a link to nothing."
        if not visit.is_dir():
            return f"{visit}: expected a folder, found a file."
        about = read_header(visit)
        if not about["simulated"]:
            return ""
        where = [str(about.get("variation") or ""), about["participant"]]
        named = visit_name(about["experiment"], number, where[0])
        wanted = f"{number + 1:02d}"
        if not visit.as_posix().endswith(f"/visits/{named}") or where[1] != wanted:
            return (
                f"{visit / HEADER}: expected the visit that its folder is named after, "
                f"found participant {where[1]} in {about['experiment']}."
            )
        if about.get("seed") != study.seed:
            return (
                f"{visit / HEADER}: expected the seed {study.seed}, found "
                f"{about.get('seed')}."
            )
        if not has_attempts(visit):
            return f"{visit}: there are no attempts in this visit."
        if not check_sums(visit):
            read_visit(visit)  # by a version that wrote no checksums
    except FileError as error:
        return str(error)
    return ""


def _set_aside(visit: Path) -> None:
    try:
        if visit.is_dir() and not visit.is_symlink() and not any(visit.iterdir()):
            visit.rmdir()
            return
        places = (
            visit.with_name(f".{visit.name}{ASIDE}{f'-{k}' if k > 1 else ''}")
            for k in count(1)
        )
        visit.rename(next(place for place in places if not os.path.lexists(place)))
        sync(visit.parent)
    except OSError as error:
        raise FileError(
            f"{visit}: is damaged and cannot be renamed: {plain(error)}."
        ) from None
