"""The median of what is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def finite_median(values: ArrayLike) -> float:
    """Median of the finite values; NaN without any.

    >>> finite_median([1.0, float("nan"), 3.0]), finite_median([])
    (2.0, nan)
    """
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    return float(np.median(finite)) if finite.size else float("nan")
