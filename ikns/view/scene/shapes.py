"""The visual shapes of a URDF, scaled as the body is."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.errors import FileError


@dataclass(frozen=True, eq=False)
class Shape:
    """One primitive on a link."""

    link: str
    geometry: dict[str, Any]  # as three.js describes it, m; a cylinder stands along Y
    in_link: Array  # (4, 4) its pose in the link's frame, m


def visual_shapes(urdf: str) -> list[Shape]:
    """Primitives of every ``<visual>`` of a URDF, in the order of the file.

    Meshes are left out: their files may be anywhere.

    >>> from ikns.body.skeleton import Skeleton
    >>> shapes = visual_shapes(Skeleton.load().urdf)
    >>> [shape.geometry["type"] for shape in shapes if shape.link == "right_upper_arm"]
    ['CylinderGeometry', 'SphereGeometry']
    """
    try:
        return [
            Shape(link.get("name", ""), geometry, pose)
            for link in ET.fromstring(urdf).iter("link")
            for visual in link.iter("visual")
            for geometry, pose in _primitive(visual)
        ]
    except (ET.ParseError, TypeError, ValueError) as error:
        raise FileError(f"the URDF's shapes cannot be read: {error}.") from None


def _primitive(visual: ET.Element) -> Iterator[tuple[dict[str, Any], Array]]:
    origin = visual.find("origin")
    pose = np.eye(4)
    if origin is not None:
        pose[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
        pose[:3, :3] = _from_rpy(*_numbers(origin.get("rpy", "0 0 0")))
    for shape in visual.findall("geometry/*"):
        if shape.tag == "box":
            x, y, z = _numbers(shape.get("size", ""))
            size = {"width": x, "height": y, "depth": z}
            yield {"type": "BoxGeometry", **size}, pose
        elif shape.tag == "sphere":
            segments = {"widthSegments": 32, "heightSegments": 24}
            radius = float(shape.get("radius", ""))
            yield {"type": "SphereGeometry", "radius": radius, **segments}, pose
        elif shape.tag == "cylinder":
            radius, length = (float(shape.get(k, "")) for k in ("radius", "length"))
            size = {"radiusTop": radius, "radiusBottom": radius, "height": length}
            # URDF cylinders stand along Z, those of three.js along Y.
            turned = pose.copy()
            turned[:3, :3] = pose[:3, :3] @ _from_rpy(np.pi / 2, 0.0, 0.0)
            yield {"type": "CylinderGeometry", **size, "radialSegments": 48}, turned


def _numbers(text: str) -> list[float]:
    values = [float(x) for x in text.split()]
    if len(values) != 3:
        raise ValueError(f"expected three numbers, found '{text}'")
    return values


def _from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation (3, 3) about fixed X, then Y, then Z, rad, as URDF has it."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
