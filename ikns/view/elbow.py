"""An arm whose elbow one can drag in a page: c moves, the finger bends, the hand stays.

The page holds the subject's arm as its URDF has it, a posture at each PCA point, and
the map's directions Z and ends m, M there. ``elbow.js`` moves along the self-motion
(the hand's position and orientation held) and computes c from these.
"""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from importlib.resources import files
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, chain_joints, whole_arms
from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.finger.geometry import FULL_FLEXION
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import posture_at_point, visited_posture
from ikns.view.parts import Widget
from ikns.view.scene.finger import finger_joints, worn_pose
from ikns.view.scene.scene import camera_and_target


def elbow_widget(subject: Subject) -> Widget | None:
    """Return an arm to move; None for a chain that is not one whole arm.

    Of a map of several freedoms the first moves the finger.
    """
    sides = whole_arms(subject.chain)
    if len(sides) != 1:
        return None
    here = files("ikns.view")
    html, script = (
        here.joinpath(name).read_text(encoding="utf-8")
        for name in ("elbow.html", "elbow.js")
    )
    text = json.dumps(_data(subject, sides[0]), separators=(",", ":"), allow_nan=False)
    return Widget(html.replace("{data}", text.replace("<", "\\u003c")), script)


def _data(subject: Subject, side: str) -> dict[str, Any]:
    body, learned, chain = subject.skeleton, subject.null_space_map, subject.chain
    postures = [_posture(body, learned, chain, k) for k in range(len(learned.centers_))]
    camera, target = camera_and_target(body, learned, chain, np.array(postures))
    columns = [body.joint_names.index(joint) for joint in chain_joints(chain)]
    wide = np.argmax((learned.upper_ - learned.lower_)[:, 0])
    points = [
        {"q": q[columns].tolist()} | _readout(learned, k, _hand(body, q, side))
        for k, q in enumerate(postures)
    ]
    return {
        "links": _links(body.urdf, f"{side}_hand", chain_joints(chain)),
        "limits": [body.lower[columns].tolist(), body.upper[columns].tolist()],
        "hand": _hand_in_link(body, side),
        "points": points,
        "first": int(wide),
        "camera": camera.tolist(),
        "target": target.tolist(),
        "side": 1 if side == "right" else -1,
        "finger": {
            "worn": worn_pose(body, side).tolist(),
            "joints": [[*origin] for _, origin, _ in finger_joints()],
            "axes": [[*axis] for _, _, axis in finger_joints()],
            "full": FULL_FLEXION,
        },
    }


def _readout(learned: NullSpaceMap, point: int, hand: Array) -> dict[str, Any]:
    """Return Z, m and M where the hand is; the point's own where weights fail there."""
    z, (lower, upper) = learned.directions(hand)[0], learned.range(hand)
    if not np.isfinite(z).all():
        z = learned.directions_[point, 0]
        lower, upper = learned.lower_[point], learned.upper_[point]
    return {"z": z.tolist(), "lower": float(lower[0]), "upper": float(upper[0])}


def _posture(
    body: Skeleton, learned: NullSpaceMap, chain: ChainLike, point: int
) -> Array:
    start = visited_posture(body, learned, chain, point)
    return posture_at_point(body, learned, chain, point, start=start)


def _hand(body: Skeleton, q: Array, side: str) -> Array:
    place = body.hands_in_thorax(q)[0]
    return np.asarray(place[SIDES.index(side)])


def _hand_in_link(body: Skeleton, side: str) -> list[float]:
    """Place of the hand point in the frame of the hand's link, (3,) m."""
    q = body.neutral()
    position, rotation = body.link_in_thorax(q, f"{side}_hand")
    found: list[float] = (rotation.T @ (_hand(body, q, side) - position)).tolist()
    return found


def _links(urdf: str, last: str, moving: tuple[str, ...]) -> list[dict[str, Any]]:
    """Joints from the thorax to a link: pose in the parent, axis, place in the chain.

    Joints that are not of the chain stay at zero, as in a posture at a PCA point.
    """
    robot = ET.fromstring(urdf)
    joints = {
        child.attrib["link"]: joint
        for joint in robot.iter("joint")
        for child in joint.iter("child")
    }
    found = []
    while last in joints:
        joint = joints[last]
        origin, axis, parent = (joint.find(x) for x in ("origin", "axis", "parent"))
        assert parent is not None
        given = {} if origin is None else origin.attrib
        turn = Rotation.from_euler("xyz", _numbers(given.get("rpy", "0 0 0")))
        name = joint.attrib["name"]
        found.append(
            {
                "link": last,
                "at": _numbers(given.get("xyz", "0 0 0")),
                "turn": turn.as_matrix().tolist(),
                "axis": None if axis is None else _numbers(axis.attrib["xyz"]),
                "joint": moving.index(name) if name in moving else None,
            }
        )
        last = parent.attrib["link"]
    return found[::-1]


def _numbers(text: str) -> list[float]:
    return [float(x) for x in text.split()]
