"""The text of a URDF, checked before Pinocchio's parser sees it.

That parser prints lines of its own to the terminal, and a text that is nested deeply
enough crashes it.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from xml.parsers import expat

from ikns.errors import FileError

#: A URDF is nested five levels deep at most; the rest is room for other tools' tags.
_DEEPEST = 50
_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


def parse_urdf(text: str) -> ET.Element:
    """Parse a URDF and check its tree of links and joints.

    Raises
    ------
    FileError
        When it is not the URDF of one robot; the message names the link or joint.

    Examples
    --------
    >>> parse_urdf("<robot name='r'><link name='a'/><link name='a'/></robot>")
    Traceback (most recent call last):
    ikns.errors.FileError: the URDF cannot be read: expected links with distinct \
names, found 'a' twice.
    """
    try:
        _check_depth(text)
        robot = ET.fromstring(text)
        _check_robot(robot)
    except (ET.ParseError, expat.ExpatError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"the URDF cannot be read: {error}.") from None
    return robot


def _check_depth(text: str) -> None:
    depth = 0

    def start(*_: object) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise ValueError(
                f"expected elements at most {_DEEPEST} deep, found more at line "
                f"{parser.CurrentLineNumber}"
            )

    def end(_: object) -> None:
        nonlocal depth
        depth -= 1

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(text, True)


def _check_robot(robot: ET.Element) -> None:
    if robot.tag != "robot":
        raise ValueError(f"expected a robot, found a '{robot.tag}'")
    if not robot.get("name"):
        raise ValueError("expected a robot with a name, found none")
    links = _names(robot, "link")
    if not links:
        raise ValueError("expected links, found none")
    _names(robot, "joint")
    parents: dict[str, str] = {}
    for joint in robot.findall("joint"):
        parent, child = _check_joint(joint, links)
        if child in parents:
            raise ValueError(f"expected one joint to the link '{child}', found two")
        parents[child] = parent
    roots = [name for name in links if name not in parents]
    if len(roots) != 1:
        found = ", ".join(f"'{name}'" for name in roots[:5]) or "none: a loop"
        raise ValueError(f"expected one link without a parent, found {found}")
    for name in links:
        seen = {name}
        while name in parents:
            name = parents[name]
            if name in seen:
                raise ValueError(f"expected a tree, found a loop at the link '{name}'")
            seen.add(name)
    for link in robot.findall("link"):
        where = f"link '{link.get('name')}'"
        for inertial in link.findall("inertial"):
            _check_origin(inertial, where)
            for part in (inertial.find("mass"), inertial.find("inertia")):
                for key, value in {} if part is None else part.items():
                    _numbers(value, 1, f"the {key} of the inertia of the {where}")


def _names(robot: ET.Element, kind: str) -> list[str]:
    names = [each.get("name", "") for each in robot.findall(kind)]
    for name, count in Counter(names).items():
        if not name:
            raise ValueError(f"expected {kind}s with a name, found one without")
        if count > 1:
            raise ValueError(
                f"expected {kind}s with distinct names, found '{name}' twice"
            )
    return names


def _check_joint(joint: ET.Element, links: list[str]) -> tuple[str, str]:
    """Check a joint; return its parent and its child."""
    where, kind = f"joint '{joint.get('name')}'", joint.get("type")
    if kind not in _TYPES:
        raise ValueError(
            f"expected the {where} to be of type {', '.join(_TYPES)}, found "
            f"{'none' if kind is None else repr(kind)}"
        )
    ends = []
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            raise ValueError(
                f"expected a link as the {end} of the {where}, found "
                f"{'none' if link is None else repr(link)}"
            )
        ends.append(str(link))
    _check_origin(joint, where)
    axis = joint.find("axis")
    if axis is not None and axis.get("xyz") is not None and kind not in _TYPES[3:5]:
        found = _numbers(str(axis.get("xyz")), 3, f"the axis of the {where}")
        if not any(found):
            raise ValueError(
                f"expected a direction as the axis of the {where}, found "
                f"'{axis.get('xyz')}'"
            )
    limit = joint.find("limit")
    if limit is None and kind in ("revolute", "prismatic"):
        raise ValueError(f"expected a limit of the {where}, found none")
    for key in ("lower", "upper", "effort", "velocity"):
        value = None if limit is None else limit.get(key)
        if value is not None:
            _numbers(value, 1, f"the {key} limit of the {where}", finite=False)
        elif limit is not None and key in ("effort", "velocity"):
            raise ValueError(f"expected the {key} limit of the {where}, found none")
    return ends[0], ends[1]


def _check_origin(element: ET.Element, where: str) -> None:
    origin = element.find("origin")
    for key in ("xyz", "rpy"):
        value = None if origin is None else origin.get(key)
        if value is not None:
            _numbers(value, 3, f"{key} of the origin of the {where}")


def _numbers(text: str, count: int, what: str, *, finite: bool = True) -> list[float]:
    try:
        found = [float(word) for word in text.split()]
    except ValueError:
        found = []
    good = len(found) == count and not any(math.isnan(x) for x in found)
    if not good or (finite and not all(math.isfinite(x) for x in found)):
        kind = "a number" if count == 1 else f"{count} numbers"
        raise ValueError(f"expected {kind} as {what}, found '{text:.40}'")
    return found
