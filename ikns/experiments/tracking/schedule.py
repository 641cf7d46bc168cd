"""The schedule of each subject: balanced, and known in advance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput


@dataclass(frozen=True)
class TrackingStep:
    """One step of a schedule.

    Parameters
    ----------
    kind : {"training", "trial", "rest"}
    condition : str
        What drives the pointer; empty at a rest.
    profile : str
        Character of the profile; empty at a rest.
    seed : int
        Of the profile. All subjects follow the same ones; training has others.
    repeat : int
        Repeat of the profile in this condition, from 0; in training the trial's number.
    seconds : float
        Of the profile or the rest.
    """

    kind: Literal["training", "trial", "rest"]
    condition: str = ""
    profile: str = ""
    seed: int = 0
    repeat: int = 0
    seconds: float = 25.0

    @property
    def key(self) -> str:
        """Name that is unique in a schedule; empty for rests."""
        return (
            ""
            if self.kind == "rest"
            else f"{self.condition}/{self.kind}/{self.profile}/{self.repeat}"
        )


def williams(n: int) -> NDArray[np.int64]:
    """Orders of n treatments, balanced for position and first-order carryover.

    Each treatment comes equally often at each position, and equally often right after
    each other one: a Williams design, E. J. Williams (1949), Aust. J. Sci. Res. A
    2:149.

    Parameters
    ----------
    n : int

    Returns
    -------
    (n, n) or, for odd n, (2 n, n) array

    Examples
    --------
    >>> williams(3).tolist()
    [[0, 2, 1], [1, 0, 2], [2, 1, 0], [1, 2, 0], [2, 0, 1], [0, 1, 2]]
    """
    if n < 1:
        raise InvalidInput(f"expected at least one treatment, found {n}.")
    first = [0]
    for k in range(1, n):
        first.append((k + 1) // 2 * (-1 if k % 2 else 1) % n)
    square = (np.array(first) + np.arange(n)[:, None]) % n
    return square if n % 2 == 0 else np.vstack([square, square[:, ::-1]])


def schedule(
    subject: int,
    *,
    conditions: Sequence[str] = ("ikns", "gamepad"),
    profiles: Sequence[str] = ("T1", "T2", "T3"),
    repeats: int = 3,
    seed: int = 0,
    seconds: float = 25.0,
    training: int = 10,
    rest: float = 120.0,
) -> list[TrackingStep]:
    """Return all steps of a subject: in each condition training, then all profiles.

    The order of the conditions changes with every subject, that of the profiles with
    every second one, so that both are balanced against each other. With two conditions
    and three repeats each subject gets each of the six orders of three profiles once.

    Parameters
    ----------
    subject : int
        Number, from 0.
    conditions, profiles : sequence of str
    repeats : int
        Blocks in each condition; each holds every profile once.
    seed : int
        Of the study's profiles.
    seconds : float
        Of a profile.
    training : int
        Trials to train on before each condition: 10 of 30 s are the paper's 5 min.
    rest : float
        Between conditions, s.

    Raises
    ------
    InvalidInput
        When a name is missing or duplicate, or a number is out of range.
    """
    for name, words in (("conditions", conditions), ("profiles", profiles)):
        if not words or len(set(words)) != len(words):
            raise InvalidInput(
                f"expected distinct {name}, found {', '.join(words) or 'none'}."
            )
    if repeats < 1 or training < 0 or subject < 0:
        raise InvalidInput(
            "expected a subject and training from 0 and repeats from 1, found "
            f"{subject}, {training} and {repeats}."
        )
    condition_orders, orders = williams(len(conditions)), williams(len(profiles))
    steps: list[TrackingStep] = []
    for place, number in enumerate(condition_orders[subject % len(condition_orders)]):
        condition = conditions[number]
        if place:
            steps.append(TrackingStep("rest", seconds=rest))
        steps.extend(
            TrackingStep(
                "training",
                condition,
                profiles[k % len(profiles)],
                seed=_training_seed(seed, k),
                repeat=k,
                seconds=seconds,
            )
            for k in range(training)
        )
        for block in range(repeats):
            row = subject // len(condition_orders) + block + repeats * place
            steps.extend(
                TrackingStep("trial", condition, profiles[i], seed, block, seconds)
                for i in orders[row % len(orders)]
            )
    return steps


def _training_seed(seed: int, k: int) -> int:
    """Return a seed for a training profile that no profile of the study has."""
    return int(np.random.SeedSequence([seed, k, 1]).generate_state(1)[0]) | 1 << 32
