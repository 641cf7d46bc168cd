"""The URDF of the body: its location, segment lengths and resizing, as text.

A segment's size is one factor on everything that belongs to its link: its child joints,
center of mass and shape. Joint axes and limits never change.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ikns.arrays import Array
from ikns.body.anthropometry import Segment
from ikns.errors import FileError, InvalidInput

#: Stature of the generic body: mean of the ANSUR II means of women and men, m.
GENERIC_STATURE = (1.6285 + 1.7562) / 2
#: Distance of the trunk's center of mass behind the sternal notch: midway between notch
#: and C7, where ISB has the thorax's long axis; m in the generic body.
_TRUNK_DEPTH = 0.060
#: Trunk length (sternal notch to hip) of the generic body, de Leva 1996, m.
_TRUNK_LENGTH = 0.5166

#: Segments that scale, each named like its link, with the joint that ends it (the
#: trunk has no such joint: its length is not a distance in the model).
SEGMENTS: dict[str, str | None] = {
    "thorax": None,
    **{
        f"{side}_{segment}": f"{side}_{end}"
        for side in ("right", "left")
        for segment, end in (
            ("clavicle", "shoulder_abduction"),
            ("upper_arm", "elbow_flexion"),
            ("forearm", "wrist_flexion"),
            ("hand", "knuckle_fixed"),
        )
    },
}

#: Lengths of a link, by element.
_LENGTHS = {
    "origin": ("xyz",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "box": ("size",),
}


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), center of mass (3,) m and principal inertias (3,) kg m^2 of a link.

    Both vectors are expressed in the link's frame, whose axes are the principal ones.
    """

    mass: float
    center: tuple[float, float, float]
    inertia: tuple[float, float, float]


def urdf_folder() -> Path:
    """Return the folder of the URDF files, in an installed and in a source tree."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "urdf", package.parent / "urdf"):
        if (folder / "upper_body.urdf").is_file():
            return folder
    raise FileError(
        f"upper_body.urdf should lie in {package / 'urdf'}; reinstall the package."
    )


def segment_lengths(urdf: str) -> dict[str, float]:
    """Joint-to-joint length of each segment, meters.

    >>> text = (urdf_folder() / "upper_body.urdf").read_text()
    >>> 0.25 < segment_lengths(text)["right_upper_arm"] < 0.30
    True
    """
    return {
        segment: float(np.linalg.norm(end))
        for segment, end in segment_ends(urdf).items()
    }


def segment_ends(urdf: str) -> dict[str, Array]:
    """Joint that ends each limb segment, in its link's frame, (3,) m."""
    origins = _joint_origins(urdf)
    return {name: origins[end] for name, end in SEGMENTS.items() if end in origins}


def relative_sizes(urdf: str, reference: str) -> dict[str, float]:
    """Size of each segment over the same segment of a reference URDF."""
    ours, theirs = _joint_origins(urdf), _joint_origins(reference)
    # The size of the trunk is the distance of its child joint.
    ends = {name: end or "right_clavicle_protraction" for name, end in SEGMENTS.items()}
    return {
        name: float(np.linalg.norm(ours[end]) / np.linalg.norm(theirs[end]))
        for name, end in ends.items()
    }


def link_inertials(urdf: str, parts: Mapping[str, Segment]) -> dict[str, Inertial]:
    """Inertial properties of each segment's link, by link name.

    The URDF gives the direction of each segment in its link. Parts are as from
    :func:`ikns.body.anthropometry.segments`: principal moments about the front-back
    axis, the long axis, and the axis across both, palms forward.
    """
    trunk = parts["trunk_head"]
    inertials = {
        "thorax": Inertial(
            trunk.mass_kg,
            (-_TRUNK_DEPTH * trunk.length_m / _TRUNK_LENGTH, -trunk.com_m, 0.0),
            trunk.inertia_kg_m2,
        )
    }
    for name, along in segment_ends(urdf).items():
        part = parts[name.split("_", 1)[1]]
        center = part.com_m * along / np.linalg.norm(along)
        front, long, across = part.inertia_kg_m2
        moments = {
            "clavicle": (front, across, long),  # long axis sideways
            "upper_arm": (front, long, across),
            # Thumbs forward in the zero pose: a quarter turn from palms forward.
            "forearm": (across, long, front),
            "hand": (across, long, front),
        }[part.name]
        x, y, z = (float(value) for value in center)
        inertials[name] = Inertial(part.mass_kg, (x, y, z), moments)
    return inertials


def resize_urdf(
    urdf: str,
    factors: Mapping[str, float],
    *,
    inertials: Mapping[str, Inertial] | None = None,
) -> str:
    """Return the URDF with segments resized by factors, by link name.

    A segment without a factor keeps its size. Lengths scale with the factor, mass with
    its cube and inertia with its fifth power (same shape, same density), unless
    `inertials` gives new ones by link name.
    """
    robot = ET.fromstring(
        urdf, ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    )
    links = {link.get("name"): link for link in robot.iter("link")}
    ends: dict[str | None, list[ET.Element | None]] = {}
    for joint in robot.iter("joint"):
        if (parent := joint.find("parent")) is not None:
            ends.setdefault(parent.get("link"), []).append(joint.find("origin"))
    given = {} if inertials is None else inertials
    for name in [*factors, *given]:
        if name not in links:
            raise InvalidInput(f"the URDF has no link '{name}' to resize.")
    for name, factor in factors.items():
        if not (np.isfinite(factor) and factor > 0):
            raise InvalidInput(f"size factor of {name} must be positive, not {factor}.")
        _resize_link(links[name], factor)
        for origin in ends.get(name, []):
            _scale(origin, "xyz", factor)
    for name, inertial in given.items():
        _set_inertial(links[name], inertial)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _resize_link(link: ET.Element, factor: float) -> None:
    for element in link.iter():
        for attribute in _LENGTHS.get(str(element.tag), ()):
            _scale(element, attribute, factor)
    _scale(link.find("inertial/mass"), "value", factor**3)
    for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        _scale(link.find("inertial/inertia"), name, factor**5)


def _set_inertial(link: ET.Element, inertial: Inertial) -> None:
    old = link.find("inertial")
    if old is not None:
        link.remove(old)
    element = ET.Element("inertial")
    ET.SubElement(element, "origin", xyz=_text(inertial.center))
    ET.SubElement(element, "mass", value=f"{inertial.mass:.9g}")
    xx, yy, zz = (f"{value:.9g}" for value in inertial.inertia)
    ET.SubElement(element, "inertia", ixx=xx, ixy="0", ixz="0", iyy=yy, iyz="0", izz=zz)
    link.insert(0, element)


@lru_cache(maxsize=4)
def _joint_origins(urdf: str) -> Mapping[str | None, Array]:
    """Place of each joint in its parent link, (3,) m, by joint name; read-only."""
    origins = {}
    for joint in ET.fromstring(urdf).iter("joint"):
        origin = joint.find("origin")
        text = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
        place = np.array([float(x) for x in text.split()])
        place.flags.writeable = False
        origins[joint.get("name")] = place
    return origins


def _scale(element: ET.Element | None, attribute: str, factor: float) -> None:
    if element is not None and (text := element.get(attribute)) is not None:
        element.set(attribute, _text(factor * float(x) for x in text.split()))


def _text(values: Iterable[float]) -> str:
    # Adding zero turns -0 into 0.
    return " ".join(f"{value + 0.0:.9g}" for value in values)
