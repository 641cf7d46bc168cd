"""Clusters and interpolation volume, where a visit's subject is at hand."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.errors import IknsError
from ikns.experiments.study.summary import Group
from ikns.live.session import read_run
from ikns.view.body import arm_points
from ikns.view.parts import Section
from ikns.view.study_report.texts import NO_MAP
from ikns.view.study_report.tracking_sections import Drawn
from ikns.view.workspace import workspace_figure

__all__ = ["map_drawn", "map_section"]

Array = NDArray[np.float64]

_NOWHERE = np.full((1, 3), np.nan)
#: Places of the hand that are drawn at most.
_MOST = 4000


def map_drawn(group: Group) -> Drawn | None:
    """Volume of the first visit whose subject can be read; None without any."""
    for visit, session in _visits(group):
        for subject, hand in _subjects(visit, session):
            return _drawn(subject, hand, visit.name.split("_")[0], group.simulated)
    return None


def map_section(drawn: Drawn | None) -> Section:
    """Picture, or a sentence why there is none."""
    title = "Clusters and interpolation volume"
    if drawn is None:
        return Section(title, [NO_MAP])
    return Section(title, [], [drawn.picture])


def _visits(group: Group) -> Iterator[tuple[Path, str]]:
    for each in (group.tracking, group.picking):
        if each is not None:
            for key, folder in each.folders.items():
                yield folder, each.sessions.get(key, "")


def _subjects(visit: Path, session: str) -> Iterator[tuple[Subject, Array]]:
    """Subjects that can be read, and where the hand was: of the session, or beside."""
    if session:
        try:
            run = read_run(visit / session)
            path = np.column_stack([run.model[f"hand_{axis}"] for axis in "xyz"])
            yield Subject.load(run.subject_folder), path[:: len(path) // _MOST + 1]
        except (IknsError, KeyError, OSError):
            pass
    for place in (visit / "subject", visit.parent / "subject"):
        if (place / "map.json").is_file():
            try:
                yield Subject.load(place), _NOWHERE
            except IknsError:
                continue


def _drawn(subject: Subject, hand: Array, who: str, simulated: bool) -> Drawn:
    learned = subject.null_space_map
    seen = np.empty((0, 4)) if subject.samples is None else subject.samples
    parts = [
        *(["Path of the hand while tracking"] if len(hand) > 1 else []),
        *([f"{len(seen)} still samples of the calibration"] if len(seen) else []),
        f"PCA points of {who} and the volume in which their directions are "
        "interpolated, in the thorax frame.",
    ]
    return Drawn(
        "workspace",
        workspace_figure(
            hand,
            seen[:, :3],
            seen[:, 3].astype(np.int64) - 1,
            learned.centers_,
            facets=getattr(learned.interpolator_, "hull_facets", None),
            arms=arm_points(subject.skeleton, subject.skeleton.neutral()),
            simulated=simulated,
        ),
        ", ".join(parts),
        "Two 3-D views of the PCA points in front of the body",
    )
