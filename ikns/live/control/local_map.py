"""Fast evaluation of a map's directions and ranges at successive hand positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap

Array = NDArray[np.float64]


class LocalMap:
    """Z^, m^ and M^ - m^ of a fitted map in one query instead of three.

    Parameters
    ----------
    null_space_map : NullSpaceMap

    Examples
    --------
    >>> corners = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> Z = np.outer(np.ones(8), np.eye(7)[1])
    >>> here = LocalMap(NullSpaceMap.from_arrays(corners, Z, corners[:, 0], np.ones(8)))
    >>> direction, lower, width = here(np.array([0.25, 0.5, 0.5]))
    >>> direction[0, 1].round(12), lower.round(12), width.round(12)
    (np.float64(1.0), array([0.25]), array([0.75]))
    """

    def __init__(self, null_space_map: NullSpaceMap) -> None:
        made = null_space_map
        points, d, n = made.directions_.shape
        self.shape = d, n
        width = made.upper_ - made.lower_
        self._values = np.hstack([made.directions_.reshape(points, -1), made.lower_])
        self._values = np.hstack([self._values, width])
        self._weigh = made.interpolator_.weights
        self._natural: NaturalNeighborInterpolator | None = None
        if isinstance(made.interpolator_, NaturalNeighborInterpolator):
            self._natural = NaturalNeighborInterpolator(
                made.centers_,
                self._values,
                outside=made.outside,
                method=made.interpolator_.method,
            )

    def __call__(self, x: Array) -> tuple[Array, Array, Array]:
        """Z^ (d, n), m^ (d,) and M^ - m^ (d,) at a hand position (3,), rad."""
        d, n = self.shape
        if self._natural is None:
            values = self._weigh(x) @ self._values
        else:
            values = self._natural(x)
        return values[: d * n].reshape(d, n), values[d * n : -d], values[-d:]
