"""How alike real people hold an arm when they come back, and what more would tell."""

from collections.abc import Iterator

import numpy as np
from natural_posture_people import moving as moving_of
from natural_posture_people import own_fit
from posture_habits_people import ends_of, hand

from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.nullspace.local_posture import fit_local, nearness
from ikns.nullspace.natural_posture import quadratic_terms
from null_space.methods import RANGE, Method, Signal, own_movement
from null_space.people import GATE, Arm, ArmTrial

Array = np.ndarray
#: Places within this are one place, m.
NEAR = 0.03
#: As the package's: penalties of the quadratic and of what is remembered of places.
PENALTY, LOCAL = 0.03, 0.01


def rests_of(arm: Arm) -> list[tuple[ArmTrial, Array, Array, Array]]:
    """Trial, wrists (2, 3), and swivels (2,) beyond a quadratic, of each reach."""
    wrist, swivel = moving_of(arm)
    fit = own_fit(wrist, swivel)
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


def knows_the_hand(arm: Arm, angles: Array) -> Array:
    """Terms (N, 13): the quadratic of the wrist, and the direction of the hand."""
    _, wrist, _, axis = hand(arm, angles)
    return np.hstack([quadratic_terms(wrist), axis])


def with_the_hand(arms: list[Arm], *, places: bool) -> Method:
    """Ridge toward the mean of other people, on wrist and hand."""

    def moved(arm: Arm) -> tuple[Array, Array]:
        rows = [trial.known & (trial.speed >= GATE) for trial in arm.trials]
        both = list(zip(arm.trials, rows, strict=True))
        angles = np.concatenate([trial.angles[row] for trial, row in both])
        return knows_the_hand(arm, angles), np.concatenate(
            [trial.swivel[row] for trial, row in both]
        )

    def fit(phi: Array, s: Array, toward: Array, ridge: float) -> Array:
        free = ridge * np.diag(np.r_[0.0, np.ones(phi.shape[1] - 1)])
        n = len(s)
        left = phi.T @ (s - phi @ toward) / n
        return toward + np.linalg.solve(phi.T @ phi / n + free, left)

    each = {id(arm): fit(*moved(arm), np.zeros(13), 1e-3) for arm in arms}

    def method(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
        others = [each[id(one)] for one in arms if one.person != arm.person]
        wrist, s, angles = own_movement(trials)
        phi = knows_the_hand(arm, angles)
        own = fit(phi, s, np.mean(others, axis=0), PENALTY)
        at, high = fit_local(wrist, s - phi @ own, LOCAL)
        high = high if places else 0 * high

        def signal(postures: Array) -> Array:
            w, swivel = arm_swivel(arm.skeleton, postures, arm.chain)
            natural = knows_the_hand(arm, postures) @ own + nearness(w, at) @ high
            return (swivel - natural) / RANGE

        return signal

    return method
