"""The calibrated subject behind a group's visits, where one can be read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.calibration.subject import Subject
from ikns.errors import IknsError
from ikns.experiments.study.summary.study import Group
from ikns.live.session import read_run


class VisitSubject(NamedTuple):
    """A subject, and where the hand was during a visit.

    Parameters
    ----------
    subject : Subject
    hand : (T, 3) array
        Of the session's last run, m in the thorax frame; one row of NaN without it.
    visit : Path
        Folder of the visit.
    """

    subject: Subject
    hand: Array
    visit: Path


def first_subject(group: Group) -> VisitSubject | None:
    """Return the subject of the first visit that has one; None without any.

    It is looked for in the visit's recorded session, then in a folder ``subject`` in
    the visit or next to it.
    """
    return next(
        (found for visit, name in _visits(group) for found in _subjects(visit, name)),
        None,
    )


def _visits(group: Group) -> Iterator[tuple[Path, str]]:
    """Folder of each visit, and the session recorded with it or empty text."""
    for each in (group.tracking, group.picking):
        if each is not None:
            for key, folder in each.folders.items():
                yield folder, each.sessions.get(key, "")


def _subjects(visit: Path, session: str) -> Iterator[VisitSubject]:
    if session:
        try:
            run = read_run(visit / session)
            hand = np.column_stack([run.model[f"hand_{axis}"] for axis in "xyz"])
            yield VisitSubject(Subject.load(run.subject_folder), hand, visit)
        except (IknsError, KeyError, OSError):
            pass
    for place in (visit / "subject", visit.parent / "subject"):
        if (place / "map.json").is_file():
            try:
                yield VisitSubject(Subject.load(place), np.full((1, 3), np.nan), visit)
            except IknsError:
                continue
