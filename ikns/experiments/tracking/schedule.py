"""What each subject does, in which order: balanced, and known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput

__all__ = ["Step", "schedule", "williams"]


@dataclass(frozen=True)
class Step:
    """One thing to do.

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
        Which time the profile comes in this condition, from 0; in training its number.
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
        """Name that no other step of a schedule has; rests have none."""
        return (
            ""
            if self.kind == "rest"
            else f"{self.condition}/{self.kind}/{self.profile}/{self.repeat}"
        )


def williams(n: int) -> NDArray[np.int64]:
    """Orders of n treatments, balanced for place and for what came just before.

    Each treatment comes equally often at each place, and each after each other one
    equally often. E. J. Williams (1949), Aust. J. Sci. Res. A 2:149.

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
) -> list[Step]:
    """All steps of one subject: per condition training, then blocks of all profiles.

    The order of the conditions changes with every subject, that of the profiles with
    every second one, so that both are balanced against each other. With two conditions
    and three repeats everybody meets each of the six orders of three profiles once.

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
        When something is twice or missing.
    """
    for name, words in (("conditions", conditions), ("profiles", profiles)):
        if not words or len(set(words)) != len(words):
            raise InvalidInput(f"expected {name} that differ, found {list(words)}.")
    if repeats < 1 or training < 0 or subject < 0:
        raise InvalidInput(
            "expected a subject and training from 0 and repeats from 1, found "
            f"{subject}, {training} and {repeats}."
        )
    ways, orders = williams(len(conditions)), williams(len(profiles))
    steps: list[Step] = []
    for place, number in enumerate(ways[subject % len(ways)]):
        condition = conditions[number]
        if place:
            steps.append(Step("rest", seconds=rest))
        steps.extend(
            Step(
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
            row = subject // len(ways) + block + repeats * place
            steps.extend(
                Step("trial", condition, profiles[i], seed, block, seconds)
                for i in orders[row % len(orders)]
            )
    return steps


def _training_seed(seed: int, k: int) -> int:
    """Nobody trains on the profiles of the study."""
    return int(np.random.SeedSequence([seed, k, 1]).generate_state(1)[0]) | 1 << 32
