"""A joint of a robot under ROS 2 as a finger, commanded over zenoh."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Self, get_args

from ikns.errors import InvalidInput
from ikns.finger.guard import Guard, Safety
from ikns.finger.relax_at_exit import forget, relax_at_exit
from ikns.finger.ros2.address import RosAddress, ros_name
from ikns.finger.ros_joint import RosCommand, RosJoint, RosTarget
from ikns.finger.state import FingerState

#: A trajectory's one point is to be reached in so many periods.
_AHEAD = 2


class RosFinger:
    """A finger that is a joint of a robot, moved by a controller of ROS 2.

    A thread of its own sends the goal, in the safe state too. The message says where to
    be, not with which force, and nothing that can be sent takes the torque away: the
    safe states are ``hold`` and ``open``. When nothing arrives any more, what happens
    is the robot's own doing; controllers of ros2_control keep the last goal.

    Parameters
    ----------
    address : RosAddress
        Of the topic that the controller listens to.
    command : {"joint_trajectory", "position"}
        ``trajectory_msgs/msg/JointTrajectory`` with one point, or
        ``std_msgs/msg/Float64MultiArray`` with one number.
    open_position, closed_position : float
        Of the joint at flexion 0 and 1, in the robot's unit (rad or m).
    joint : str
        Name of the joint; needed for trajectories and for feedback.
    feedback : str
        Topic of ``sensor_msgs/msg/JointState`` with this joint. Without it nothing is
        measured: it starts at `open_position` wherever the joint is, and a joint that
        does not follow is not noticed.
    rate : float
        Messages per second.
    safety : Safety
        With ``hold`` or ``open`` as its safe state.

    Raises
    ------
    InvalidInput
        When a parameter is wrong.
    """

    resolution = 0.0

    def __init__(
        self,
        address: RosAddress,
        *,
        command: RosCommand,
        open_position: float,
        closed_position: float,
        joint: str = "",
        feedback: str = "",
        rate: float = 50.0,
        safety: Safety,
    ) -> None:
        if command not in get_args(RosCommand):
            raise InvalidInput(
                f"expected type=joint_trajectory or type=position, found '{command}'."
            )
        ends = open_position, closed_position
        if not all(map(math.isfinite, ends)) or open_position == closed_position:
            raise InvalidInput(
                "expected two positions of the joint as open and closed, found "
                f"{open_position:g} and {closed_position:g}."
            )
        if not joint and (feedback or command == "joint_trajectory"):
            raise InvalidInput("expected the name of the joint, as in joint=finger.")
        if not 0 < rate <= 1000:
            raise InvalidInput(f"expected a rate from 0 to 1000 Hz, found {rate:g}.")
        if safety.safe_state == "limp":
            raise InvalidInput(
                "a ROS controller cannot be told to take its torque away, so the safe "
                "state limp cannot be kept; expected hold or open (--safe-state hold, "
                "or safe=hold in the address)."
            )
        self.safety = safety
        topic = ros_name(feedback, "a topic") if feedback else ""
        self._target = RosTarget(address, command, joint, topic, *ends, _AHEAD / rate)
        self._period = 1.0 / rate
        self._guard = Guard(safety)
        self._lock = threading.RLock()  # of guard and measurement
        self._access = threading.Lock()  # held while connecting or relaxing
        self._known = FingerState()
        self._joint: RosJoint | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    @property
    def target(self) -> RosTarget:
        """Where its goals go."""
        return self._target

    def connect(self) -> None:
        """Connect and follow commands from the present position; leave the safe state.

        Raises
        ------
        FingerError
            When there is no router, no one listens to the topic, the joint is not in
            the feedback, or it is outside the range from open to closed.
        """
        with self._access:
            relax_at_exit(self)
            try:
                if self._joint is None:
                    self._joint = RosJoint(self._target, self._measured)
                start = self._joint.find(self.safety.stall_tolerance)
            except BaseException:
                if self._thread is None:
                    self._leave()
                raise
            with self._lock:
                self._guard.start(time.monotonic(), start)
            if self._thread is None:
                self._stop.clear()
                name = f"finger at ros2:{self._target.address.name}"
                run = self._run
                self._thread = threading.Thread(
                    target=run, args=(self._joint,), daemon=True, name=name
                )
                self._thread.start()

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one sent, NaN if none is."""
        with self._lock:
            return self._guard.command(time.monotonic(), flexion)

    def state(self) -> FingerState:
        """Return the latest known state; the flexion is NaN without feedback."""
        with self._lock:
            guard, now = self._guard, time.monotonic()
            known = self._known if self._target.feedback else FingerState(time=now)
            return replace(
                known,
                age=now - known.time,
                mode=guard.mode,
                sent=guard.goal,
                stalled=guard.stalled,
                alert=guard.reason,
            )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay in it until connected again."""
        with self._lock:
            self._guard.fail(reason)

    def relax(self) -> None:
        """Send where it is as the last goal, and leave; the robot's torque stays on."""
        self._stop.set()
        with self._access:
            if self._thread is not None:
                self._thread.join()
                self._thread = None
            with self._lock:
                self._guard.relax()
            self._leave()

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        """Relax."""
        self.relax()

    def _leave(self) -> None:
        if self._joint is not None:
            self._joint.close()
            self._joint = None
        forget(self)

    def _measured(self, received: float, flexion: float) -> None:
        with self._lock:
            self._known = FingerState(time=received, flexion=flexion)
            self._guard.measured(received, flexion)

    def _run(self, joint: RosJoint) -> None:
        """Send goals until relaxed, and then where it is."""
        due = time.monotonic()
        while not self._stop.is_set():
            try:
                self._cycle(joint)
            except Exception as error:  # whatever it is, the safe state needs this
                self.make_safe(f"talking to the robot failed with {error!r}")
            due = max(due + self._period, time.monotonic())
            self._stop.wait(max(due - time.monotonic(), 0.0))
        with self._lock:
            last, known = self._guard.goal, self._known
        if time.monotonic() - known.time < self.safety.silence_timeout:
            limits = self.safety.limits
            last = min(max(known.flexion, limits.lower), limits.upper)
        if math.isfinite(last):
            joint.send(last)

    def _cycle(self, joint: RosJoint) -> None:
        wrong = joint.trouble(self.safety.silence_timeout)
        with self._lock:
            self._guard.tick(time.monotonic())
            if wrong:
                self._guard.fail(wrong)
            goal = self._guard.goal
        if math.isfinite(goal):
            joint.send(goal)
