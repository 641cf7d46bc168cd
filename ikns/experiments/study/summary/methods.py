"""Paragraphs for the methods section of a paper, from the settings of the visits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ikns.experiments.study.summary.answers import people, worded
from ikns.experiments.study.summary.picking import PickingSummary
from ikns.experiments.study.summary.study import Group
from ikns.experiments.study.summary.tracking import TrackingSummary
from ikns.output.wording import number

#: Keys of a design that the paragraphs mention.
_MENTIONED = {
    "conditions",
    "profiles",
    "repeats",
    "seconds",
    "align",
    "training",
    "rest",
    "objects",
    "limit",
    "seed",
}


def methods(group: Group) -> list[str]:
    """Return the paragraphs for the people, or the simulated participants."""
    paragraphs = [_participants(group)]
    if group.tracking is not None:
        paragraphs += [_tracking(group.tracking), _tracking_tests(group.tracking)]
    if group.picking is not None:
        paragraphs += [_picking(group.picking), _picking_tests(group.picking)]
    return [*paragraphs, *_versions(group)]


def setting_text(settings: Mapping[str, Any]) -> str:
    """Write settings as ``name = value``, nested tables flattened.

    >>> setting_text({"latency": 0.1, "parameters": {"n_points": 6}})
    'latency = 0.1, n_points = 6'
    """
    parts = []
    for name, value in settings.items():
        if isinstance(value, Mapping):
            parts.append(setting_text(value))
        elif isinstance(value, list | tuple):
            parts.append(f"{name} = {' '.join(map(str, value))}")
        else:
            parts.append(f"{name} = {value}")
    return ", ".join(part for part in parts if part)


def _participants(group: Group) -> str:
    both = [e for e in (group.tracking, group.picking) if e is not None]
    counts = [
        f"{people(len(each.participants), simulated=group.simulated)} in "
        f"{'tracking' if isinstance(each, TrackingSummary) else 'pick and place'}"
        for each in both
    ]
    if not group.simulated:
        return f"Participants: {' and '.join(counts)}."
    redrawn = max(each.redrawn for each in both)
    again = (
        f" {redrawn} drawn bodies could not do the protocol and were replaced."
        if redrawn
        else ""
    )
    first = next((each.settings[0] for each in both if each.settings), {})
    settings = setting_text(first.get("parameters") or {})
    more = f" Parameters of the simulation: {settings}." if settings else ""
    return (
        f"No person took part: {' and '.join(counts)}, each a virtual body and a model "
        f"of a human operator whose parameters are from the literature.{again}{more}"
    )


def _tracking(found: TrackingSummary) -> str:
    design = _design(found.settings)
    seconds = design.get("seconds", _only(found.table["seconds"]))
    align = design.get("align", _only(found.table["align"]))
    parts = [
        "Tracking: a pointer crossed the screen at constant speed and was to follow a "
        "pseudo-random curve; its height was 100 c, c being the control signal clipped "
        "to 0 to 1."
    ]
    if found.trajectories:
        parts.append(f"Curves were of kind {', '.join(found.trajectories)}.")
    parts.append(f"Conditions: {', '.join(map(worded, found.conditions))}.")
    if seconds is not None:
        before = (
            "" if align is None else f"{number(float(align), 's')} to align and then "
        )
        parts.append(f"A trial gave {before}{number(float(seconds), 's')} to track.")
    parts += _block(design, "every curve", _training(found.settings))
    parts.append(_order(found.conditions, "curves"))
    return " ".join(part for part in parts if part) + _inputs(found.settings)


def _picking(found: PickingSummary) -> str:
    design = _design(found.settings)
    parts = [
        f"Pick and place: {len(found.objects)} objects ({', '.join(found.objects)}), "
        f"conditions {', '.join(map(worded, found.conditions))}."
    ]
    if found.limit == found.limit:
        parts.append(
            f"A trial ended with success, with the object dropped, or after "
            f"{number(found.limit, 's')}."
        )
    parts += _block(design, "every object", _training(found.settings))
    parts.append(_order(found.conditions, "objects"))
    return " ".join(part for part in parts if part) + _inputs(found.settings)


def _training(settings: list[dict[str, Any]]) -> str:
    """Describe the training of visits that did not train as people do."""
    found = {str(each["training"]) for each in settings if each.get("training")}
    return f" (training: {' or '.join(sorted(found))})" if found else ""


def _block(design: Mapping[str, Any], each: str, training: str) -> list[str]:
    parts = []
    if "repeats" in design:
        parts.append(f"In each condition {each} came {design['repeats']} times.")
        if design["repeats"] == 1:
            parts[-1] = f"In each condition {each} came once."
    if design.get("training"):
        parts.append(
            f"{design['training']} training trials came before each condition and do "
            f"not count{training}."
        )
    if design.get("rest"):
        parts.append(f"Rest between conditions: {number(float(design['rest']), 's')}.")
    if "seed" in design:
        parts.append(f"Seed of the schedule: {design['seed']}.")
    other = {k: v for k, v in design.items() if k not in _MENTIONED and v is not None}
    if other:
        parts.append(f"Also set: {setting_text(other)}.")
    return parts


def _order(conditions: list[str], things: str) -> str:
    if len(conditions) < 2:
        return ""
    return f"The order of conditions and {things} was balanced over participants."


def _tracking_tests(found: TrackingSummary) -> str:
    margin = (
        "no margin of equivalence was declared"
        if found.margin is None
        else "two one-sided t-tests against a margin of "
        f"{number(found.margin, 'of 100')} declared beforehand"
    )
    return (
        "Analysis of tracking: RMSE is the root mean square of pointer minus target "
        "over the samples from the curve's beginning to its end, of 100; the lag is "
        "that of the highest cross-correlation; overshoot is how far moves went past "
        "their end on average; smoothness is the spectral arc length of the pointer's "
        "speed. Repeats were averaged per participant. A paired t-test and Wilcoxon's "
        "test over participants' means, a linear mixed model (condition x trajectory "
        "and trial number fixed, participant random), effect sizes with 95 % "
        f"intervals, {margin}; the paper's own tests, which pool the curves of a "
        "participant as independent, are given for comparison. No correction was made "
        "for the number of tests."
    )


def _picking_tests(found: PickingSummary) -> str:
    margin = (
        "no margin of equivalence was declared"
        if found.margin is None
        else "two one-sided t-tests of time against a margin of "
        f"{number(found.margin, 's')} declared beforehand"
    )
    return (
        "Analysis of pick and place: success by an exact McNemar test and by flipping "
        "the signs of participants' differences; time to success with failures "
        "counted at the limit, by a paired t-test over participants and a log-rank "
        f"test stratified by pair; {margin}; the paper's sign test, which leaves "
        "pairs with a failure out, is given for comparison. No correction was made "
        "for the number of tests."
    )


def _versions(group: Group) -> list[str]:
    found: dict[str, str] = {}
    for each in (group.tracking, group.picking):
        for settings in [] if each is None else each.settings:
            versions = settings.get("versions") or {}
            found |= {name: str(version) for name, version in versions.items()}
    if not found:
        return []
    return [f"Software: {', '.join(f'{k} {v}' for k, v in sorted(found.items()))}."]


def _design(settings: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the design of the visits, without keys in which they differ."""
    designs = [dict(each.get("design") or {}) for each in settings]
    if not designs:
        return {}
    return {
        key: value
        for key, value in designs[0].items()
        if all(other.get(key) == value for other in designs)
    }


def _inputs(settings: list[dict[str, Any]]) -> str:
    found: dict[str, list[str]] = {}
    for each in settings:
        for condition, text in (each.get("input") or {}).items():
            found.setdefault(str(condition), [])
            if str(text) not in found[str(condition)]:
                found[str(condition)].append(str(text))
    if not found:
        return ""
    sources = "; ".join(f"{name}: {' or '.join(t)}" for name, t in found.items())
    return f" Input: {sources}."


def _only(values: Any) -> float | None:
    once = set(values.tolist())
    return float(once.pop()) if len(once) == 1 else None
