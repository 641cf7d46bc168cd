"""How the axes of a person's elbow, forearm and wrist lie: tilts of the URDF's joints.

A joint tilts by a rotation vector in its own frame, before it moves. About the joint's
own axis that would only shift the zero of its angle, so two components are free.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.errors import InvalidInput

#: Joints that tilt, with the components (0 is X) that are free and their spread between
#: people, deg. Carrying angle, X of pronation: 5.9 deg (Paraskevas et al. 2004, see
#: urdf/README.md). The others are our estimates: published axes of elbow and wrist
#: scatter by 3 to 6 deg between people.
_SPREADS = {
    "elbow_flexion": {0: 4.0, 1: 4.0},
    "forearm_pronation": {0: 5.9, 2: 4.0},
    "wrist_flexion": {1: 5.0, 2: 5.0},
    "wrist_deviation": {0: 5.0, 1: 5.0},
}
#: All free tilts: joint, component, and spread in rad.
TILTS: tuple[tuple[str, int, float], ...] = tuple(
    (f"{side}_{joint}", component, float(np.radians(sd)))
    for side in SIDES
    for joint, spreads in _SPREADS.items()
    for component, sd in spreads.items()
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
