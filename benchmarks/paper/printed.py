"""What the paper prints about its two experiments (arXiv 2012.03600), as printed.

Numbers are kept as text, as their last digit states how far they were rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

from ikns.statistics.paper import POOLED_P, RMSE, SUBJECTS, TIME, TRAJECTORIES

__all__ = ["PAPER", "Printed"]


@dataclass(frozen=True)
class Printed:
    """A number on paper.

    Examples
    --------
    >>> p = Printed("0.979")
    >>> p.value, round(p.low, 4), round(p.high, 4)
    (0.979, 0.9785, 0.9795)
    """

    text: str

    @property
    def value(self) -> float:
        """As printed."""
        return float(self.text)

    @property
    def half(self) -> float:
        """Half a unit of the last digit: the largest rounding error."""
        return 0.5 * 10.0 ** -len(self.text.partition(".")[2])

    @property
    def low(self) -> float:
        """Least that rounds to it."""
        return self.value - self.half

    @property
    def high(self) -> float:
        """Most that rounds to it."""
        return self.value + self.half


def _pair(texts: tuple[str, str]) -> tuple[Printed, Printed]:
    """Mean and standard deviation."""
    return Printed(texts[0]), Printed(texts[1])


@dataclass(frozen=True)
class _Paper:
    subjects: int = SUBJECTS
    youngest: int = 22
    oldest: int = 57
    age: tuple[Printed, Printed] = (Printed("35"), Printed("4.5"))
    trajectories: tuple[str, ...] = TRAJECTORIES
    # RMSE, mean and standard deviation, of a control signal of 0 to 100
    ikns: tuple[tuple[Printed, Printed], ...] = tuple(map(_pair, RMSE["ikns"]))
    gamepad: tuple[tuple[Printed, Printed], ...] = tuple(map(_pair, RMSE["gamepad"]))
    t: Printed = Printed("0.27")
    degrees: int = 29
    p: Printed = Printed(POOLED_P)
    absolute_error_below: Printed = Printed("4.5")
    # Pick and place: s, mean and standard deviation
    time_ikns: tuple[Printed, Printed] = _pair(TIME["ikns"])
    time_ring: tuple[Printed, Printed] = _pair(TIME["ring"])
    time_median: Printed = Printed("1.44")
    time_p: Printed = Printed("0.01")
    time_limit: float = 20.0
    trials: int = 100
    failures: int = 12
    failures_apple: int = 4
    failures_other: int = 1  # at most, of any other object
    objects_in_text: int = 10
    objects_in_table: tuple[str, ...] = tuple("ABCDEFGHILM")


PAPER = _Paper()
