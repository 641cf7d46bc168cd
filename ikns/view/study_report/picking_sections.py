"""Experiment 2 as sections of a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from ikns.experiments.picking import load_objects
from ikns.experiments.study.summary import (
    ObjectResult,
    PickComparison,
    PickingSummary,
)
from ikns.experiments.study.summary.answers import people, worded
from ikns.view.cells import Cell
from ikns.view.parts import Picture, Section, Table
from ikns.view.study_report.comparisons import (
    NO_INTERVAL,
    NO_MARGIN,
    NO_TRIAL,
    ReportFigure,
    difference_figures,
    difference_name,
    effects_table,
    tests_table,
)
from ikns.view.study_report.picking_figures import picking_figure


def picking_figures(found: PickingSummary) -> list[ReportFigure]:
    """All figures of experiment 2; none without a trial."""
    if not len(found.trials()["success"]):
        return []
    share = (
        f"; {NO_INTERVAL}"
        if _one(found)
        else ", with 95 % intervals (Clopper and Pearson)"
    )
    return [
        ReportFigure(
            "picking_objects",
            picking_figure(found),
            f"Above: share of trials that succeeded{share}. Below: time of every "
            "trial; crosses are failures, at the limit; black bars: mean time with "
            "failures counted at the limit.",
            "Success and time by object and condition",
        ),
        *difference_figures(
            "picking",
            found.comparisons,
            equivalence=lambda compared: compared.equivalence,
            quantity="time to success",
            caption=", failures counted at the limit, over participants.",
            simulated=found.simulated,
        ),
    ]


def _one(found: PickingSummary) -> bool:
    """Whether no condition has more than one participant."""
    return max(cell.subjects for cell in found.cells) <= 1


def picking_sections(
    found: PickingSummary, figures: list[ReportFigure]
) -> Iterator[Section]:
    """Pictures, tables and tests; what is not tested says why."""
    pictures = {each.name: each.picture for each in figures}
    text = [
        f"Trials of {people(len(found.participants), simulated=found.simulated)}. "
        "A trial succeeds, or the object is dropped, or time runs out."
    ]
    if not figures:
        text.append(NO_TRIAL)
    yield Section(
        "Pick and place",
        text,
        [pictures["picking_objects"]] if figures else [],
        details=[_success_table(found), _time_table(found)] if figures else [],
    )
    for k, compared in enumerate(found.comparisons):
        name = difference_name("picking", k)
        yield _comparison(compared, [pictures[name]] if name in pictures else [])


def _comparison(compared: PickComparison, pictures: list[Picture]) -> Section:
    a, b = compared.names
    title = f"Pick and place: {a} against {b}"
    found = compared.analysis
    if found is None:
        tables = (
            []
            if compared.success is None
            else [tests_table([], [("success", compared.success)])]
        )
        return Section(title, [compared.why], tables=tables)
    text = [
        f"Every difference is {worded(a)} minus {worded(b)}. The paper's sign test "
        f"leaves pairs with a failure out ({found.paper_left_out} of "
        f"{found.success.pairs} here), which favors the condition that fails more; "
        "the other tests keep them."
    ]
    if found.paper is None:
        text.append("Fewer than two pairs without a failure: no sign test.")
    if compared.equivalence is None:
        text.append(NO_MARGIN)
    others = [
        ("success", found.success),
        ("time", found.time),
        ("time, over participants", found.ranks),
        ("equivalence of time", compared.equivalence),
    ]
    return Section(
        title,
        text,
        pictures,
        folded=True,
        details=[
            tests_table([found.paper], others),
            *([effects_table(found.effects)] if found.effects else []),
        ],
    )


def _success_table(found: PickingSummary) -> Table:
    def cells(cell: ObjectResult) -> list[Cell]:
        if not cell.trials:
            return ["–", None, None, "–"]
        share = f"{100 * cell.succeeded / cell.trials:.0f}"
        if cell.subjects > 1:
            share += f" ({100 * cell.low:.0f} to {100 * cell.high:.0f})"
        return [
            _whole(f"{cell.succeeded} of {cell.trials}"),
            cell.dropped,
            cell.late,
            _whole(share),
        ]

    interval, words = ", 95 %", "its 95 % interval, which counts trials as independent"
    if _one(found):
        interval, words = "", NO_INTERVAL
    return _object_table(
        found,
        ["succeeded", "dropped", "out of time", f"success (%){interval}"],
        cells,
        f"Success by object: trials, how the others ended, and the share with {words}.",
    )


def _time_table(found: PickingSummary) -> Table:
    def cells(cell: ObjectResult) -> list[Cell]:
        spread = "" if math.isnan(cell.deviation) else f" ± {cell.deviation:.2f}"
        return [
            cell.succeeded,
            cell.median,
            "–" if math.isnan(cell.mean) else _whole(f"{cell.mean:.2f}{spread}"),
            cell.restricted,
        ]

    return _object_table(
        found,
        ["n succeeded", "median (s)", "mean ± SD (s)", "with failures (s)"],
        cells,
        "Time by object. Median, mean and SD are of successful trials alone, as in "
        "the paper; the last column of a condition counts failures at the limit.",
    )


def _object_table(
    found: PickingSummary,
    columns: Sequence[str],
    cells: Callable[[ObjectResult], list[Cell]],
    caption: str,
) -> Table:
    """One row for each object, with the columns of every condition side by side."""
    first, *others = columns
    header = ["object"]
    for condition in found.conditions:
        header += [f"{condition}: {first}", *others]
    rows: list[list[Cell]] = [
        [name, *(value for cell in by_condition for value in cells(cell))]
        for name, by_condition in _by_object(found)
    ]
    return Table(header, rows, caption)


def _by_object(found: PickingSummary) -> Iterator[tuple[str, list[ObjectResult]]]:
    """Name of each object as in the paper's table, and its cells by condition."""
    known = load_objects()
    for code in (*found.objects, ""):
        name = code or "all"
        if code in known:
            name = f"{code} {known[code].name}, {1000 * known[code].mass_kg:.0f} g"
        yield (
            _whole(name),
            [
                cell
                for condition in found.conditions
                for cell in found.cells
                if (cell.condition, cell.object) == (condition, code)
            ],
        )


def _whole(text: str) -> str:
    """Return text that is not broken over lines."""
    return text.replace(" ", "\u00a0")
