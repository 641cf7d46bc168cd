"""What screens show of a visit, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ikns.experiments.conduct.experiment import Desk

__all__ = ["listed", "planned", "prompt", "step_facts"]

_PROMPTS = {
    "stopped": "Stopped",
    "finished": "That was all. Thank you!",
    "paused": "Pause",
    "rest": "Take a rest",
    "waiting": "Ready when you are",
}


def listed(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the panel lists of an attempt."""
    return {key: row[key] for key in ("number", "key", "outcome", "reason")}


def planned(desk: Desk) -> list[dict[str, Any]]:
    """Return all steps, and how those went that were done."""
    visit = desk.visit
    ended, tried = visit.ended, [attempt.key for attempt in visit.attempts]
    return [
        step_facts(desk, step)
        | {
            "key": step.key,
            "outcome": ended[step.key].outcome if step.key in ended else "",
            "tries": tried.count(step.key) if step.key else 0,
        }
        for step in visit.steps
    ]


def prompt(desk: Desk, state: str) -> str:
    """Return what the participant is told."""
    return desk.prompt(state) or _PROMPTS.get(state, "")


def step_facts(desk: Desk, step: Any) -> dict[str, Any]:
    """Return what screens say of a step."""
    facts = {} if step.kind == "rest" else desk.facts(step)
    return {"kind": step.kind, "condition": step.condition} | facts
