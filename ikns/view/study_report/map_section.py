"""Clusters and interpolation volume, where a visit's subject can be read."""

from __future__ import annotations

import numpy as np

from ikns.experiments.study.summary import Group
from ikns.experiments.study.summary.subjects import VisitSubject, first_subject
from ikns.view.body import arm_points
from ikns.view.parts import Section
from ikns.view.study_report.comparisons import ReportFigure
from ikns.view.workspace import workspace_figure

_NO_MAP = (
    "Left out: no visit has a recorded session, or a folder `subject` (as `ikns "
    "calibrate` writes it) in it or next to it, to take a map from."
)

#: Most positions of the hand that are drawn.
_MOST = 4000


def map_figure(group: Group) -> ReportFigure | None:
    """Volume of the first visit whose subject can be read; None without any."""
    found = first_subject(group)
    return None if found is None else _figure(found, simulated=group.simulated)


def map_section(figure: ReportFigure | None) -> Section:
    """Picture, or a sentence that says why there is none."""
    title = "Clusters and interpolation volume"
    if figure is None:
        return Section(title, [_NO_MAP])
    return Section(title, [], [figure.picture], folded=True)


def _figure(found: VisitSubject, *, simulated: bool) -> ReportFigure:
    subject, learned = found.subject, found.subject.null_space_map
    hand = found.hand[:: len(found.hand) // _MOST + 1]
    still = np.empty((0, 4)) if subject.samples is None else subject.samples
    parts = [
        *(["Path of the hand while tracking"] if len(hand) > 1 else []),
        *([f"{len(still)} still samples of the calibration"] if len(still) else []),
        f"PCA points of {found.visit.name.split('_')[0]} and the volume in which their "
        "directions are interpolated, in the thorax frame.",
    ]
    return ReportFigure(
        "workspace",
        workspace_figure(
            hand,
            still[:, :3],
            still[:, 3].astype(np.int64) - 1,
            learned.centers_,
            facets=getattr(learned.interpolator_, "hull_facets", None),
            arms=arm_points(subject.skeleton, subject.skeleton.neutral()),
            simulated=simulated,
        ),
        ", ".join(parts),
        "Two 3-D views of the PCA points in front of the body",
    )
