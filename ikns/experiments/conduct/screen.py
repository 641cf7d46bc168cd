"""What pages show of a visit, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ikns.experiments.conduct.experiment import Experiment

#: The notice after an emergency stop.
EMERGENCY = {
    "title": "Run stopped",
    "reason": "Emergency stop.",
    "remedy": "End the run; the same command continues from here.",
}
_PROMPTS = {
    "stopped": "Stopped",
    "finished": "That was all. Thank you!",
    "paused": "Pause",
    "rest": "Take a rest",
    "waiting": "Ready when you are",
}


def attempt_facts(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the panel lists of an attempt."""
    facts = {key: row[key] for key in ("number", "key", "outcome", "reason")}
    return facts | {"step": step_words(row["key"])}


def step_words(key: str) -> str:
    """Return a step's key in words, its repeats counted from 1.

    >>> step_words("ikns/trial/T2/0")
    'ikns trial T2 1'
    """
    *names, repeat = key.split("/")
    return " ".join([*names, str(int(repeat) + 1)])


def plan_steps(experiment: Experiment) -> list[dict[str, Any]]:
    """Return all steps, with outcome and number of attempts of each."""
    visit = experiment.visit
    ended, tried = visit.ended, [attempt.key for attempt in visit.attempts]
    return [
        step_facts(experiment, step)
        | {
            "key": step.key,
            "outcome": ended[step.key].outcome if step.key in ended else "",
            "tries": tried.count(step.key) if step.key else 0,
        }
        for step in visit.steps
    ]


def progress_facts(
    experiment: Experiment, remaining: tuple[Any, ...]
) -> dict[str, Any]:
    """Return the current step, its place in the plan, and the count of trials."""
    steps, step = experiment.visit.steps, remaining[0] if remaining else None
    return {
        "step": None if step is None else step_facts(experiment, step),
        "step_index": next((i for i, s in enumerate(steps) if s is step), None),
        "trials": sum(s.kind != "rest" for s in steps),
        "trials_left": sum(s.kind != "rest" for s in remaining),
    }


def prompt(experiment: Experiment, state: str) -> str:
    """Return the instruction to the participant."""
    return experiment.prompt(state) or _PROMPTS.get(state, "")


def step_facts(experiment: Experiment, step: Any) -> dict[str, Any]:
    """Return what pages show of a step."""
    facts = {} if step.kind == "rest" else experiment.describe(step)
    return {"kind": step.kind, "condition": step.condition} | facts
