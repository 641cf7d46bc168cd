"""Swivel of the elbows about the line from shoulder to wrist."""

from __future__ import annotations

import math

import numpy as np

from ikns._kernels.body.paths import Paths, follow_path
from ikns._kernels.compiled import compiled
from ikns.arrays import Array


@compiled
def write_swivels(paths: Paths, angles: Array, swivels: Array) -> None:
    """Write the swivels (N, 2), rad, right and left; NaN for a straight arm.

    `paths` lead to the right and left shoulder, then the elbows, then the wrists.

    The downward direction is -Y less its part along the line; the outward one is its
    cross product with the line. Both have length hypot(lx, lz) / |line|, which cancels
    in the ratio.
    """
    R, p = np.empty((3, 3)), np.empty((6, 3))
    axes = np.empty((len(paths.joint), 6))
    for i in range(len(angles)):
        for e in range(6):
            follow_path(paths, e, angles[i], R, p[e], axes)
        for side in range(2):
            lx, ly = p[4 + side, 0] - p[side, 0], p[4 + side, 1] - p[side, 1]
            lz = p[4 + side, 2] - p[side, 2]
            ex, ey = p[2 + side, 0] - p[side, 0], p[2 + side, 1] - p[side, 1]
            ez = p[2 + side, 2] - p[side, 2]
            length = math.sqrt(lx * lx + ly * ly + lz * lz)
            along = (ex * lx + ey * ly + ez * lz) / (length * length)
            down = along * ly - ey
            outward = (ez * lx - ex * lz) / length
            if side == 1:
                outward = -outward
            if down == 0 and outward == 0:
                swivels[i, side] = np.nan
            else:
                swivels[i, side] = math.atan2(outward, down)
