"""The body, its markers and translucent arms as commands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.view.scene.commands import (
    ROOT,
    Command,
    object_command,
    pose_matrix,
    transform_command,
)
from ikns.view.scene.shapes import Shape, visual_shapes

#: Light, so that data are visible on it; the arms of the task are darker.
_BODY, _ARM, _MARKER = "#D9DCE2", "#9FA9B8", "#4A4F57"
_MARKER_RADIUS = 0.006  # m, slightly less than that of the usual 14 mm marker


def drawn_links(skeleton: Skeleton) -> list[str]:
    """Links that have a shape, in the order of the URDF."""
    return list(dict.fromkeys(shape.link for shape in visual_shapes(skeleton.urdf)))


def arm_links(skeleton: Skeleton, chain: ChainLike) -> list[str]:
    """Drawn links that a chain's joints move: upper arm, forearm and hand."""
    sides = chain_sides(chain)
    still = [f"{side}_clavicle" for side in sides]
    return [x for x in drawn_links(skeleton) if x.startswith(sides) and x not in still]


def link_poses(skeleton: Skeleton, q: Array, link: str) -> Array:
    """Pose of a link in the thorax frame at `q` (..., 18 or 25), (..., 4, 4)."""
    position, rotation = skeleton.link_in_thorax(q, link)
    return pose_matrix(rotation, position)


def body_commands(skeleton: Skeleton, q: Array, chain: ChainLike) -> list[Command]:
    """Draw the body at a posture; link ``x`` is the node ``/ikns/body/x``."""
    acting = set(arm_links(skeleton, chain))
    commands = _shapes(
        f"{ROOT}/body",
        visual_shapes(skeleton.urdf),
        {link: _ARM if link in acting else _BODY for link in drawn_links(skeleton)},
    )
    return commands + pose_commands(f"{ROOT}/body", skeleton, q, drawn_links(skeleton))


def pose_commands(
    path: str, skeleton: Skeleton, q: Array, links: Iterable[str]
) -> list[Command]:
    """Move the links ``<path>/<link>`` to a posture, (25,) or (18,)."""
    return [
        transform_command(f"{path}/{link}", link_poses(skeleton, q, link))
        for link in links
    ]


def marker_commands(skeleton: Skeleton) -> list[Command]:
    """Draw the model's markers, each ``/ikns/body/<link>/markers/<label>``."""
    ball = {"type": "SphereGeometry", "radius": _MARKER_RADIUS}
    segments = {"widthSegments": 16, "heightSegments": 12}
    commands = []
    for marker in skeleton.marker_set.markers:
        path = f"{ROOT}/body/{marker.link}/markers/{marker.label}"
        place = pose_matrix(np.eye(3), np.asarray(marker.position))
        commands += [
            object_command(path, ball | segments, _MARKER),
            transform_command(path, place),
        ]
    return commands


def ghost_commands(
    path: str,
    skeleton: Skeleton,
    postures: Array,
    links: Sequence[str],
    color: object,
    *,
    opacity: float,
    first_layer: int,
) -> list[Command]:
    """Draw translucent arms, ``<path>/<k>`` for the k-th of postures (N, 18)."""
    shapes = [s for s in visual_shapes(skeleton.urdf) if s.link in links]
    commands: list[Command] = []
    for k, q in enumerate(postures):
        node = f"{path}/{k}"
        commands += _shapes(
            node,
            shapes,
            dict.fromkeys(links, color),
            opacity=opacity,
            layer=first_layer + k,
        )
        commands += pose_commands(node, skeleton, q, links)
    return commands


def _shapes(
    path: str,
    shapes: Iterable[Shape],
    colors: dict[str, object],
    *,
    opacity: float = 1.0,
    layer: int = 0,
) -> list[Command]:
    """Draw shapes as ``<path>/<link>/shape<i>``, still to be posed link by link."""
    commands: list[Command] = []
    for i, shape in enumerate(shapes):
        node = f"{path}/{shape.link}/shape{i}"
        commands += [
            object_command(
                node, shape.geometry, colors[shape.link], opacity=opacity, layer=layer
            ),
            transform_command(node, shape.in_link),
        ]
    return commands
