"""The simulated finger of ``urdf/finger.urdf`` on the forearm, as commands.

Its base is at the wrist, on the side of the palm, and as high above it as the closed
finger reaches down; the straight finger runs along the hand. This place is an
assumption: where people wear the finger was not measured.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from ikns.arrays import Array
from ikns.body.model_file import segment_lengths, urdf_folder
from ikns.body.skeleton import Skeleton
from ikns.finger.geometry import WIDEST, joint_angles
from ikns.view.scene.commands import (
    ROOT,
    Command,
    object_command,
    pose_matrix,
    transform_command,
)
from ikns.view.scene.scene import Layer, Scene
from ikns.view.scene.shapes import visual_shapes

_COLOR, _TIP = "#40454C", "#D97340"
#: Where the palm faces in the forearm's frame. The wrist flexes about +X
#: (``urdf/README.md``), so the right hand, along -Y, goes to -Z; the left mirrors it.
_PALM = {"right": (0.0, 0.0, -1.0), "left": (0.0, 0.0, 1.0)}
#: Half the thickness of the hand of ``urdf/upper_body.urdf``, m.
_HALF_HAND = 0.014
#: Thickness of the post that is drawn between wrist and base, m.
_POST = 0.02
#: From one finger to the next on the same forearm, m: a base is 34 mm wide.
_BESIDE = 0.04


def finger_path(side: str, number: int | None = None) -> str:
    """Node of the base of a finger on a forearm; of several, each has its number."""
    own = "finger" if number is None else f"finger_{number}"
    return f"{ROOT}/body/{side}_forearm/{own}"


def with_fingers(scene: Scene, skeleton: Skeleton, sides: Mapping[int, str]) -> Scene:
    """Add open fingers to a scene with a body: on which side, by their numbers.

    Those on one forearm stand side by side.
    """
    numbers = list(sides)
    for number, side in sides.items():
        there = [n for n in numbers if sides[n] == side]
        across = _BESIDE * (there.index(number) - (len(there) - 1) / 2)
        own = None if len(numbers) == 1 else number
        scene = with_finger(scene, skeleton, side, number=own, across=across)
    return scene


def with_finger(
    scene: Scene,
    skeleton: Skeleton,
    side: str,
    *,
    number: int | None = None,
    across: float = 0.0,
) -> Scene:
    """Add an open finger on the forearm of a side to a scene with a body.

    Parameters
    ----------
    scene : Scene
    skeleton : Skeleton
    side : {"right", "left"}
    number : int, optional
        Of several fingers.
    across : float
        How far it is moved across the palm, m.
    """
    base = finger_path(side, number)
    paths = _paths(base)
    last = max(paths.values(), key=len)
    worn = worn_pose(skeleton, side)
    worn[:3, 3] += across * worn[:3, 2]
    commands = [transform_command(base, worn)]
    for i, shape in enumerate(visual_shapes(_urdf())):
        node = f"{paths[shape.link]}/shape{i}"
        color = _TIP if paths[shape.link] == last else _COLOR
        commands += [
            object_command(node, shape.geometry, color),
            transform_command(node, shape.in_link),
        ]
    # The mount is not part of the URDF; a post stands in, so that it does not float.
    post = {"type": "BoxGeometry", "width": _POST, "height": WIDEST, "depth": _POST}
    foot = pose_matrix(np.eye(3), np.array([-_POST, -WIDEST / 2, 0.0]))
    commands += [
        object_command(f"{base}/post", post, _COLOR, opacity=0.5),
        transform_command(f"{base}/post", foot),
        *flexion_commands(base, 0.0),
    ]
    name = "finger" if number is None else f"finger {number}"
    layer = Layer(f"{name} (simulated shape)", (base,), _TIP)
    return replace(
        scene,
        commands=scene.commands + commands,
        layers=[*scene.layers, layer],
        fingers=(*scene.fingers, base),
    )


def flexion_commands(base: str, flexion: float) -> list[Command]:
    """Bend the finger at node `base`, 0 (straight) to 1."""
    paths = _paths(base)
    return [
        transform_command(paths[name], pose_matrix(_turn(axis, angle), origin))
        for (name, origin, axis), angle in zip(
            finger_joints(), joint_angles(flexion), strict=True
        )
    ]


def worn_pose(skeleton: Skeleton, side: str) -> Array:
    """Return the pose of the finger's base in the forearm's frame, (4, 4) m."""
    length = segment_lengths(skeleton.urdf)[f"{side}_forearm"]
    # Along the hand, away from the palm, and the third across.
    along, away = np.array([0.0, -1.0, 0.0]), np.array(_PALM[side])
    rotation = np.column_stack([along, away, np.cross(along, away)])
    place = (_HALF_HAND + WIDEST) * away + length * along
    return pose_matrix(rotation, place)


def _urdf() -> str:
    return (urdf_folder() / "finger.urdf").read_text("utf-8")


@cache
def finger_joints() -> tuple[tuple[str, Array, Array], ...]:
    """Return child link, origin (3,) m and axis (3,) of every joint that bends."""
    return tuple(
        (
            _read(joint, "child", "link"),
            np.array(_read(joint, "origin", "xyz").split(), dtype=np.float64),
            np.array(_read(joint, "axis", "xyz").split(), dtype=np.float64),
        )
        for joint in ET.fromstring(_urdf()).iter("joint")
        if joint.get("type") == "revolute"
    )


def _read(joint: ET.Element, tag: str, key: str) -> str:
    found = joint.find(tag)
    assert found is not None
    return found.attrib[key]


def _paths(base: str) -> dict[str, str]:
    """Return the node of every link: each module is a child of the one before."""
    names = [name for name, _, _ in finger_joints()]
    modules = {name: "/".join([base, *names[: k + 1]]) for k, name in enumerate(names)}
    return {"finger_base": base} | modules


def _turn(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) about a unit axis: Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    )
