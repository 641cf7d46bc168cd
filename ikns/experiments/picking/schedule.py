"""Which object in which condition, in which order: drawn in advance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ikns.errors import InvalidInput
from ikns.experiments.picking.objects import OBJECT_IDS
from ikns.experiments.tracking.schedule import williams

#: Time limit for one object, s (the paper's).
LIMIT = 20.0


@dataclass(frozen=True)
class PickStep:
    """One step of a schedule.

    Parameters
    ----------
    kind : {"training", "trial", "rest"}
    condition : str
        What drives the finger; empty at a rest.
    object : str
        Code of the object; empty at a rest.
    repeat : int
        Repeat of the object in this condition, from 0; in training the trial's number.
    limit : float
        Time limit, or duration of the rest, s.
    """

    kind: Literal["training", "trial", "rest"]
    condition: str = ""
    object: str = ""
    repeat: int = 0
    limit: float = LIMIT

    @property
    def key(self) -> str:
        """Name that is unique in a schedule; empty for rests."""
        return (
            ""
            if self.kind == "rest"
            else f"{self.condition}/{self.kind}/{self.object}/{self.repeat}"
        )

    @property
    def seconds(self) -> float:
        """The limit, under the name that steps of all schedules have for it, s."""
        return self.limit


def pick_schedule(
    subject: int,
    *,
    conditions: Sequence[str] = ("ikns", "ring"),
    objects: Sequence[str] = OBJECT_IDS,
    repeats: int = 1,
    seed: int = 0,
    limit: float = LIMIT,
    training: int = 10,
    rest: float = 120.0,
) -> list[PickStep]:
    """Return all steps of a subject: in each condition training, then all objects.

    The order of the conditions changes with every subject. The order of the objects is
    drawn anew for every subject, condition and repeat.

    Parameters
    ----------
    subject : int
        Number, from 0.
    conditions : sequence of str
    objects : sequence of str
        Codes of :func:`ikns.experiments.picking.load_objects`.
    repeats : int
        Blocks in each condition; each holds every object once.
    seed : int
        Of the orders of objects.
    limit : float
        Time limit for an object, s.
    training : int
        Objects to train with before each condition: 10, each put back within 10 s, are
        at most the paper's 5 min.
    rest : float
        Between conditions, s.

    Raises
    ------
    InvalidInput
        When a name is missing, duplicate or unknown, or a number is out of range.

    Examples
    --------
    >>> steps = pick_schedule(0, training=0)
    >>> len(steps), steps[0].condition, steps[11].kind, steps[12].condition
    (23, 'ikns', 'rest', 'ring')
    """
    for name, words in (("conditions", conditions), ("objects", objects)):
        if isinstance(words, str) or not words or len(set(words)) != len(words):
            found = repr(words) if isinstance(words, str) else ", ".join(words)
            raise InvalidInput(f"expected distinct {name}, found {found or 'none'}.")
    unknown = [code for code in objects if code not in OBJECT_IDS]
    if unknown:
        raise InvalidInput(
            f"expected objects of {', '.join(OBJECT_IDS)}, found '{unknown[0]}'."
        )
    if repeats < 1 or training < 0 or subject < 0 or seed < 0:
        raise InvalidInput(
            "expected a subject, a seed and training from 0 and repeats from 1, found "
            f"{subject}, {seed}, {training} and {repeats}."
        )
    if not (0 < limit < np.inf and 0 <= rest < np.inf):
        raise InvalidInput(
            "limit must be above 0 s and rest 0 s or more, found "
            f"{limit:g} and {rest:g}."
        )
    condition_orders = williams(len(conditions))
    steps: list[PickStep] = []
    for place, number in enumerate(condition_orders[subject % len(condition_orders)]):
        # Streams of their own: more training or repeats do not change earlier orders.
        orders = np.random.default_rng([seed, subject, int(number), 0])
        trained = np.random.default_rng([seed, subject, int(number), 1])
        condition = conditions[number]
        if place:
            steps.append(PickStep("rest", limit=rest))
        order: list[str] = []
        for k in range(training):
            order = order or _shuffled(objects, trained)
            steps.append(PickStep("training", condition, order.pop(), k, limit))
        for block in range(repeats):
            steps.extend(
                PickStep("trial", condition, code, block, limit)
                for code in _shuffled(objects, orders)
            )
    return steps


def _shuffled(objects: Sequence[str], rng: np.random.Generator) -> list[str]:
    return [objects[i] for i in rng.permutation(len(objects))]
