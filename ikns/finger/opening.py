"""Fingers by address."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import parse_qsl

from ikns.errors import InvalidInput, naming
from ikns.finger.dynamixel import DynamixelFinger
from ikns.finger.group import FingerGroup
from ikns.finger.guard import Safety
from ikns.finger.lerobot import LeRobotFinger
from ikns.finger.lerobot_robot import make_robot
from ikns.finger.ros import RosFinger
from ikns.finger.ros2.address import OPTIONS as ROS_OPTIONS
from ikns.finger.ros2.address import ros_address
from ikns.finger.simulated import SimulatedFinger
from ikns.finger.state import Finger

_SIMULATED: dict[str, Callable[[str], Any]] = {"width": float, "effort": float}
_DYNAMIXEL: dict[str, Callable[[str], Any]] = {
    "id": int,
    "baud": int,
    "model": str,
    "open": int,
    "closed": int,
    "effort": float,
    "watchdog": float,
}
_ROS: dict[str, Callable[[str], Any]] = {
    "type": str,
    "open": float,
    "closed": float,
    "joint": str,
    "feedback": str,
    "rate": float,
    "router": str,
    "domain": str,
}
_KNOWN = "sim:, dynamixel:PORT, ros2:TOPIC or lerobot:TYPE"
#: What else an address has is the robot's own configuration.
_LEROBOT: dict[str, Callable[[str], Any]] = {
    "joint": str,
    "open": float,
    "closed": float,
}


def open_finger(address: str, *, safety: Safety | None = None) -> Finger:
    """Make a finger, not connected yet: use ``with`` or :meth:`Finger.connect`.

    Parameters
    ----------
    address : str
        ``sim:`` or ``sim:width=60`` (width of an object, mm; also ``effort``), or
        ``dynamixel:PORT?id=1&baud=57600&model=xl430`` (also ``open`` and ``closed``,
        ticks; ``effort``; ``watchdog``, s), or
        ``ros2:TOPIC?type=joint_trajectory&joint=NAME&open=0&closed=1.2`` for a joint of
        a robot under ROS 2 (``type=position`` for a plain number; also ``feedback``, a
        topic of joint states; ``rate``, Hz; ``router=HOST:PORT``; ``domain``), or a
        joint of a robot of lerobot,
        ``lerobot:TYPE?joint=gripper.pos&open=100&closed=0`` with the robot's own
        options such as ``port`` and ``id``. All take ``safe=limp``, but for ROS 2,
        ``safe=hold`` or ``safe=open``, which takes precedence over `safety`, and
        ``dof=1``, which only :func:`open_fingers` heeds.
    safety : Safety, optional

    Returns
    -------
    Finger

    Raises
    ------
    InvalidInput
        When the address is not one of these.
    FingerError
        When lerobot is needed and not installed.

    Examples
    --------
    >>> open_finger("sim:width=60").object_width
    0.06
    >>> open_finger("gpio:7")  # doctest: +NORMALIZE_WHITESPACE
    Traceback (most recent call last):
    ikns.errors.InvalidInput: unknown finger 'gpio:7', expected sim:, dynamixel:PORT,
    ros2:TOPIC or lerobot:TYPE.
    """
    return _opened(address, Safety() if safety is None else safety)[0]


def open_fingers(
    addresses: Sequence[str],
    *,
    n_dof: int | None = None,
    safety: Safety | None = None,
) -> FingerGroup:
    """Create one finger per degree of freedom of a map, not connected yet.

    Parameters
    ----------
    addresses : sequence of str
        As for :func:`open_finger`. ``dof`` selects the degree of freedom of the map
        that drives the finger; the first by default.
    n_dof : int, optional
        Degrees of freedom of the map, if known.
    safety : Safety, optional
        Of each finger.

    Returns
    -------
    FingerGroup

    Raises
    ------
    InvalidInput
        When an address is wrong, two fingers use the same degree of freedom or servo,
        the servos of a port have different rates or protocols, or the map lacks a
        degree of freedom.

    Examples
    --------
    >>> open_fingers(["sim:", "sim:dof=2"], n_dof=2).dofs
    (1, 2)
    >>> open_fingers(["sim:", "sim:"], n_dof=2)
    Traceback (most recent call last):
    ikns.errors.InvalidInput: 'sim:' and 'sim:' both ask for dof=1, expected one each.
    """
    safety = Safety() if safety is None else safety
    taken: dict[int, str] = {}
    fingers: list[Finger] = []
    for address in addresses:
        finger, dof = _opened(address, safety)
        if n_dof is not None and dof > n_dof:
            raise InvalidInput(
                f"'{address}' asks for dof={dof}, but the map has {n_dof} "
                f"degree{'s' * (n_dof > 1)} of freedom."
            )
        if dof in taken:
            raise InvalidInput(
                f"'{taken[dof]}' and '{address}' both ask for dof={dof}, expected one "
                "each."
            )
        taken[dof] = address
        fingers.append(finger)
    _check_ports(list(addresses), fingers)
    return FingerGroup(fingers, list(taken))


def _check_ports(addresses: list[str], fingers: list[Finger]) -> None:
    """Refuse two fingers on one device, and servos that cannot share a port."""
    devices: dict[Hashable, str] = {}
    ports: dict[str, tuple[str, DynamixelFinger]] = {}
    for address, finger in zip(addresses, fingers, strict=True):
        device, remedy = _device(finger)
        if device is not None and device in devices:
            raise InvalidInput(
                f"'{devices[device]}' and '{address}' are the same {remedy}."
            )
        devices[device] = address
        if isinstance(finger, DynamixelFinger):
            port = os.path.realpath(finger.port)
            other, first = ports.setdefault(port, (address, finger))
            if first.speech != finger.speech:
                raise InvalidInput(
                    f"'{other}' and '{address}' are on the same port, expected one "
                    "baud rate and protocol."
                )


def _device(finger: Finger) -> tuple[Hashable, str]:
    """Return what a finger moves, None if it is its own; and what would be right."""
    if isinstance(finger, DynamixelFinger):
        servo = os.path.realpath(finger.port), finger.id
        return servo, "servo, expected another port or id"
    if isinstance(finger, LeRobotFinger) and finger.port:
        robot = os.path.realpath(finger.port)
        return robot, "robot, of which only one joint can be a finger"
    if isinstance(finger, RosFinger):
        target = finger.target
        named = target.joint if target.command == "joint_trajectory" else ""
        return (target.address, named), "joint, expected another topic or joint"
    return None, ""


def _opened(address: str, safety: Safety) -> tuple[Finger, int]:
    """Make a finger; return it and the freedom that its address names."""
    scheme, colon, rest = address.partition(":")
    if scheme not in _MAKERS or not colon:
        raise InvalidInput(f"unknown finger '{address}', expected {_KNOWN}.")
    return _MAKERS[scheme](address, rest, safety)


def _simulated_finger(address: str, rest: str, safety: Safety) -> tuple[Finger, int]:
    values = _options(address, rest.removeprefix("?"), _SIMULATED)
    safety, dof = _common(address, values, safety)
    if "width" in values:
        values["object_width"] = values.pop("width") / 1000
    return SimulatedFinger(safety=safety, **values), dof


def _dynamixel_finger(address: str, rest: str, safety: Safety) -> tuple[Finger, int]:
    port, _, query = rest.partition("?")
    if not port:
        raise InvalidInput(
            f"'{address}' names no port, such as dynamixel:/dev/ttyUSB0."
        )
    values = _options(address, query, _DYNAMIXEL)
    safety, dof = _common(address, values, safety)
    for end in ("open", "closed"):
        if end in values:
            values[f"{end}_ticks"] = values.pop(end)
    return DynamixelFinger(port, safety=safety, **values), dof


def _ros_finger(address: str, rest: str, safety: Safety) -> tuple[Finger, int]:
    topic, _, query = rest.partition("?")
    values = _options(address, query, _ROS)
    missing = [name for name in ("type", "open", "closed") if name not in values]
    if missing:
        raise InvalidInput(
            f"'{address}' lacks {' and '.join(missing)}, expected something like "
            "ros2:/finger/joint_trajectory?type=joint_trajectory&joint=finger&open=0"
            "&closed=1.2."
        )
    safety, dof = _common(address, values, safety)
    where: dict[str, str] = {k: values.pop(k) for k in ROS_OPTIONS if k in values}
    with naming(f"'{address}'"):
        finger = RosFinger(
            ros_address(topic, where),
            command=values.pop("type"),
            open_position=values.pop("open"),
            closed_position=values.pop("closed"),
            safety=safety,
            **values,
        )
    return finger, dof


def _lerobot_finger(address: str, rest: str, safety: Safety) -> tuple[Finger, int]:
    kind, _, query = rest.partition("?")
    pairs = _pairs(address, query)
    ours = {*_LEROBOT, "safe", "dof"}
    values = _values(address, [pair for pair in pairs if pair[0] in ours], _LEROBOT)
    missing = [name for name in _LEROBOT if name not in values]
    if not kind or missing:
        raise InvalidInput(
            f"'{address}' lacks {', '.join(missing) or 'the type of the robot'}, as in "
            "lerobot:so101_follower?joint=gripper.pos&open=100&closed=0&port=PORT&id=ID."
        )
    safety, dof = _common(address, values, safety)
    robot = make_robot(kind, {name: text for name, text in pairs if name not in ours})
    return LeRobotFinger(robot, safety=safety, **values), dof


_MAKERS = {
    "sim": _simulated_finger,
    "dynamixel": _dynamixel_finger,
    "ros2": _ros_finger,
    "lerobot": _lerobot_finger,
}


def _common(address: str, values: dict[str, Any], safety: Safety) -> tuple[Safety, int]:
    """Take what every address may have out of its options: safe and dof."""
    dof = values.pop("dof", 1)
    if dof < 1:
        raise InvalidInput(f"'{address}' has dof={dof}, expected 1 or more.")
    with naming(f"'{address}'"):
        return replace(safety, safe_state=values.pop("safe", safety.safe_state)), dof


def _options(
    address: str, query: str, known: dict[str, Callable[[str], Any]]
) -> dict[str, Any]:
    return _values(address, _pairs(address, query), known)


def _pairs(address: str, query: str) -> list[tuple[str, str]]:
    try:
        return parse_qsl(query, strict_parsing=True) if query else []
    except ValueError:
        raise InvalidInput(
            f"'{address}' should end in options like name=value&name=value."
        ) from None


def _values(
    address: str,
    pairs: list[tuple[str, str]],
    known: dict[str, Callable[[str], Any]],
) -> dict[str, Any]:
    types: dict[str, Callable[[str], Any]] = {**known, "safe": str, "dof": int}
    values: dict[str, Any] = {}
    for name, text in pairs:
        if name not in types:
            raise InvalidInput(
                f"'{address}' has an unknown option '{name}', "
                f"expected {', '.join(types)}."
            )
        if name in values:
            raise InvalidInput(f"'{address}' gives {name} twice, expected it once.")
        try:
            values[name] = types[name](text)
        except ValueError:
            raise InvalidInput(
                f"'{address}' has {name}={text}, expected a number."
            ) from None
    return values
