"""Answers to the paper's two research questions, in sentences from the tests.

A difference that was not found is not taken for equality: equivalence needs a margin
declared before the data were seen, and a test of its own.
"""

from __future__ import annotations

from ikns.experiments.study.summary.picking import PickComparison, PickingSummary
from ikns.experiments.study.summary.tracking import (
    UNITS,
    TrackingComparison,
    TrackingSummary,
)
from ikns.output.wording import counted, interval_text, number, p_text
from ikns.statistics import Equivalence, PairedT, SuccessTest

#: Names of conditions in sentences; others keep their own.
_WORDS = {
    "ikns": "the null space (ikns)",
    "gamepad": "the gamepad",
    "ring": "the ring button",
    "mouse": "the mouse",
    "keyboard": "the keyboard",
}


def worded(condition: str) -> str:
    """Return the name of a condition for a sentence.

    >>> worded("ikns"), worded("foot pedal")
    ('the null space (ikns)', 'foot pedal')
    """
    return _WORDS.get(condition, condition)


def people(count: int, *, simulated: bool) -> str:
    """Return a number of participants in words, marked if they are simulated.

    >>> people(1, simulated=True), people(10, simulated=False)
    ('1 simulated participant', '10 participants')
    """
    kind = "simulated participant" if simulated else "participant"
    return counted(count, kind)


def tracking_answer(
    summary: TrackingSummary | None, *, simulated: bool
) -> list[tuple[str, list[str]]]:
    """Return the questions about tracking, each with the sentences of its answer."""
    if summary is None:
        question = "Does tracking with the null space differ from another device?"
        return [(question, ["Not tested: there is no visit of tracking."])]
    if not summary.comparisons:
        return [
            ("Does tracking with the null space differ?", [_only(summary.conditions)])
        ]
    return [
        (
            f"Does tracking with {worded(c.names[0])} differ from "
            f"{worded(c.names[1])}?",
            _tracking_sentences(summary, c, simulated),
        )
        for c in summary.comparisons
    ]


def picking_answer(
    summary: PickingSummary | None, *, simulated: bool
) -> list[tuple[str, list[str]]]:
    """Return the questions about picking, each with the sentences of its answer."""
    if summary is None:
        question = "Does pick and place with the null space differ?"
        return [(question, ["Not tested: there is no visit of pick and place."])]
    if not summary.comparisons:
        return [
            (
                "Does pick and place with the null space differ?",
                [_only(summary.conditions)],
            )
        ]
    return [
        (
            f"Does pick and place with {worded(c.names[0])} differ from "
            f"{worded(c.names[1])}, in success and in time?",
            _picking_sentences(c, simulated),
        )
        for c in summary.comparisons
    ]


def _only(conditions: list[str]) -> str:
    if not conditions:
        return "Not tested: nothing was attempted."
    return f"Not tested: one condition only, {conditions[0]}."


def _tracking_sentences(
    summary: TrackingSummary, compared: TrackingComparison, simulated: bool
) -> list[str]:
    if compared.analysis is None:
        return [compared.why]
    found = compared.analysis
    sentences = [
        _difference(
            "RMSE",
            found.subjects,
            found.equivalence,
            people(found.subjects.subjects, simulated=simulated),
        )
    ]
    means = {(c.condition, c.level): c.over.mean for c in summary.rmse}
    a, b = compared.names
    if len(summary.trajectories) > 1:
        parts = [f"{t} {means[a, t] - means[b, t]:+.2f}" for t in summary.trajectories]
        p = found.model.interaction_p
        depends = "depends" if p < 0.05 else "is not shown to depend"
        tested = f", and {depends} on it ({p_text(p)})" if p == p else ""
        sentences.append(
            f"By trajectory the difference of the means is {', '.join(parts)} "
            f"{UNITS['rmse']}{tested}."
        )
    return sentences


def _picking_sentences(compared: PickComparison, simulated: bool) -> list[str]:
    sentences = []
    if compared.success is not None:
        sentences.append(_success(compared.success, simulated))
    if compared.analysis is None:
        return [*sentences, compared.why]
    time = compared.analysis.time
    if time.over_subjects is None:
        sentences.append("Times do not vary, so they were not tested.")
    else:
        sentences.append(
            _difference(
                "the time to success (failures counted at the limit of "
                f"{number(time.limit, 's')})",
                time.over_subjects,
                compared.equivalence,
                people(time.subjects, simulated=simulated),
            )
        )
    return sentences


def _difference(
    quantity: str, test: PairedT, same: Equivalence | None, whose: str
) -> str:
    """Say whether means differ, are equivalent, both, or neither is shown."""
    a, b = (worded(name) for name in test.names)
    size = (
        f"mean difference {number(test.difference, test.unit)}, "
        f"{interval_text(test.low, test.high)}, {p_text(test.p)}, {whose}"
    )
    margin = "" if same is None else number(same.margin, same.unit)
    equal = same is not None and same.verdict.startswith("equivalent")
    if test.p < 0.05:
        side = "smaller" if test.difference < 0 else "larger"
        rest = (
            ""
            if same is None
            else f" The difference lies within the margin of {margin} declared "
            f"beforehand ({p_text(same.p)})."
            if equal
            else f" Equivalence within the margin of {margin} declared beforehand is "
            f"not shown ({p_text(same.p)})."
        )
        return f"Yes: {quantity} is {side} with {a} than with {b} ({size}).{rest}"
    if same is None:
        return (
            f"Open: a difference in {quantity} is not shown ({size}), which does not "
            "show that there is none; no margin was declared beforehand, so "
            "equivalence was not tested."
        )
    interval = (
        f"{interval_text(same.low, same.high, level=1 - 2 * same.alpha)} against "
        f"{number(-same.margin)} to {number(same.margin, same.unit)}, two one-sided "
        f"tests {p_text(same.p)}"
    )
    if equal:
        return (
            f"No, within the margin of {margin} declared beforehand: {quantity} with "
            f"{a} and with {b} is equivalent ({interval}); a difference is not shown "
            f"({size})."
        )
    return (
        f"Open: these data show neither a difference in {quantity} ({size}) nor "
        f"equivalence within the margin of {margin} declared beforehand ({interval})."
    )


def _success(test: SuccessTest, simulated: bool) -> str:
    """Give the counts of successes and both tests of them."""
    a, b = (worded(name) for name in test.names)
    counts = (
        f"{test.succeeded[0]} of {test.pairs} trials succeeded with {a}, "
        f"{test.succeeded[1]} of {test.pairs} with {b}"
    )
    over = (
        f"over {people(test.subjects, simulated=simulated)} {p_text(test.p_subjects)}"
    )
    pooled = f"exact McNemar, pairs counted as independent, {p_text(test.p)}"
    if test.p_subjects < 0.05:
        return f"Success differs: {counts} ({over}; {pooled})."
    if test.p < 0.05:
        return (
            f"Success differs if every pair counts as independent, and is not shown "
            f"to differ over participants: {counts} ({over}; {pooled})."
        )
    return (
        f"A difference in success is not shown: {counts} ({over}; {pooled}); that "
        "does not show that there is none."
    )
