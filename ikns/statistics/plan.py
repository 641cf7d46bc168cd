"""The fewest participants that reach a power, and power by number of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ikns.errors import InvalidInput
from ikns.output.wording import number
from ikns.statistics.equivalence import checked_margin
from ikns.statistics.power import Design, Power, Spread, simulated_power

#: At most how many numbers of participants the curve has, and in which steps.
_PLACES = 14
_STEPS = [k * 10**power for power in range(7) for k in (1, 2, 5)]


@dataclass(frozen=True)
class SampleSize:
    """Fewest subjects that reach a power, and what was tried.

    Parameters
    ----------
    subjects : int or None
        None when even the most allowed do not reach it.
    found, below : Power
        At that size, or at the most allowed; and with one subject less, None at 2.
    tried : tuple of Power
        By number of subjects.
    """

    subjects: int | None
    target: float
    found: Power
    below: Power | None
    tried: tuple[Power, ...]

    def sentence(self) -> str:
        """Return the result as a sentence, with its uncertainty."""
        aim = (
            f"equivalence within {number(self.found.margin)}"
            if self.found.margin is not None
            else "a difference"
        )
        given = f"(true difference {number(self.found.difference)})"
        power = f"{100 * self.found.power:.1f} +- {100 * self.found.error:.1f} %"
        if self.subjects is None:
            return (
                f"To show {aim} {given} with a power of {100 * self.target:g} % takes "
                f"more than {self.found.design.subjects} subjects, who reach {power}."
            )
        below = ""
        if self.below is not None:
            below = (
                f", and {self.below.design.subjects} reach "
                f"{100 * self.below.power:.1f} %"
            )
        return (
            f"To show {aim} {given} with a power of {100 * self.target:g} % takes "
            f"{self.subjects} subjects ({power}, Monte Carlo error{below})."
        )


def sample_size(
    spread: Spread,
    *,
    levels: int = 3,
    repeats: int = 3,
    difference: float = 0.0,
    margin: float | None = None,
    alpha: float = 0.05,
    target: float = 0.8,
    most: int = 500,
    simulations: int = 10_000,
    seed: int = 0,
) -> SampleSize:
    """Fewest subjects with which the aim is reached with the power asked for.

    Power grows with the number of subjects, so the number is doubled, then halved in
    between; each size has its own seed. Parameters as in :func:`simulated_power`.

    Raises
    ------
    InvalidInput
        For an aim that no number of subjects reaches: no difference to show, or a
        difference not inside the margin.
    """
    if not 0 < alpha < 0.5:
        raise InvalidInput(f"alpha must be between 0 and 0.5, found {alpha:g}.")
    if not alpha < target < 1:
        raise InvalidInput(
            f"expected a power between alpha {alpha:g} and 1, found {target:g}."
        )
    if most < 2:
        raise InvalidInput(f"expected at most 2 or more subjects, found {most}.")
    if margin is None and difference == 0:
        raise InvalidInput("expected a difference other than 0 to show, found 0.")
    if margin is not None and abs(difference) >= checked_margin(margin):
        raise InvalidInput(
            f"expected a true difference inside the margin {margin:g}, found "
            f"{difference:g}."
        )
    done: dict[int, Power] = {}

    def reaches(n: int) -> bool:
        if n not in done:
            done[n] = simulated_power(
                Design(n, levels, repeats),
                spread,
                difference=difference,
                margin=margin,
                alpha=alpha,
                simulations=simulations,
                seed=seed + n,
            )
        return done[n].power >= target

    low, high = 1, 2
    while not reaches(high) and high < most:
        low, high = high, min(2 * high, most)
    reached = done[high].power >= target
    while reached and high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return SampleSize(
        high if reached else None,
        target,
        done[high],
        done.get(high - 1) if reached else None,
        tuple(done[n] for n in sorted(done)),
    )


@dataclass(frozen=True)
class SamplingPlan:
    """Power by number of participants, and of the study's own number."""

    curve: tuple[Power, ...]
    size: SampleSize
    declared: Power | None


def plan_participants(
    spread: Spread,
    *,
    participants: int | None = None,
    levels: int = 3,
    repeats: int = 3,
    target: float = 0.8,
    most: int = 500,
    seed: int = 0,
    **aim: Any,
) -> SamplingPlan:
    """Power of ever more participants, up to half more than are needed.

    `aim` holds what :func:`sample_size`, where the parameters are described, passes to
    :func:`simulated_power`; a number of participants has the same seed there and here.

    >>> plan = plan_participants(Spread(1.0), margin=1.0, participants=8)
    >>> plan.declared.design.subjects, plan.size.subjects
    (8, 11)
    """
    if participants is not None and participants < 2:
        raise InvalidInput(f"expected at least 2 participants, found {participants}.")
    design = {"levels": levels, "repeats": repeats}
    size = sample_size(spread, target=target, most=most, seed=seed, **design, **aim)
    known = {power.design.subjects: power for power in size.tried}
    needed = size.subjects or most
    top = max(math.ceil(1.5 * needed) if size.subjects else most, participants or 2, 4)
    step = next(step for step in _STEPS if top <= _PLACES * step)
    numbers = set(range(max(step, 2), top + 1, step)) | {needed}
    numbers |= {participants} if participants else set()
    for n in numbers - set(known):
        known[n] = simulated_power(Design(n, **design), spread, seed=seed + n, **aim)
    return SamplingPlan(
        tuple(known[n] for n in sorted(numbers)),
        size,
        known[participants] if participants else None,
    )
