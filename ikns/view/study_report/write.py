"""The folder of a study's report: page, figures for print, numbers, tables."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ikns.experiments.study.summary import Group, StudySummary
from ikns.experiments.study.summary.numbers import error_csv, numbers, trials_csv
from ikns.view.parts import NextStep, Section
from ikns.view.render import pdf, svg
from ikns.view.study_report.comparisons import ReportFigure
from ikns.view.study_report.forest_figure import forest_figure
from ikns.view.study_report.map_section import map_figure, map_section
from ikns.view.study_report.other_sections import (
    done_section,
    left_out_section,
    methods_section,
    variation_section,
)
from ikns.view.study_report.page import GroupPart, study_html
from ikns.view.study_report.picking_sections import picking_figures, picking_sections
from ikns.view.study_report.tracking_sections import (
    tracking_figures,
    tracking_sections,
)

_PAGE, _NUMBERS = "report.html", "numbers.json"
_TABLES: dict[str, Callable[[StudySummary], str]] = {
    "tables/tracking.csv": lambda summary: trials_csv(summary, "tracking"),
    "tables/picking.csv": lambda summary: trials_csv(summary, "picking"),
    "tables/tracking_error.csv": error_csv,
}
_FIGURES = (
    "answers",
    "tracking_traces",
    "tracking_error",
    "tracking_rmse",
    "tracking_learning",
    "tracking_difference",
    "picking_objects",
    "picking_difference",
    "workspace",
)
_KINDS: dict[str, Callable[[Any], bytes]] = {"pdf": pdf, "svg": svg}
#: Conditions that a study may have besides the first.
_MOST = 20


def report_files() -> list[str]:
    """Every file that a report may hold, relative to its folder."""
    names = [
        f"{prefix}{name}{again}.{kind}"
        for prefix in ("", "simulated_")
        for name in _FIGURES
        for again in ("", *(f"_{k}" for k in range(2, _MOST + 1)))
        for kind in _KINDS
    ]
    return [_PAGE, _NUMBERS, *_TABLES, *(f"figures/{name}" for name in names)]


def study_page(summary: StudySummary) -> tuple[str, list[tuple[str, ReportFigure]]]:
    """Return the page, and its figures with the names of their files."""
    parts, drawn = [], []
    for group in summary.groups:
        figures, sections = _group_contents(group)
        forest = forest_figure(group)
        if forest is not None:
            figures.insert(0, forest)
        prefix = "simulated_" if group.simulated else ""
        drawn += [(f"{prefix}{each.name}", each) for each in figures]
        answers = None if forest is None else forest.picture
        parts.append(GroupPart(group, answers, sections))
    page = study_html(
        summary,
        parts,
        left_out=left_out_section(summary),
        next_steps=_next_steps(summary),
    )
    return page, drawn


def write_study_report(
    folder: Path,
    summary: StudySummary,
    *,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> None:
    """Write a report into a folder that exists and is empty.

    ``report.html`` loads nothing from elsewhere; ``figures/`` has each figure as PDF
    and SVG; ``numbers.json`` and ``tables/*.csv`` have every number and trial.
    `progress` is called with (step, done, total).
    """
    progress("drawing", 0, 1)
    page, drawn = study_page(summary)
    (folder / _PAGE).write_text(page, encoding="utf-8", newline="\n")
    if drawn:
        (folder / "figures").mkdir()
    for done, (name, each) in enumerate(drawn, start=1):
        for kind, draw in _KINDS.items():
            (folder / "figures" / f"{name}.{kind}").write_bytes(draw(each.figure))
        progress("drawing", done, len(drawn))
    text = json.dumps(_plain(numbers(summary)), indent=1, allow_nan=False)
    (folder / _NUMBERS).write_text(text + "\n", encoding="utf-8")
    (folder / "tables").mkdir()
    for name, made in _TABLES.items():
        table = made(summary)
        if table:
            (folder / name).write_text(table, encoding="utf-8", newline="")


def _group_contents(group: Group) -> tuple[list[ReportFigure], list[Section]]:
    """All figures and sections of a group."""
    figures: list[ReportFigure] = []
    sections = [done_section(group)]
    if group.tracking is not None:
        drawn = tracking_figures(group.tracking)
        figures += drawn
        sections += tracking_sections(group.tracking, drawn)
    if group.picking is not None:
        drawn = picking_figures(group.picking)
        figures += drawn
        sections += picking_sections(group.picking, drawn)
    varied = variation_section(group)
    if varied is not None:
        sections.append(varied)
    volume = map_figure(group)
    if volume is not None:
        figures.append(volume)
    return figures, [*sections, map_section(volume), methods_section(group)]


def _next_steps(summary: StudySummary) -> list[NextStep]:
    if all(group.simulated for group in summary.groups):
        return [
            NextStep(
                "ikns study plan STUDY",
                "How many people a study needs to find, or to exclude, a difference:",
            ),
            NextStep(
                "ikns track --help",
                "The same experiment with people, into the same study folder:",
            ),
        ]
    return []


def _plain(value: Any) -> Any:
    """Without numbers that JSON does not know, arrays and tuples."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
