"""The rigid motion that maps points to points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["rigid_transform"]


def rigid_transform(
    source: NDArray[np.float64], target: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation and translation that best map points to points (Kabsch 1976).

    Parameters
    ----------
    source, target : (N, 3) array
        Matching points, N >= 3.

    Returns
    -------
    rotation : (3, 3) array
    shift : (3,) array
        ``target ~ source @ rotation.T + shift``.
    """
    a, b = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((target - b).T @ (source - a))
    flip = np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)])
    rotation = u @ flip @ vt
    return rotation, b - rotation @ a
