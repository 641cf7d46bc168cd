"""The joint of a robot under ROS 2: goals for its controller, feedback from it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from ikns.errors import StreamError
from ikns.finger.errors import FingerError
from ikns.finger.ros2.address import RosAddress
from ikns.finger.ros2.cdr import Message, decode
from ikns.finger.ros2.node import RosNode, RosPublisher, stamp

RosCommand = Literal["joint_trajectory", "position"]

_TYPES: dict[RosCommand, str] = {
    "joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
    "position": "std_msgs/msg/Float64MultiArray",
}
_FEEDBACK = "sensor_msgs/msg/JointState"
#: How long somebody may take to show that he listens, or sends the joint's place, s.
_WAIT = 2.0


class RosTarget(NamedTuple):
    """Which joint, and how it is told.

    Parameters
    ----------
    address : RosAddress
        Of the topic that the controller listens to.
    command : {"joint_trajectory", "position"}
    joint : str
        Its name; may be empty for positions without feedback.
    feedback : str
        Topic of its joint states; empty for none.
    open_position, closed_position : float
        Of the joint at flexion 0 and 1, rad or m.
    reach : float
        Time in which a trajectory's one point is to be reached, s.
    """

    address: RosAddress
    command: RosCommand
    joint: str
    feedback: str
    open_position: float
    closed_position: float
    reach: float

    def position(self, flexion: float) -> float:
        """Return the joint's position at a flexion."""
        return self.open_position + flexion * self.span

    @property
    def span(self) -> float:
        """Way from open to closed, signed."""
        return self.closed_position - self.open_position


class RosJoint:
    """A connection to a joint.

    Parameters
    ----------
    target : RosTarget
    on_measured : callable
        Called with time and flexion of each feedback, from a thread of zenoh.

    Raises
    ------
    FingerError
        When no router answers.
    """

    def __init__(
        self, target: RosTarget, on_measured: Callable[[float, float], None]
    ) -> None:
        self._target, self._on_measured = target, on_measured
        self._name = f"ros2:{target.address.name}"
        try:
            self._node = RosNode(target.address, needed_by=self._name)
        except StreamError as error:
            raise FingerError(str(error)) from None
        self._heard_of = (-math.inf, math.nan)
        self._others: tuple[str, ...] = ()
        self._fresh = threading.Event()
        self._publisher: RosPublisher = self._node.publisher(
            target.address.name, _TYPES[target.command]
        )
        if target.feedback:
            self._node.subscribe(target.feedback, _FEEDBACK, self._take)

    def find(self, tolerance: float) -> float:
        """Wait until controller and feedback are there; return the flexion.

        Parameters
        ----------
        tolerance : float
            How far beyond open or closed the joint may be, flexion.

        Raises
        ------
        FingerError
            When no one listens, the joint is not in the feedback, or is far outside.
        """
        target = self._target
        give_up = time.monotonic() + _WAIT
        while not self._publisher.heard:
            if time.monotonic() > give_up:
                gone = "" if self._node.connected else self.trouble(math.inf)
                raise FingerError(
                    f"{self._name}: {gone}." if gone else self._no_one_listens()
                )
            time.sleep(0.01)
        if not target.feedback:
            return 0.0
        self._fresh.clear()
        if not self._fresh.wait(_WAIT):
            there = ", ".join(self._others)
            raise FingerError(
                f"{self._name}: expected joint '{target.joint}' in {_FEEDBACK} on "
                f"{target.feedback} within {_WAIT:g} s, found "
                + (f"only {there}." if there else "no message.")
            )
        _, flexion = self._heard_of
        if not -tolerance <= flexion <= 1 + tolerance:
            raise FingerError(
                f"{self._name}: expected joint '{target.joint}' between open and "
                f"closed, found it at {target.position(flexion):g}; bring it there, or "
                "correct open and closed."
            )
        return flexion

    def trouble(self, timeout: float) -> str:
        """Say what keeps goals from the robot or feedback from here; empty if nothing.

        Parameters
        ----------
        timeout : float
            Longest silence of router and feedback, s.
        """
        target = self._target
        router = f"the router at {target.address.router}"
        silent = self._node.silence() > timeout
        if not self._node.connected:
            return f"{router} went away"
        if silent:
            return f"no answer from {router} for {timeout:g} s"
        if not self._publisher.heard:
            return f"no one listens to {target.address.name} any more"
        if target.feedback and time.monotonic() - self._heard_of[0] > timeout:
            return f"no feedback of joint '{target.joint}' for {timeout:g} s"
        return ""

    def send(self, flexion: float) -> None:
        """Send a goal."""
        position = self._target.position(flexion)
        message: Message
        if self._target.command == "position":
            layout: dict[str, Any] = {"dim": (), "data_offset": 0}
            message = {"layout": layout, "data": (position,)}
        else:
            point = {
                "positions": (position,),
                "velocities": (),
                "accelerations": (),
                "effort": (),
                "time_from_start": stamp(round(self._target.reach * 1e9)),
            }
            message = {
                "header": {"stamp": stamp(0), "frame_id": ""},  # 0: begin at once
                "joint_names": (self._target.joint,),
                "points": (point,),
            }
        self._publisher.put(message, at=time.time_ns())

    def close(self) -> None:
        """Leave the graph."""
        self._node.close()

    def _take(self, data: bytes, received: float, _: bytes) -> None:
        """Take feedback, in zenoh's thread."""
        target = self._target
        try:
            message = decode(_FEEDBACK, data)
            names = tuple(message["name"])
            if target.joint not in names:  # of another part of the robot
                self._others = names
                return
            position = message["position"][names.index(target.joint)]
        except (ValueError, IndexError):
            return  # as good as silence, which is noticed
        flexion = (position - target.open_position) / target.span
        if math.isfinite(flexion):
            self._heard_of = received, flexion
            self._on_measured(received, flexion)
            self._fresh.set()

    def _no_one_listens(self) -> str:
        topic, wanted = self._target.address.name, _TYPES[self._target.command]
        others = sorted({e.type for e in self._node.subscribers(topic)} - {wanted})
        return (
            f"{self._name}: expected a controller that listens to {wanted}, found "
            + (f"one for {others[0]}" if others else "none")
            + "; start it, or give another topic or type."
        )
