"""Numbers of many people: their middle, their worst, and who is better in pairs."""

from collections.abc import Sequence

import numpy as np

__all__ = ["Difference", "cell", "column", "difference", "middle"]

Array = np.ndarray
Rows = Sequence[dict[str, float]]
#: Lowest, middle and highest of the mean difference.
Difference = tuple[float, float, float]

_DRAWS = 4000


def column(rows: Rows, name: str) -> Array:
    """One number of every person, (S,)."""
    return np.array([row[name] for row in rows], dtype=float)


def middle(rows: Rows, name: str) -> float:
    """Median over people; NaN where nobody has the number."""
    values = column(rows, name)
    return float(np.nanmedian(values)) if np.isfinite(values).any() else np.nan


def cell(rows: Rows, name: str, *, least: bool = False, digits: int = 1) -> str:
    """Median over people and in brackets the worst: the largest, or the least."""
    values = column(rows, name)
    if not np.isfinite(values).any():
        return "-"
    worst = np.nanmin(values) if least else np.nanmax(values)
    return f"{np.nanmedian(values):.{digits}f} ({worst:.{digits}f})"


def difference(ours: Array, theirs: Array, seed: int = 0) -> Difference:
    """Mean difference over people, with its 95 % bootstrap interval over people."""
    apart = np.asarray(ours) - np.asarray(theirs)
    apart = apart[np.isfinite(apart)]
    if not len(apart):
        return (np.nan, np.nan, np.nan)
    drawn = np.random.default_rng(seed).integers(len(apart), size=(_DRAWS, len(apart)))
    low, high = np.quantile(apart[drawn].mean(axis=1), [0.025, 0.975])
    return float(low), float(apart.mean()), float(high)
