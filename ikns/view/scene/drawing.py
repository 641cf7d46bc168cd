"""A scene drawn without a browser: the same commands, by matplotlib.

Plainer than the page: triangles are sorted as wholes, and numbers hide nothing.
"""

from __future__ import annotations

import io
from collections import defaultdict
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
    Poly3DCollection,
)

from ikns.arrays import Array
from ikns.numerics.rigid import quaternion_matrix
from ikns.view.scene.commands import ROOT, Command
from ikns.view.scene.scene import FIELD_OF_VIEW, Scene
from ikns.view.style import GREY, INK, figure_style

#: Thorax frame (X forward, Y up, Z right) to matplotlib's axes, of which Z is up.
_TO_DRAWING = [2, 0, 1]
_DPI = 100
_AROUND = 20  # facets around a cylinder or a sphere


def visible_nodes(scene: Scene) -> list[tuple[str, Array, Command]]:
    """Return what a scene shows at its start: path, pose in the thorax frame, object.

    The pose is (4, 4); nodes that are hidden, by themselves or above, are left out.
    """
    local: dict[str, Array] = {}
    objects: dict[str, Command] = {}
    hidden: set[str] = set()
    for command in scene.commands:
        path = command.get("path", "")
        if command["type"] == "set_transform":
            local[path] = np.asarray(command["matrix"]).reshape(4, 4).T
        elif command["type"] == "set_object":
            objects[path] = command["object"]
        elif command["type"] == "set_property" and command["property"] == "visible":
            (hidden.discard if command["value"] else hidden.add)(path)
        elif command["type"] == "set_animation":
            local |= _at(command, scene.start)
    found = []
    for path, drawn in objects.items():
        if not path.startswith(f"{ROOT}/"):
            continue
        steps = path.removeprefix(f"{ROOT}/").split("/")
        above = [f"{ROOT}/" + "/".join(steps[: k + 1]) for k in range(len(steps))]
        if not hidden.isdisjoint(above):
            continue
        pose = np.eye(4)
        for node in above:
            pose = pose @ local.get(node, np.eye(4))
        found.append((path, pose, drawn))
    return found


def scene_drawing(scene: Scene, *, width: int, height: int) -> bytes:
    """Picture of a scene at its start as PNG, `width` times `height` pixels."""
    with figure_style():
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
        axes: Any = figure.add_axes((0, 0, 1, 1), projection="3d")
        draw_scene(axes, scene)
        word = " (simulated subject)" if scene.simulated else ""
        figure.text(0.015, 0.965, scene.title + word, fontweight="bold", size=11)
        figure.text(0.015, 0.935, scene.caption, color=GREY)
        shown = [layer for layer in scene.layers if layer.shown]
        for k, layer in enumerate(reversed(shown)):
            color = layer.color if layer.color.startswith("#") else INK
            figure.text(0.015, 0.02 + 0.03 * k, "\u25cf", color=color)
            figure.text(0.035, 0.02 + 0.03 * k, layer.name)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=_DPI, metadata={"Software": None})
    return stream.getvalue()


def draw_scene(axes: Any, scene: Scene) -> None:
    """Draw what a scene shows at its start into axes of three dimensions."""
    triangles, colors = [], []
    for _, pose, drawn in visible_nodes(scene):
        if drawn["object"]["type"] == "Sprite":
            place = pose[:3, 3][_TO_DRAWING]
            text = drawn["textures"][0]["text"]
            axes.text(*place, text, ha="center", va="center", zorder=10)
            continue
        corners = _triangles(drawn["geometries"][0])
        placed = corners @ pose[:3, :3].T + pose[:3, 3]
        material = drawn["materials"][0]
        triangles.append(placed[..., _TO_DRAWING])
        colors.append(_shaded(placed, material, scene.camera - scene.target))
    axes.add_collection3d(
        Poly3DCollection(
            np.concatenate(triangles),
            facecolors=np.concatenate(colors),
            linewidths=0,
            antialiaseds=False,
        )
    )
    _look(axes, scene)


def _look(axes: Any, scene: Scene) -> None:
    way = scene.camera - scene.target
    distance = float(np.linalg.norm(way))
    right, forward, up = way[_TO_DRAWING] / distance
    reach = distance * np.tan(np.radians(FIELD_OF_VIEW / 2))
    for name, middle in zip("xyz", scene.target[_TO_DRAWING], strict=True):
        getattr(axes, f"set_{name}lim")(middle - reach, middle + reach)
    axes.set_box_aspect((1, 1, 1), zoom=1.35)
    axes.set_proj_type("ortho")
    axes.view_init(
        elev=np.degrees(np.arcsin(up)), azim=np.degrees(np.arctan2(forward, right))
    )
    axes.set_axis_off()


def _shaded(triangles: Array, material: Command, towards: Array) -> Array:
    """Color (F, 4) of triangles (F, 3, 3): lit from the viewer and from above."""
    color = np.array(to_rgb(f"#{material['color']:06x}"))
    light = towards / np.linalg.norm(towards) + [0.0, 0.6, 0.0]
    light /= np.linalg.norm(light)
    sides = triangles[:, 1:] - triangles[:, :1]
    normal = np.cross(sides[:, 0], sides[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-15)
    bright = np.ones(len(triangles))
    if material["type"] == "MeshPhongMaterial":
        bright = 0.55 + 0.45 * np.abs(normal @ light)
    opacity = np.full((len(triangles), 1), material["opacity"])
    return np.concatenate([bright[:, None] * color, opacity], axis=1)


def _at(animation: Command, time: float) -> dict[str, Array]:
    """Pose of every animated node at its frame nearest to a time."""
    poses: dict[str, Array] = defaultdict(lambda: np.eye(4))
    for entry in animation["animations"]:
        for track in entry["clip"]["tracks"]:
            frame = int(np.argmin(np.abs(track["times"] - time)))
            values = track["values"].reshape(len(track["times"]), -1)[frame]
            if track["name"] == ".position":
                poses[entry["path"]][:3, 3] = values
            elif track["name"] == ".quaternion":
                poses[entry["path"]][:3, :3] = quaternion_matrix(values.astype(float))
            elif not values[0]:
                poses[entry["path"]][:3, :3] = 0.0  # not seen: of no size
    return dict(poses)


def _triangles(geometry: Command) -> Array:
    """Triangles (F, 3, 3) of a geometry, m."""
    kind = geometry["type"]
    if kind == "BufferGeometry":
        data = geometry["data"]
        vertices = data["attributes"]["position"]["array"].reshape(-1, 3)
        return np.asarray(vertices[data["index"]["array"].reshape(-1, 3)], dtype=float)
    if kind == "BoxGeometry":
        size = [geometry[side] for side in ("width", "height", "depth")]
        # Three pairs of opposite faces, each a grid of 1 by 1.
        faces = []
        for axis in range(3):
            for end in (-0.5, 0.5):
                corners = np.full((2, 2, 3), end)
                u, v = [k for k in range(3) if k != axis]
                corners[..., u] = [[-0.5, 0.5], [-0.5, 0.5]]
                corners[..., v] = [[-0.5, -0.5], [0.5, 0.5]]
                faces.append(_grid(corners * size))
        return np.concatenate(faces)
    angle = np.linspace(0, 2 * np.pi, _AROUND + 1)
    if kind == "SphereGeometry":
        rise = np.linspace(-np.pi / 2, np.pi / 2, _AROUND // 2 + 1)
        radius, height = np.cos(rise), np.sin(rise)
        return geometry["radius"] * _grid(_rings(radius, height, angle))
    # Closed: from the middle of one end to the middle of the other.
    half, wide = geometry["height"] / 2, geometry["radiusTop"]
    rings = _rings(np.array([0, wide, wide, 0]), half * np.array([-1, -1, 1, 1]), angle)
    return _grid(rings)


def _rings(radius: Array, height: Array, angle: Array) -> Array:
    """Points (rings, around, 3) about the Y axis."""
    return np.stack(
        [
            radius[:, None] * np.cos(angle),
            height[:, None] + 0 * angle,
            radius[:, None] * np.sin(angle),
        ],
        axis=-1,
    )


def _grid(points: Array) -> Array:
    """Triangles (F, 3, 3) of a grid of points (u, v, 3)."""
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[:-1, 1:], points[1:, 1:]
    return np.concatenate(
        [
            np.stack(corners, axis=-2).reshape(-1, 3, 3)
            for corners in ((a, b, c), (c, b, d))
        ]
    )
