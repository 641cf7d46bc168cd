"""What the paper prints about its two experiments (arXiv 2012.03600), as printed.

Numbers are kept as text, as their last digit states how far they were rounded.
"""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class _Paper:
    subjects: int = 10
    youngest: int = 22
    oldest: int = 57
    age: tuple[Printed, Printed] = (Printed("35"), Printed("4.5"))
    trajectories: tuple[str, ...] = ("T1", "T2", "T3")
    # RMSE, mean and standard deviation, of a control signal of 0 to 100
    ikns: tuple[tuple[Printed, Printed], ...] = (
        (Printed("3.35"), Printed("0.83")),
        (Printed("5.43"), Printed("0.92")),
        (Printed("4.50"), Printed("1.54")),
    )
    gamepad: tuple[tuple[Printed, Printed], ...] = (
        (Printed("4.13"), Printed("0.76")),
        (Printed("4.98"), Printed("1.33")),
        (Printed("4.15"), Printed("1.10")),
    )
    t: Printed = Printed("0.27")
    degrees: int = 29
    p: Printed = Printed("0.979")
    absolute_error_below: Printed = Printed("4.5")
    # Pick and place: s, mean and standard deviation
    time_ikns: tuple[Printed, Printed] = (Printed("8.94"), Printed("3.26"))
    time_ring: tuple[Printed, Printed] = (Printed("6.34"), Printed("0.71"))
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
