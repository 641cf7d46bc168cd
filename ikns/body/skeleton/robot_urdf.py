"""The URDF of any robot, prepared: one position a joint, mimic joints, another root."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import NamedTuple

from ikns.body.skeleton.urdf import parse_urdf
from ikns.errors import FileError, InvalidInput


class Mimic(NamedTuple):
    """A joint that follows another: ``position = factor * leader + offset``."""

    leader: str
    factor: float
    offset: float  # rad, or m


class RobotText(NamedTuple):
    """A URDF whose joints all have one position, and what it does not say."""

    urdf: str
    continuous: frozenset[str]  # joints without limits
    refused: frozenset[str]  # joints of more than one position
    mimics: dict[str, Mimic]  # each with a leader that follows no other


def prepared(urdf: str, *, base: str | None = None) -> RobotText:
    """Prepare a robot's URDF for Pinocchio.

    Pinocchio stores a continuous joint as cosine and sine; here it is an angle. A
    floating or planar joint becomes revolute, and is refused where it moves the frame.
    With `base`, only what hangs on that link is kept.

    Raises
    ------
    FileError
        When the text is not a URDF, or a joint mimics none that could lead it.
    InvalidInput
        When there is no such base.
    """
    robot = parse_urdf(urdf)
    if base is not None:
        _keep_from(robot, base)
    for link in robot.findall("link"):
        # Neither shapes nor masses change the kinematics.
        link[:] = []
    mimics = _mimics(robot)
    continuous, refused = set(), set()
    for joint in robot.findall("joint"):
        name, kind = joint.get("name", ""), joint.get("type")
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        if kind == "continuous":
            continuous.add(name)
        elif kind in ("floating", "planar"):
            refused.add(name)
        else:
            continue
        joint.set("type", "revolute")
        for old in joint.findall("limit"):
            joint.remove(old)
        ET.SubElement(joint, "limit", lower="-1", upper="1", effort="1", velocity="1")
    text = ET.tostring(robot, encoding="unicode")
    return RobotText(text, frozenset(continuous), frozenset(refused), mimics)


def _keep_from(robot: ET.Element, base: str) -> None:
    """Remove every link that does not hang on the base, and the joints to them."""
    links = [link.get("name", "") for link in robot.findall("link")]
    if base not in links:
        raise InvalidInput(
            f"the robot '{robot.get('name')}' has no link '{base}' to start from, but "
            f"{some(links)}."
        )
    children: dict[str, list[str]] = {}
    for joint in robot.findall("joint"):
        children.setdefault(_end(joint, "parent"), []).append(_end(joint, "child"))
    kept, more = set[str](), [base]
    while more:
        kept.add(link := more.pop())
        more += children.get(link, [])
    for each in list(robot):
        if (each.tag == "link" and each.get("name") not in kept) or (
            each.tag == "joint" and _end(each, "parent") not in kept
        ):
            robot.remove(each)


def _end(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _mimics(robot: ET.Element) -> dict[str, Mimic]:
    """Read the joints that follow others, each by the last leader of a row of them."""
    kinds = {j.get("name", ""): j.get("type") for j in robot.findall("joint")}
    given: dict[str, Mimic] = {}
    for joint in robot.findall("joint"):
        element = joint.find("mimic")
        if element is None:
            continue
        name, leader = joint.get("name", ""), element.get("joint", "")
        if kinds.get(leader) not in ("revolute", "continuous", "prismatic"):
            raise FileError(
                f"the URDF cannot be read: expected joint '{name}' to mimic a revolute "
                f"or prismatic joint, found '{leader}'."
            )
        given[name] = Mimic(
            leader,
            _number(element, "multiplier", 1.0, name),
            _number(element, "offset", 0.0, name),
        )
    found = {}
    for name, mimic in given.items():
        passed = {name}
        while mimic.leader in given:
            if mimic.leader in passed:
                raise FileError(
                    "the URDF cannot be read: expected joints that mimic others in a "
                    f"row, found a loop at the joint '{name}'."
                )
            passed.add(mimic.leader)
            above = given[mimic.leader]
            mimic = Mimic(
                above.leader,
                mimic.factor * above.factor,
                mimic.factor * above.offset + mimic.offset,
            )
        found[name] = mimic
    return found


def _number(mimic: ET.Element, key: str, default: float, joint: str) -> float:
    text = mimic.get(key)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileError(
            f"the URDF cannot be read: expected a number as the {key} of the mimic "
            f"joint '{joint}', found '{text}'."
        )
    return value


#: How many of a robot's links an error names.
_NAMED = 12


def some(names: list[str]) -> str:
    """Name the first of many."""
    return ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
