"""What a comparison asks of a body: where its hand is and how joints move it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Kinematics"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kinematics:
    """Where a hand is, and how joints move it, at postures that nobody visited.

    Parameters
    ----------
    pose : callable
        From joint vectors (..., n) to positions (..., 3) m and orientations
        (..., 3, 3).
    jacobian : callable
        From joint vectors (..., n) to Jacobians (..., k, n) of the task.
    """

    pose: Callable[[Array], tuple[Array, Array]]
    jacobian: Callable[[Array], Array]
