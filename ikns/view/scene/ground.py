"""Ground, axes and a scale: where is forward, and how large is it."""

from __future__ import annotations

from itertools import product

import numpy as np

from ikns.arrays import Array
from ikns.view.scene.commands import (
    ROOT,
    Command,
    line_mesh,
    object_command,
    pose_matrix,
    text_command,
    transform_command,
)
from ikns.view.scene.scene import Layer
from ikns.view.style import BLUE, GREEN, INK, RED

_SQUARE = 0.1  # m, side of a square of the grid
_SQUARES = 8  # along each side
#: The grid lies at least so far below the sternal notch, m: the drawn trunk of the
#: generic adult ends at 0.23 m.
_TRUNK = 0.28
_AXIS = 0.1  # m, length of an axis
_SCALE = 0.2  # m, length of the scale
#: Axes and scale from the middle, forward and to the arm's side, m: beside the body as
#: the camera sees it.
_AXES_AT, _SCALE_AT = (-0.1, 0.36), (0.12, -0.36)
_AXES = (("forward", RED), ("up", GREEN), ("right", BLUE))
_GRID = "#C3C9D2"
_THIN, _THICK = 0.0007, 0.0025  # m, radius of lines of the grid and of axes
_TEXT = 0.018  # m, height of letters

GROUND = Layer("grid of 10 cm, axes of the thorax", (f"{ROOT}/ground",), _GRID)


def ground_commands(places: Array, camera: Array, target: Array) -> list[Command]:
    """Draw a grid below places (N, 3) m, the thorax's axes, and a scale of 20 cm.

    The grid is no floor: where the floor was is not known. It lies below the trunk and
    all places. Camera and what it looks at are (3,) m; all is in the thorax frame.
    """
    lowest = np.nanmin(np.append(places[:, 1], -_TRUNK))
    height = np.floor((lowest - 0.02) / 0.05) * 0.05
    half = _SQUARE * _SQUARES / 2
    first = np.round((target - half) / _SQUARE) * _SQUARE
    first[1] = height
    side = 1.0 if camera[2] >= target[2] else -1.0
    axes, scale = (
        np.array([target[0] + forward, height, target[2] + side * across])
        for forward, across in (_AXES_AT, _SCALE_AT)
    )
    return [
        object_command(
            f"{ROOT}/ground/grid",
            line_mesh(_grid(first), radius=_THIN),
            _GRID,
            shiny=False,
        ),
        *_axes(axes),
        *_scale(scale),
    ]


def _grid(first: Array) -> Array:
    """Lines of the grid from its first corner, separated by NaN."""
    along = _SQUARE * np.arange(_SQUARES + 1)
    lines = []
    for offset, axis in product(along, (0, 2)):
        ends = np.tile(first, (2, 1))
        ends[:, 2 - axis] += offset
        ends[1, axis] += along[-1]
        lines += [*ends, np.full(3, np.nan)]
    return np.array(lines)


def _axes(origin: Array) -> list[Command]:
    commands = []
    for (name, color), way in zip(_AXES, np.eye(3), strict=True):
        node, end = f"{ROOT}/ground/{name}", origin + _AXIS * way
        line = line_mesh(np.array([origin, end]), radius=_THICK)
        at = pose_matrix(np.eye(3), end + 0.03 * way)
        commands += [
            object_command(node, line, color, shiny=False),
            text_command(f"{node}_text", name, height=_TEXT),
            transform_command(f"{node}_text", at),
        ]
    return commands


def _scale(middle: Array) -> list[Command]:
    """Draw a bar across, with its length."""
    ends = middle + np.outer([-0.5, 0.5], [0.0, 0.0, _SCALE])
    text = f"{100 * _SCALE:.0f} cm"
    return [
        object_command(
            f"{ROOT}/ground/scale", line_mesh(ends, radius=_THICK), INK, shiny=False
        ),
        text_command(f"{ROOT}/ground/scale_text", text, height=_TEXT),
        transform_command(
            f"{ROOT}/ground/scale_text",
            pose_matrix(np.eye(3), middle + [0.045, 0.0, 0.0]),
        ),
    ]
