"""Sections on attempts, variations, methods, and what is left out."""

from __future__ import annotations

from collections import Counter

from ikns.experiments.study.summary import (
    Group,
    PickingSummary,
    StudySummary,
    TrackingSummary,
    VariationMean,
)
from ikns.experiments.study.summary.answers import people
from ikns.experiments.study.summary.methods import methods, setting_text
from ikns.output.wording import counted
from ikns.view.cells import Cell
from ikns.view.parts import Section, Table

#: Visits left out that are listed at most.
_MOST = 50
_OUTCOMES = {
    "tracking": ("done", "aborted", "skipped", "again"),
    "pick and place": (
        "success",
        "dropped",
        "timeout",
        "aborted",
        "skipped",
        "again",
    ),
}


def done_section(group: Group) -> Section:
    """How many attempts were made, and how they ended."""
    text = [
        "Every attempt, training included. An aborted attempt is repeated, a skipped "
        "one is not; `again` marks trials that were repeated because an earlier "
        "result does not count."
    ]
    tables = []
    for name, each in (
        ("tracking", group.tracking),
        ("pick and place", group.picking),
    ):
        if each is None:
            continue
        tables.append(_attempts(name, each))
        if each.faults:
            more = f" and {len(each.faults) - 3} more" if len(each.faults) > 3 else ""
            text.append(
                f"In {name}, {counted(len(each.faults), 'simulated visit')} had no "
                f"attempts because their person could not take part: "
                f"{'; '.join(each.faults[:3])}{more}."
            )
        there = set(each.trials()["subject"].tolist())
        empty = [who for who in each.participants if who not in there]
        if empty:
            text.append(
                f"In {name}, {len(empty)} of "
                f"{people(len(each.participants), simulated=each.simulated)} finished "
                f"no trial: {', '.join(empty[:10])}"
                f"{' and others' if len(empty) > 10 else ''}."
            )
    return Section("What was done", text, tables=tables, folded=True)


def _attempts(name: str, found: TrackingSummary | PickingSummary) -> Table:
    outcomes = _OUTCOMES[name]
    sums: dict[tuple[str, str], Counter[str]] = {}
    for (condition, kind, outcome), n in found.attempts.items():
        sums.setdefault((condition, kind), Counter())[outcome] += n
    other = sorted({o for c in sums.values() for o in c} - set(outcomes))
    who = len({person for _, person in found.folders})
    rows: list[list[Cell]] = []
    for condition in found.conditions:
        for kind in ("training", "trial"):
            count = sums.get((condition, kind), Counter())
            rows.append(
                [
                    condition,
                    kind,
                    *(count[outcome] for outcome in (*outcomes, *other)),
                    count.total(),
                ]
            )
    return Table(
        ["condition", "kind", *outcomes, *other, "attempts"],
        rows,
        f"Attempts at {name}, {people(who, simulated=found.simulated)}, all of the "
        "variations.",
    )


def variation_section(group: Group) -> Section | None:
    """Variations against the study as planned; None where there are none."""
    tables = []
    if group.tracking is not None and group.tracking.varied:
        tables.append(_varied("RMSE", "of 100", group.tracking.varied))
    if group.picking is not None and group.picking.varied:
        tables.append(_varied("trials that succeeded", "%", group.picking.varied))
    if not tables:
        return None
    return Section(
        "Variations",
        [
            "The same participants with other settings. Differences are from the "
            "first row of each condition, paired over the participants that have "
            "both; no correction was made for the number of variations."
        ],
        tables=tables,
    )


def _varied(quantity: str, unit: str, found: list[VariationMean]) -> Table:
    rows: list[list[Cell]] = []
    for each in found:
        against = each.against
        row: list[Cell] = [
            each.condition,
            each.name or "as\u00a0planned",
            setting_text(each.settings).replace(" = ", "\u00a0=\u00a0"),
            each.over.mean,
            each.over.low,
            each.over.high,
            each.over.subjects,
        ]
        row += (
            [None, None, None, None]
            if against is None
            else [against.mean, against.low, against.high, against.subjects]
        )
        rows.append(row)
    return Table(
        [
            "condition",
            "variation",
            "settings",
            f"{quantity} ({unit})",
            "95 % from",
            "to",
            "n",
            f"difference ({unit})",
            "95 % from",
            "to",
            "n pairs",
        ],
        rows,
        f"{quantity} by variation: mean over n participants.",
    )


def methods_section(group: Group) -> Section:
    """Paragraphs to paste."""
    return Section(
        "Methods, from the configuration",
        folded=True,
        text=[
            "Written from what the visits and the study file hold; to be pasted and "
            "shortened.",
            *methods(group),
        ],
    )


def left_out_section(summary: StudySummary) -> Section | None:
    """Visits that could not be used, each with its reason; None without any."""
    if not summary.left_out:
        return None
    reasons = [each.reason for each in summary.left_out[:_MOST]]
    if len(summary.left_out) > _MOST:
        reasons.append(f"And {len(summary.left_out) - _MOST} more.")
    count = len(summary.left_out)
    return Section(
        "Left out",
        [
            f"{count} of {counted(summary.visits + count, 'visit')} could not be used; "
            "none of their data are in this report.",
            *reasons,
        ],
    )
