"""PCA points, the volume between them, and trails, as commands."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.view.arrays import outward
from ikns.view.scene.commands import (
    ROOT,
    Command,
    line_mesh,
    object_command,
    pose_matrix,
    surface,
    text_command,
    transform_command,
)
from ikns.view.style import BLUE, VOLUME, point_color

_POINT_RADIUS = 0.011  # m
_NUMBER = 0.026  # height of a point's number, m
_NUMBER_AWAY = 0.026  # of a number from its point, m
_TRAIL_RADIUS = 0.0014  # m
_EDGE_RADIUS = 0.0008  # m
#: Distance of the places of a trail, m: a hand that is held adds none.
_TRAIL_STEP = 0.004


def point_commands(centers: Array) -> list[Command]:
    """Draw PCA points (P, 3) m, each ``/ikns/points/<number>`` with its number."""
    ball = {"type": "SphereGeometry", "radius": _POINT_RADIUS}
    segments = {"widthSegments": 24, "heightSegments": 18}
    outwards = outward(centers)
    commands = []
    for k, center in enumerate(centers):
        node = f"{ROOT}/points/{k + 1}"
        away = pose_matrix(np.eye(3), _NUMBER_AWAY * outwards[k])
        commands += [
            object_command(node, ball | segments, point_color(k)),
            transform_command(node, pose_matrix(np.eye(3), center)),
            text_command(f"{node}/number", str(k + 1), height=_NUMBER),
            transform_command(f"{node}/number", away),
        ]
    return commands


def volume_commands(centers: Array, facets: NDArray[np.integer[Any]]) -> list[Command]:
    """Draw the interpolation volume ``/ikns/volume``; nothing without facets (F, 3)."""
    if not len(facets):
        return []
    edges = np.sort(facets[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    ends = centers[np.unique(edges, axis=0)]
    lines = np.concatenate([ends, np.full_like(ends[:, :1], np.nan)], axis=1)
    return [
        object_command(
            f"{ROOT}/volume/faces",
            surface(centers, facets),
            VOLUME,
            opacity=0.07,
            shiny=False,
        ),
        object_command(
            f"{ROOT}/volume/edges",
            line_mesh(lines.reshape(-1, 3), radius=_EDGE_RADIUS),
            VOLUME,
            opacity=0.4,
            shiny=False,
        ),
    ]


def trail_commands(
    path: str,
    places: Array,
    *,
    color: Any = BLUE,
    radius: float = _TRAIL_RADIUS,
    on_top: bool = False,
) -> list[Command]:
    """Draw the path of a hand or an elbow, (T, 3) m; NaN breaks the line."""
    tube = line_mesh(_thinned(places, _TRAIL_STEP), radius=radius)
    return [object_command(path, tube, color, shiny=False, on_top=on_top)]


def _thinned(places: Array, step: float) -> Array:
    """Return places at least `step` apart, the last one, and one NaN per gap."""
    kept: list[Array] = []
    for k, place in enumerate(places):
        known = bool(np.isfinite(place).all())
        before = kept[-1] if kept else np.full(3, np.nan)
        if not known:
            if np.isfinite(before).all():
                kept.append(np.full(3, np.nan))
            continue
        ends = k + 1 == len(places) or not np.isfinite(places[k + 1]).all()
        if ends or not np.linalg.norm(place - before) < step:
            kept.append(place)
    return np.array(kept).reshape(-1, 3)
