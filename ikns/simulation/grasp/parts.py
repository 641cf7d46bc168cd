"""The object, and the gripper as its URDF describes it."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

from ikns.body.model_file import urdf_folder
from ikns.errors import InvalidInput

Three = tuple[float, float, float]


@dataclass(frozen=True)
class Solid:
    """An object as a homogeneous solid.

    Parameters
    ----------
    shape : {"box", "cylinder", "sphere"}
        A cylinder stands upright; a cup is a solid cylinder of the cup's mass.
    size : tuple of float
        m. Box: three edges, the last one vertical. Cylinder: diameter and height.
        Sphere: diameter.
    mass : float
        kg.

    >>> Solid("box", (0.05, 0.097, 0.082), 0.37).extent
    (0.097, 0.05, 0.082)
    """

    shape: Literal["box", "cylinder", "sphere"]
    size: tuple[float, ...]
    mass: float

    def __post_init__(self) -> None:
        """Check that shape, size and mass are possible."""
        numbers = {"box": 3, "cylinder": 2, "sphere": 1}
        if self.shape not in numbers:
            raise InvalidInput(
                f"expected a shape of {', '.join(numbers)}, found '{self.shape}'."
            )
        if len(self.size) != numbers[self.shape] or not all(
            0 < number < 10 for number in (*self.size, self.mass)
        ):
            raise InvalidInput(
                f"expected a mass in kg and {numbers[self.shape]} sizes in m above 0 "
                f"for a {self.shape}, found {self.mass:g} and {self.size}."
            )

    @property
    def extent(self) -> Three:
        """Depth along the finger, width between finger and palm, height, m.

        A box is gripped across the shorter of its horizontal edges.
        """
        if self.shape == "box":
            return max(self.size[:2]), min(self.size[:2]), self.size[2]
        return self.size[0], self.size[0], self.size[-1]


@dataclass(frozen=True)
class Module:
    """A link of the finger in its own frame, with the joint to the link before.

    The joint is in the frame of the link before and turns from 0 to `upper`, rad; its
    name is empty for the base. The inertia is about the center of mass; `box` and
    `box_at` are edges and middle of the collision box.
    """

    name: str
    mass: float
    center: Three
    inertia: Three
    box: Three
    box_at: Three
    joint: str = ""
    origin: Three = (0.0, 0.0, 0.0)
    axis: Three = (0.0, 0.0, 1.0)
    upper: float = 0.0
    effort: float = 0.0


@cache
def finger_parts() -> tuple[Module, ...]:
    """Read ``urdf/finger.urdf``: the base, then the modules to the tip.

    >>> parts = finger_parts()
    >>> len(parts), round(sum(part.mass for part in parts), 3)
    (7, 0.186)
    """
    robot = ET.parse(urdf_folder() / "finger.urdf").getroot()
    moved = {
        joint.find("child").attrib["link"]: joint  # type: ignore[union-attr]
        for joint in robot.iter("joint")
        if joint.attrib["type"] == "revolute"
    }
    return tuple(
        _module(link, moved.get(link.attrib["name"]))
        for link in robot.iter("link")
        if link.find("inertial") is not None
    )


@cache
def hand_size() -> Three:
    """Return length, breadth and thickness of the hand in the URDF, m.

    >>> hand_size()
    (0.0801, 0.08, 0.028)
    """
    robot = ET.parse(urdf_folder() / "upper_body.urdf").getroot()
    box = robot.find("link[@name='right_hand']/visual/geometry/box")
    assert box is not None
    breadth, length, thickness = _three(box.attrib["size"])
    return length, breadth, thickness


@cache
def constant(name: str) -> float:
    """Return a constant of the mechanics; ``contact.toml`` has unit and source.

    >>> constant("friction_hand")
    0.5
    """
    text = files("ikns.simulation.grasp").joinpath("contact.toml").read_text("utf-8")
    return float(tomllib.loads(text)[name]["value"])


def _module(link: ET.Element, joint: ET.Element | None) -> Module:
    def at(path: str, key: str, of: ET.Element = link) -> str:
        found = of.find(path)
        assert found is not None
        return found.attrib[key]

    inertia = link.find("inertial/inertia")
    assert inertia is not None
    about = {
        "name": link.attrib["name"],
        "mass": float(at("inertial/mass", "value")),
        "center": _three(at("inertial/origin", "xyz")),
        "inertia": tuple(float(inertia.attrib[k]) for k in ("ixx", "iyy", "izz")),
        "box": _three(at("collision/geometry/box", "size")),
        "box_at": _three(at("collision/origin", "xyz")),
    }
    if joint is not None:
        about |= {
            "joint": joint.attrib["name"],
            "origin": _three(at("origin", "xyz", joint)),
            "axis": _three(at("axis", "xyz", joint)),
            "upper": float(at("limit", "upper", joint)),
            "effort": float(at("limit", "effort", joint)),
        }
    return Module(**about)  # type: ignore[arg-type]


def _three(text: str) -> Three:
    x, y, z = (float(word) for word in text.split())
    return x, y, z
