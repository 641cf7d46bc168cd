"""Experiment 1 as sections of a report."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ikns.experiments.study.summary import TrackingComparison, TrackingSummary
from ikns.experiments.study.summary.answers import people, worded
from ikns.experiments.study.summary.tracking import UNITS
from ikns.output.wording import p_text
from ikns.statistics.paper import RMSE, TRAJECTORIES
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
from ikns.view.study_report.learning_figure import learning_figure
from ikns.view.study_report.tracking_figures import (
    error_figure,
    rmse_figure,
    trace_figure,
)

_NAMES = {
    "mae": "mean absolute error",
    "lag": "lag",
    "overshoot": "overshoot",
    "smoothness": "smoothness (SPARC)",
    "unseen": "samples without c",
}

_DECIMALS = {"mae": 2, "lag": 3, "overshoot": 2, "smoothness": 2, "unseen": 1}


def tracking_figures(found: TrackingSummary) -> list[ReportFigure]:
    """All figures of experiment 1; none without a trial."""
    if not len(found.trials()["rmse"]):
        return []
    most = max(cell.over.subjects for cell in found.rmse)
    spread = f", {NO_INTERVAL}" if most == 1 else " with its 95 % interval"
    return [
        ReportFigure(
            "tracking_traces",
            trace_figure(found),
            "Target (gray) and pointer of the trial whose RMSE is the median of its "
            "cell, for each condition and trajectory; the paper shows such traces "
            "without saying how they were chosen.",
            "Grid of time series: target and pointer by condition and trajectory",
        ),
        ReportFigure(
            "tracking_error",
            error_figure(found),
            "Error over time: pointer minus target, a participant's repeats averaged "
            "first. Line: mean over participants; band: 10th to 90th percentile.",
            "Grid of time series of the error by condition and trajectory",
        ),
        ReportFigure(
            "tracking_rmse",
            rmse_figure(found),
            "RMSE: a dot is a participant's mean over repeats, a line joins the same "
            f"participant; black: mean over participants{spread}.",
            "Dots by condition, one panel per trajectory and one for all",
        ),
        ReportFigure(
            "tracking_learning",
            learning_figure(found),
            "RMSE over trials, mean and standard deviation over participants, with "
            "the trajectories' own difficulty taken out; training, left of the line, "
            "is on other curves and as it was measured. Lines: the fitted models.",
            "RMSE against the number of the trial, one panel per condition",
        ),
        *difference_figures(
            "tracking",
            found.comparisons,
            equivalence=lambda compared: compared.analysis.equivalence,
            quantity="RMSE",
            caption=". Equivalence is shown where the whole interval lies within "
            "the margin; where it does not, it is not shown, whatever the test of a "
            "difference says.",
            simulated=found.simulated,
        ),
    ]


def tracking_sections(
    found: TrackingSummary, figures: list[ReportFigure]
) -> Iterator[Section]:
    """Pictures, tables and tests; what is not tested says why."""
    pictures = {each.name: each.picture for each in figures}
    text = [
        f"Trials of {people(len(found.participants), simulated=found.simulated)}, "
        "everything computed from the recorded control signal. RMSE and error are of "
        "100, the height of the screen."
    ]
    if not figures:
        text.append(NO_TRIAL)
    if found.unmeasured:
        text.append(
            f"{len(found.unmeasured)} finished trials hold less than a second of "
            f"control signal and were not measured: {_some(found.unmeasured)}."
        )
    yield Section(
        "Tracking",
        text,
        [pictures["tracking_rmse"]] if figures else [],
        details=[
            pictures["tracking_traces"],
            pictures["tracking_error"],
            _rmse_table(found),
            _metric_table(found),
        ]
        if figures
        else [],
    )
    if "tracking_learning" in pictures:
        yield Section(
            "Tracking: learning",
            _learning(found),
            [pictures["tracking_learning"]],
            folded=True,
        )
    for k, compared in enumerate(found.comparisons):
        name = difference_name("tracking", k)
        yield _comparison(
            compared,
            [pictures[name]] if name in pictures else [],
            many=len(found.comparisons) > 1,
        )


def _comparison(
    compared: TrackingComparison, pictures: list[Picture], *, many: bool
) -> Section:
    a, b = compared.names
    title = f"Tracking: {a} against {b}"
    found = compared.analysis
    if found is None:
        return Section(title, [compared.why])
    others = [
        ("over participants", found.subjects),
        ("over participants", found.ranks),
        ("mixed model", found.model),
        ("analysis of variance", found.anova),
        ("equivalence", found.equivalence),
    ]
    text = [
        f"Every difference is {worded(a)} minus {worded(b)}. The paper's tests count "
        "each trajectory of a participant as independent; the other tests "
        "take the participant as the unit."
    ]
    if many:
        text.append("No correction was made for comparing several conditions.")
    if found.equivalence is None:
        text.append(NO_MARGIN)
    if found.anova is None:
        text.append(
            "The analysis of variance was left out: it needs two trajectories, all of "
            "them from every participant, and no more than 200 of those."
        )
    return Section(
        title,
        text,
        pictures,
        folded=True,
        details=[tests_table(found.paper, others), effects_table(found.effects)],
    )


def _rmse_table(found: TrackingSummary) -> Table:
    """Mean and spread by condition and trajectory, next to the paper's."""
    printed = {
        (condition, trajectory): value
        for condition, values in RMSE.items()
        for trajectory, value in zip(TRAJECTORIES, values, strict=True)
    }
    rows: list[list[Cell]] = []
    for cell in found.rmse:
        of = printed.get((cell.condition, cell.level))
        rows.append(
            [
                cell.condition,
                cell.level or "all",
                cell.over.mean,
                cell.over.deviation,
                cell.over.low,
                cell.over.high,
                cell.over.subjects,
                cell.trials,
                "" if of is None else f"{of[0]}\u00a0±\u00a0{of[1]}",
            ]
        )
    return Table(
        [
            "condition",
            "trajectory",
            "RMSE (of 100)",
            "SD",
            "95 % from",
            "to",
            "n participants",
            "n trials",
            "paper's people (n = 10)",
        ],
        rows,
        "RMSE, mean over participants' means, their standard deviation, and the "
        "interval of the mean. The paper's curves are unknown, so only the order of "
        "magnitude can be compared with its column.",
    )


def _metric_table(found: TrackingSummary) -> Table:
    rows: list[list[Cell]] = []
    names = list(found.metrics)
    for k, cell in enumerate(found.rmse):
        row: list[Cell] = [cell.condition, cell.level or "all", cell.over.subjects]
        for name in names:
            over = found.metrics[name][k].over
            row.append(_with_spread(over.mean, over.deviation, _DECIMALS[name]))
        rows.append(row)
    return Table(
        [
            "condition",
            "trajectory",
            "n",
            *(f"{_NAMES[name]} ({UNITS[name]})" for name in names),
        ],
        rows,
        "Mean ± standard deviation over n participants. The lag is how far the "
        "pointer is behind; smoothness is negative, and closer to 0 is smoother.",
    )


def _with_spread(mean: float, deviation: float, decimals: int) -> str:
    if math.isnan(mean):
        return "–"
    mean = round(mean, decimals) + 0.0  # no minus before a zero
    if math.isnan(deviation):
        return f"{mean:.{decimals}f}"
    return f"{mean:.{decimals}f}\u00a0±\u00a0{deviation:.{decimals}f}"


def _learning(found: TrackingSummary) -> list[str]:
    sentences = []
    named = set()
    for compared in found.comparisons:
        for name, curves in (
            {} if compared.analysis is None else compared.analysis.learning
        ).items():
            if name not in named:
                sentences.append(f"{name}: {curves.sentence()}")
                named.add(name)
        model = None if compared.analysis is None else compared.analysis.model
        if model is not None and model.trial is not None:
            sentences.append(
                f"Mixed model of {' and '.join(compared.names)}: RMSE changes by "
                f"{model.trial.estimate:+.3f} of 100 a trial "
                f"({p_text(model.trial.p)})."
            )
    return sentences or [
        "No learning curve was fitted: that needs at least 6 trials of every "
        "participant in a condition, and two participants with both conditions."
    ]


def _some(names: list[str], most: int = 5) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
