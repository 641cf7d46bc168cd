"""How the axes of a person's elbow, forearm and wrist lie: tilts of the URDF's joints.

A joint tilts by a rotation vector in its own frame, before it moves. About the joint's
own axis that only shifts the zero of its angle, and about the axis of the joint before
the zero of that one, which is a convention. What is left is the angle between the two:
one component a joint.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.errors import InvalidInput

#: Joints that tilt, with the free component (0 is X) and its spread between people,
#: deg. Carrying angle, X of pronation: 5.9 deg (Paraskevas et al. 2004, see
#: urdf/README.md). The others are our estimates.
_SPREADS = {
    "elbow_flexion": (0, 4.0),  # against the long axis of the upper arm
    "forearm_pronation": (0, 5.9),
    "wrist_flexion": (2, 5.0),  # against the axis of pronation
    "wrist_deviation": (1, 5.0),
}
#: All free tilts: joint, component, and spread in rad.
TILTS: tuple[tuple[str, int, float], ...] = tuple(
    (f"{side}_{joint}", component, float(np.radians(sd)))
    for side in SIDES
    for joint, (component, sd) in _SPREADS.items()
)


def tilt_urdf(urdf: str, tilts: Mapping[str, Array]) -> str:
    """Return the URDF with joints tilted by rotation vectors (3,) rad, by joint name.

    Examples
    --------
    >>> from ikns.body.model_file import urdf_folder
    >>> text = (urdf_folder() / "upper_body.urdf").read_text()
    >>> tilted = tilt_urdf(text, {"right_forearm_pronation": np.array([0.1, 0, 0])})
    >>> 'rpy="-0.126893 0 0"' in tilted
    True
    """
    from scipy.spatial.transform import Rotation

    robot = ET.fromstring(
        urdf, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    )
    joints = {joint.get("name"): joint for joint in robot.iter("joint")}
    for name, tilt in tilts.items():
        if name not in joints:
            raise InvalidInput(f"the URDF has no joint '{name}' to tilt.")
        origin = joints[name].find("origin")
        if origin is None:
            origin = ET.SubElement(joints[name], "origin", xyz="0 0 0")
        rpy = [float(x) for x in origin.get("rpy", "0 0 0").split()]
        turned = Rotation.from_euler("xyz", rpy) * Rotation.from_rotvec(tilt)
        values = np.round(turned.as_euler("xyz"), 12) + 0.0
        origin.set("rpy", " ".join(f"{value:.9g}" for value in values))
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"
