"""The fewest participants that reach a power, by simulation."""

from __future__ import annotations

from dataclasses import dataclass

from ikns.errors import InvalidInput
from ikns.statistics.equivalence import checked_margin
from ikns.statistics.power import Design, Power, Spread, simulated_power
from ikns.statistics.wording import number

__all__ = ["SampleSize", "sample_size"]


@dataclass(frozen=True)
class SampleSize:
    """Fewest subjects that reach a power, and what was tried.

    Parameters
    ----------
    subjects : int or None
        None when even the most allowed do not reach it.
    target : float
    found : Power
        At that size, or at the most allowed.
    below : Power or None
        One subject less; None at 2.
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
    if not done[high].power >= target:
        return _size(None, target, high, done)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return _size(high, target, high, done)


def _size(
    subjects: int | None, target: float, at: int, done: dict[int, Power]
) -> SampleSize:
    tried = tuple(done[n] for n in sorted(done))
    below = done.get(at - 1) if subjects is not None else None
    return SampleSize(subjects, target, done[at], below, tried)
