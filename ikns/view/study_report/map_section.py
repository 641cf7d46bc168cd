"""Clusters and interpolation volume, where a subject folder is at hand."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ikns.errors import IknsError
from ikns.experiments.summary import Group
from ikns.subject import Subject
from ikns.view.body import arm_points
from ikns.view.parts import Section
from ikns.view.study_report.tracking_sections import Drawn
from ikns.view.study_report.words import NO_MAP
from ikns.view.workspace import workspace_figure

__all__ = ["map_drawn", "map_section"]


def map_drawn(group: Group) -> Drawn | None:
    """Volume of the first participant with a subject folder that can be read."""
    for visit in _visits(group):
        for place in (visit / "subject", visit.parent / f"{visit.name}_subject"):
            if not (place / "map.json").is_file():
                continue
            try:
                subject = Subject.load(place)
            except IknsError:
                continue
            return _drawn(subject, visit.name.split("_")[0], group.simulated)
    return None


def map_section(drawn: Drawn | None) -> Section:
    """Picture, or a sentence why there is none."""
    title = "Clusters and interpolation volume"
    if drawn is None:
        return Section(title, [NO_MAP])
    return Section(title, [], [drawn.picture])


def _visits(group: Group) -> Iterable[Path]:
    for each in (group.tracking, group.picking):
        if each is not None:
            yield from each.folders.values()


def _drawn(subject: Subject, who: str, simulated: bool) -> Drawn:
    learned = subject.null_space_map
    nowhere = np.empty((0, 3))
    return Drawn(
        "workspace",
        workspace_figure(
            np.full((1, 3), np.nan),  # no path of the hand is kept with a subject
            nowhere,
            np.empty(0, dtype=np.int64),
            learned.centers_,
            facets=getattr(learned.interpolator_, "hull_facets", None),
            arms=arm_points(subject.skeleton, subject.skeleton.neutral()),
            simulated=simulated,
        ),
        f"PCA points of {who} and the volume in which their directions are "
        "interpolated, in the thorax frame.",
        "Two 3-D views of the PCA points in front of the body",
    )
