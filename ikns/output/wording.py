"""Numbers in sentences."""

from __future__ import annotations

import math


def number(value: float, unit: str = "") -> str:
    """Three digits and the unit.

    >>> number(0.00667, "s")
    '0.00667 s'
    """
    if not math.isfinite(value):
        text = "unknown" if math.isnan(value) else "-" * (value < 0) + "infinity"
    else:
        text = f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    return f"{text} {unit}".strip()


def p_text(p: float) -> str:
    """Write a p-value, never rounded to nothing.

    >>> p_text(0.00001), p_text(0.0484)
    ('p < 0.001', 'p = 0.048')
    """
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def interval_text(low: float, high: float, *, level: float = 0.95) -> str:
    """Name of the confidence and both ends.

    >>> interval_text(-1, 2)
    '95 % interval -1 to 2'
    """
    return f"{100 * level:g} % interval {number(low)} to {number(high)}"


def counted(count: int, thing: str) -> str:
    """Singular or plural.

    >>> counted(1, "trial"), counted(2, "trial")
    ('1 trial', '2 trials')
    """
    return f"{count} {thing}" + "s" * (count != 1)
