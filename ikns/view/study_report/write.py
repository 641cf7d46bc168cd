"""The folder of a study's report: page, figures for print, numbers, tables."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ikns.experiments.study.summary import Group, StudySummary
from ikns.experiments.study.summary.numbers import error_csv, numbers, trials_csv
from ikns.view.parts import Section, Step
from ikns.view.render import pdf, svg
from ikns.view.study_report.map_section import map_drawn, map_section
from ikns.view.study_report.other_sections import (
    done_section,
    left_out_section,
    methods_section,
    variation_section,
)
from ikns.view.study_report.page import Part, study_html
from ikns.view.study_report.picking_sections import picking_drawn, picking_sections
from ikns.view.study_report.tracking_sections import (
    Drawn,
    tracking_figures,
    tracking_sections,
)

__all__ = ["report_files", "study_page", "write_study_report"]

_PAGE, _NUMBERS = "report.html", "numbers.json"
_TABLES: dict[str, Callable[[StudySummary], str]] = {
    "tables/tracking.csv": lambda summary: trials_csv(summary, "tracking"),
    "tables/picking.csv": lambda summary: trials_csv(summary, "picking"),
    "tables/tracking_error.csv": error_csv,
}
_FIGURES = (
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
#: Conditions that a study may have beside the first.
_MOST = 20


def report_files() -> list[str]:
    """Every file that a report may hold, relative to its folder."""
    names = [
        f"{whose}{name}{again}.{kind}"
        for whose in ("", "simulated_")
        for name in _FIGURES
        for again in ("", *(f"_{k}" for k in range(2, _MOST + 1)))
        for kind in _KINDS
    ]
    return [_PAGE, _NUMBERS, *_TABLES, *(f"figures/{name}" for name in names)]


def study_page(summary: StudySummary) -> tuple[str, list[tuple[str, Drawn]]]:
    """Return the page, and its figures with the names of their files."""
    drawn: list[tuple[str, Drawn]] = []
    parts = [Part(group, list(_sections(group, drawn))) for group in summary.groups]
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

    Parameters
    ----------
    folder : Path
    summary : StudySummary
    progress : callable
        Told (step, done, total).
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


def _sections(group: Group, drawn: list[tuple[str, Drawn]]) -> Iterator[Section]:
    """All sections of a group; its figures are put to those drawn before."""
    whose = "simulated_" if group.simulated else ""

    def keep(figures: Iterable[Drawn]) -> list[Drawn]:
        own = list(figures)
        drawn.extend((f"{whose}{each.name}", each) for each in own)
        return own

    yield done_section(group)
    if group.tracking is not None:
        yield from tracking_sections(
            group.tracking, keep(tracking_figures(group.tracking))
        )
    if group.picking is not None:
        yield from picking_sections(group.picking, keep(picking_drawn(group.picking)))
    varied = variation_section(group)
    if varied is not None:
        yield varied
    volume = map_drawn(group)
    keep([] if volume is None else [volume])
    yield map_section(volume)
    yield methods_section(group)


def _next_steps(summary: StudySummary) -> list[Step]:
    if all(group.simulated for group in summary.groups):
        return [
            Step(
                "ikns study plan",
                "How many people a study needs to find, or to exclude, a difference:",
            ),
            Step(
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
