"""How alike real people hold an arm when they come back, and what more would tell."""

from collections.abc import Iterator

import numpy as np
from natural_posture_people import moving as moving_of
from posture_habits_people import ends_of

from ikns.nullspace.posture_terms import quadratic_terms, ridge, wrist_of
from null_space.methods import RANGE
from null_space.people import Arm, ArmTrial

Array = np.ndarray
#: Places within this are one place, m.
NEAR = 0.03
#: Of a quadratic of all that one arm did.
RIDGE = 1e-3


def rests_of(arm: Arm) -> list[tuple[ArmTrial, Array, Array, Array]]:
    """Trial, wrists (2, 3), and swivels (2,) beyond a quadratic, of each reach."""
    places, swivel = moving_of(arm)
    fit = ridge(quadratic_terms(wrist_of(places)), swivel, RIDGE)
    found = []
    for trial in arm.trials:
        for ends in ends_of(trial):
            at = trial.wrist[ends]
            found.append((trial, at, trial.swivel[ends] - quadratic_terms(at) @ fit))
    return found


def pairs(items: list) -> Iterator[tuple]:
    """Return all pairs of items."""
    for k, first in enumerate(items):
        for second in items[k + 1 :]:
            yield first, second


def floors(arms: list[Arm]) -> dict[str, Array]:
    """Differences of reaches done again, and of rests at one place, of the range."""
    found: dict[str, list[float]] = {"again": [], "one task": [], "two tasks": []}
    for arm in arms:
        for (a, wa, sa), (b, wb, sb) in pairs(rests_of(arm)):
            if a is b:
                continue
            alike = a.task == b.task
            far = np.linalg.norm(wa - wb, axis=1)
            if alike and far.max() < NEAR:
                change = np.diff(sa) - np.diff(sb)
                found["again"].append(abs(change[0]) / np.sqrt(2) / RANGE)
            for i, j in np.ndindex(2, 2):
                if np.linalg.norm(wa[i] - wb[j]) < NEAR:
                    kind = "one task" if alike else "two tasks"
                    found[kind].append(abs(sa[i] - sb[j]) / RANGE)
    return {kind: np.array(values) for kind, values in found.items()}
