"""Power by number of participants, and how many are needed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ikns.errors import InvalidInput
from ikns.statistics.power import Design, Power, Spread, simulated_power
from ikns.statistics.sample_size import SampleSize, sample_size

__all__ = ["SamplingPlan", "plan_participants"]

#: At most how many numbers of participants the curve has, and in which steps.
_PLACES = 14
_STEPS = [k * 10**power for power in range(7) for k in (1, 2, 5)]


@dataclass(frozen=True)
class SamplingPlan:
    """Power by number of participants.

    Parameters
    ----------
    curve : tuple of Power
        By number of participants.
    size : SampleSize
    declared : Power or None
        With the participants of the study.
    """

    curve: tuple[Power, ...]
    size: SampleSize
    declared: Power | None


def plan_participants(
    spread: Spread,
    *,
    participants: int | None = None,
    levels: int = 3,
    repeats: int = 3,
    difference: float = 0.0,
    margin: float | None = None,
    alpha: float = 0.05,
    target: float = 0.8,
    most: int = 500,
    simulations: int = 10_000,
    seed: int = 0,
) -> SamplingPlan:
    """Power of ever more participants, up to half more than are needed.

    Parameters
    ----------
    spread : Spread
    participants : int, optional
        Of the study.
    levels, repeats, difference, margin, alpha, target, most, simulations, seed
        As in :func:`ikns.statistics.sample_size`; a number of participants
        has the same seed there and here.

    Raises
    ------
    InvalidInput
        For an aim that no number of participants reaches.

    Examples
    --------
    >>> plan = plan_participants(Spread(1.0), margin=1.0, participants=8)
    >>> plan.declared.design.subjects, plan.size.subjects
    (8, 11)
    """
    if participants is not None and participants < 2:
        raise InvalidInput(f"expected at least 2 participants, found {participants}.")
    aim = {
        "difference": difference,
        "margin": margin,
        "alpha": alpha,
        "simulations": simulations,
    }
    size = sample_size(
        spread,
        levels=levels,
        repeats=repeats,
        target=target,
        most=most,
        seed=seed,
        **aim,  # type: ignore[arg-type]
    )
    known = {power.design.subjects: power for power in size.tried}
    needed = size.subjects or most
    top = max(math.ceil(1.5 * needed) if size.subjects else most, participants or 2, 4)
    step = next(step for step in _STEPS if top <= _PLACES * step)
    numbers = set(range(max(step, 2), top + 1, step)) | {needed}
    numbers |= {participants} if participants else set()
    for n in numbers - set(known):
        known[n] = simulated_power(
            Design(n, levels, repeats),
            spread,
            seed=seed + n,
            **aim,  # type: ignore[arg-type]
        )
    return SamplingPlan(
        tuple(known[n] for n in sorted(numbers)),
        size,
        known[participants] if participants else None,
    )
