"""MeshCat's drawing commands as plain data, independent of what draws them.

MeshCat (https://github.com/meshcat-dev/meshcat) keeps a tree of named nodes and takes
commands as dicts. Ours hold NumPy arrays where there are many numbers; the same list
feeds a static page, a live view and a plain drawing.

Everything is in meters in the thorax frame (X forward, Y up, Z right), under the node
``/ikns`` whose transform sets it upright in MeshCat's world, where Z is up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from ikns.arrays import Array, Indices

Command = dict[str, Any]

ROOT = "/ikns"
#: Sides of a tube that is drawn for a line (WebGL lines are one pixel wide).
_SIDES = 6
#: One light from the viewer (front, right, above) and weak ones around it, in MeshCat's
#: world (forward, left, up).
_LIGHTS: tuple[tuple[str, str, Any], ...] = (
    ("AmbientLight", "intensity", 0.62),
    ("FillLight", "intensity", 0.15),
    ("PointLightNegativeX", "position", [2.0, -1.2, 2.4]),
    ("PointLightNegativeX", "intensity", 0.5),
    ("PointLightPositiveX", "position", [1.2, 2.4, 0.6]),
    ("PointLightPositiveX", "intensity", 0.16),
)
_NOT_EQUAL, _REPLACE = 517, 7681  # THREE.NotEqualStencilFunc, THREE.ReplaceStencilOp


def root_commands() -> list[Command]:
    """Empty the scene and set the thorax upright: no grid, no axes, soft light."""
    upright = np.eye(4)
    upright[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    return [
        property_command("/Grid", "visible", False),
        property_command("/Axes", "visible", False),
        property_command("/Background", "top_color", [1.0, 1.0, 1.0]),
        property_command("/Background", "bottom_color", [0.90, 0.91, 0.93]),
        *(
            property_command(f"/Lights/{light}/<object>", name, value)
            for light, name, value in _LIGHTS
        ),
        transform_command(ROOT, upright),
    ]


def transform_command(path: str, matrix: Array) -> Command:
    """Set the pose of a node in its parent, (4, 4)."""
    # Column by column, as three.js stores it.
    return {"type": "set_transform", "path": path, "matrix": matrix.T.ravel()}


def property_command(path: str, name: str, value: Any) -> Command:
    """Set a property of a node, such as ``visible``."""
    return {"type": "set_property", "path": path, "property": name, "value": value}


def object_command(
    path: str,
    geometry: dict[str, Any],
    color: Any,
    *,
    opacity: float = 1.0,
    layer: int = 0,
    shiny: bool = True,
    on_top: bool = False,
) -> Command:
    """Draw a geometry as three.js has it, without uuid.

    Below an opacity of 1 it is translucent. Translucent objects are drawn in the order
    of their layers. Those that share a number above 0 are drawn as one body: where two
    overlap, only one is visible. A shiny object is shaded and reflects light, one on
    top is visible through objects in front of it.
    """
    material: dict[str, Any] = {
        "uuid": f"{path}:material",
        "type": "MeshPhongMaterial" if shiny else "MeshBasicMaterial",
        "color": int(to_hex(color)[1:], 16),
        "side": 0 if opacity == 1 else 2,
        "transparent": opacity < 1,
        "opacity": opacity,
        "depthWrite": opacity == 1,
    }
    if shiny:
        material |= {"shininess": 10, "specular": 0x1A1A1A}
    if on_top:
        material |= {"depthTest": False, "transparent": True}
    if layer > 0:
        material |= {
            "side": 0,
            "stencilWrite": True,
            "stencilRef": layer,
            "stencilFunc": _NOT_EQUAL,
            "stencilZPass": _REPLACE,
        }
    return _object(
        path, "Mesh", {"renderOrder": 900 if on_top else layer}, [geometry], [material]
    )


def text_command(path: str, text: str, *, height: float) -> Command:
    """Draw black text that faces the viewer, on top of all; height in m."""
    # The picture of the text is a square of 256 pixels; a letter of a sans-serif font
    # is at most 0.6 of its size wide on average.
    size = min(150, int(256 / (0.6 * len(text))))
    texture = {
        "uuid": f"{path}:texture",
        "type": "_text",
        "text": text,
        "font_size": size,
        "font_face": "sans-serif",
    }
    material = {
        "uuid": f"{path}:material",
        "type": "SpriteMaterial",
        "map": texture["uuid"],
        "transparent": True,
        "depthTest": False,
    }
    side = height * 256 / size
    scale = np.diag([side, side, 1.0, 1.0]).ravel().tolist()
    entry = {"renderOrder": 1000, "matrix": scale}
    return _object(path, "Sprite", entry, [], [material], textures=[texture])


def _object(
    path: str,
    kind: str,
    entry: dict[str, Any],
    geometries: Sequence[dict[str, Any]],
    materials: Sequence[dict[str, Any]],
    **more: Any,
) -> Command:
    # Ids from the path, so that the same scene always gives the same text.
    named = [{"uuid": f"{path}:geometry", **geometry} for geometry in geometries]
    body = {"uuid": f"{path}:object", "type": kind, "material": materials[0]["uuid"]}
    if named:
        body["geometry"] = named[0]["uuid"]
    return {
        "type": "set_object",
        "path": path,
        "object": {
            "metadata": {"version": 4.5, "type": "Object"},
            "geometries": named,
            "materials": list(materials),
            **more,
            "object": body | entry,
        },
    }


def surface(vertices: Array, faces: NDArray[np.integer[Any]]) -> dict[str, Any]:
    """Geometry of triangles: vertices (V, 3) m, faces (F, 3)."""
    return {
        "type": "BufferGeometry",
        "data": {
            "attributes": {
                "position": {
                    "itemSize": 3,
                    "type": "Float32Array",
                    "array": np.asarray(vertices, dtype=np.float32).ravel(),
                    "normalized": False,
                }
            },
            "index": {
                "type": "Uint32Array",
                "array": np.asarray(faces, dtype=np.uint32).ravel(),
            },
        },
    }


def line_mesh(points: Array, *, radius: float) -> dict[str, Any]:
    """Geometry of a tube along points (N, 3) m; NaN breaks it."""
    known = np.all(np.isfinite(points), axis=1)
    turns = np.arange(_SIDES) * 2 * np.pi / _SIDES
    vertices: list[Array] = []
    faces: list[Indices] = []
    first = 0
    for run in np.split(np.arange(len(points)), np.flatnonzero(np.diff(known)) + 1):
        if len(run) < 2 or not known[run[0]]:
            continue
        path = points[run]
        along = np.gradient(path, axis=0)
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
        across, up = _frames(along)
        ring = (
            np.cos(turns)[:, None] * across[:, None]
            + np.sin(turns)[:, None] * up[:, None]
        )
        vertices.append((path[:, None] + radius * ring).reshape(-1, 3))
        k = np.arange(len(run) - 1)[:, None] * _SIDES
        a, b = np.arange(_SIDES), np.roll(np.arange(_SIDES), -1)
        quad = np.stack([k + a, k + a + _SIDES, k + b, k + b, k + a + _SIDES], -1)
        last = (k + b + _SIDES)[..., None]
        faces.append(
            np.concatenate([quad, last], axis=-1).reshape(-1, 3)[:, ::-1] + first
        )
        first += len(run) * _SIDES
    if not vertices:
        return surface(np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    return surface(np.concatenate(vertices), np.concatenate(faces))


def _frames(along: Array) -> tuple[Array, Array]:
    """Two directions across each tangent (N, 3) that do not spin along the line."""
    across = np.empty_like(along)
    previous = np.eye(3)[np.argmin(np.abs(along[0]))]
    for i, tangent in enumerate(along):
        side = previous - (previous @ tangent) * tangent
        if np.linalg.norm(side) < 1e-6:  # a hairpin: any direction across will do
            side = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
        across[i] = previous = side / np.linalg.norm(side)
    return across, np.cross(along, across)


def pose_matrix(rotation: Array, position: Array) -> Array:
    """Poses (..., 4, 4) from (..., 3, 3) and (..., 3)."""
    pose = np.zeros((*position.shape[:-1], 4, 4))
    pose[..., :3, :3], pose[..., :3, 3], pose[..., 3, 3] = rotation, position, 1.0
    return pose
