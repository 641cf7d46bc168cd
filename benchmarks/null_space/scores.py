"""Scores of a method on real reaches, and on wishes planted into them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ikns.nullspace.hinge_swivel import hand_direction
from ikns.nullspace.led_direction import led_direction
from null_space.methods import Method, Signal
from null_space.people import Arm, ArmTrial
from null_space.turned import held_hand, turned_hand

Array = np.ndarray
#: Planted wishes, rad, and what a held hand does meanwhile: drift of the wrist, m, and
#: tilt of the hand, rad, standard deviation an axis (`ikns.simulation.Unsteadiness`).
WISHES = {20: np.radians(20.0), 10: np.radians(10.0)}
DRIFT, TILT = 4e-3, np.radians(1.2)
#: A hand that turns as for a glass that is emptied, to either side, rad.
TURN = np.radians(29.0)


class Ends(NamedTuple):
    """Postures at R ends of reaches."""

    angles: Array  # (R, 18) rad
    led: Array  # (R, 3) the hand's direction as it was led there


@dataclass
class Scores:
    """Changes of c of one person's reaches, wishes and turned hands."""

    reaches: list[float] = field(default_factory=list)
    wishes: dict[int, list[float]] = field(
        default_factory=lambda: {wish: [] for wish in WISHES}
    )
    turns: list[float] = field(default_factory=list)


def splits(arm: Arm, kind: str) -> Iterator[tuple[list[ArmTrial], list[ArmTrial]]]:
    """Trials to judge, and trials to learn from.

    "same": one repeat of every task, from the others. "unseen": one task, from the
    others.
    """
    key = {"same": "repeat", "unseen": "task"}[kind]
    for value in sorted({getattr(trial, key) for trial in arm.trials}):
        judged = [t for t in arm.trials if getattr(t, key) == value]
        yield judged, [t for t in arm.trials if getattr(t, key) != value]


def reach_ends(arm: Arm, trials: list[ArmTrial]) -> tuple[Ends, Ends]:
    """Where reaches start and end, as far as the arm was seen."""
    ends: tuple[list[Array], list[Array]] = [], []
    for trial in trials:
        direction = hand_direction(arm.skeleton, trial.angles, arm.chain)
        led = led_direction(np.hstack([trial.wrist, direction]))[:, 3:]
        whole = np.hstack([trial.angles, led])
        for a, b in trial.reaches():
            seen = a + np.flatnonzero(trial.known[a : b + 1])
            if seen.size >= 10:
                for which, row in zip(ends, seen[[0, -1]], strict=True):
                    which.append(whole[row])
    first, last = (np.reshape(rows, (-1, 21)) for rows in ends)
    return Ends(first[:, :18], first[:, 18:]), Ends(last[:, :18], last[:, 18:])


def judge(
    scores: Scores, signal: Signal, arm: Arm, trials: list[ArmTrial], seed: int
) -> None:
    """Add what c does on an arm's trials."""
    first, (last, led) = reach_ends(arm, trials)
    if not len(last):
        return
    rng = np.random.default_rng(seed)
    before = signal(last, led)
    scores.reaches += np.abs(before - signal(*first)).tolist()
    for wish, angle in WISHES.items():
        n = (len(last), 3)
        moved = held_hand(
            arm.skeleton,
            arm.side,
            last,
            np.full(len(last), angle),
            drift=rng.normal(scale=DRIFT, size=n),
            tilt=rng.normal(scale=TILT, size=n),
        )
        scores.wishes[wish] += np.abs(signal(moved, led) - before).tolist()
    ends = [
        signal(turned_hand(arm.skeleton, arm.side, last, pronation=sign * TURN), led)
        for sign in (-1, 1)
    ]
    scores.turns += np.abs(ends[1] - ends[0]).tolist()


def of_people(
    arms: list[Arm], people: dict[str, Array], method: Method, kind: str
) -> dict[str, Scores]:
    """Scores by person, each with a population that leaves this person out."""
    found: dict[str, Scores] = {}
    for i, arm in enumerate(arms):
        scores = found.setdefault(arm.person, Scores())
        for judged, own in splits(arm, kind):
            judge(scores, method(arm, own, people[arm.person]), arm, judged, i)
    return found


def auc(reaches: Array, wishes: Array) -> float:
    """Chance that a wish moves c by more than a reach does."""
    more = (wishes[:, None] > reaches).mean()
    return float(more + 0.5 * (wishes[:, None] == reaches).mean())


def summary(found: dict[str, Scores]) -> dict[str, float | list[float]]:
    """Means over all reaches, with 95 % of a bootstrap over people."""
    rng = np.random.default_rng(0)
    rows = [np.array(s.reaches) for s in found.values() if s.reaches]
    rows = [row[np.isfinite(row)] for row in rows]
    drawn = [
        np.concatenate(
            [rows[k] for k in rng.integers(len(rows), size=len(rows))]
        ).mean()
        for _ in range(2000)
    ]
    reaches = np.concatenate(rows)

    def of(name: int) -> Array:
        wishes = np.concatenate([s.wishes[name] for s in found.values()])
        return wishes[np.isfinite(wishes)]

    turns = np.concatenate([s.turns for s in found.values()])
    return {
        "reaches": len(reaches),
        "change": float(reaches.mean()),
        "interval": np.percentile(drawn, [2.5, 97.5]).tolist(),
        "above_0.2": float((reaches > 0.2).mean()),
        "auc_20": auc(reaches, of(20)),
        "auc_10": auc(reaches, of(10)),
        "turned": float(np.nanmean(turns)),
        "people": [float(row.mean()) for row in rows],
    }
