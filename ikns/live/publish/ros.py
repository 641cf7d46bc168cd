"""The decisions of the live loop as ROS 2 topics.

ROS's clock is the system's (CLOCK_REALTIME). Stamps are the times of receipt that the
session has, placed on that clock when the sink is opened: they have the session's
intervals even when the system's clock is set during a run.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from functools import partial

from ikns.body.chains import ChainLike, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.body.skeleton.model import NQ_ROOT
from ikns.errors import StreamError
from ikns.finger.ros2.address import RosAddress
from ikns.finger.ros2.node import RosNode, stamp
from ikns.live.publish.publisher import PublishedFrame
from ikns.nullspace.signal_names import signal_names

#: Where tools look for diagnostics, by ROS's REP 107.
DIAGNOSTICS = "/diagnostics"
#: Levels of ``diagnostic_msgs/msg/DiagnosticStatus``, by state of the safety machine.
_LEVELS = {"disarmed": 0, "armed": 0, "active": 0, "holding": 1, "safe": 2}
#: The state is repeated so often, s.
_REPEAT = 1.0
#: Without an answer of the router for so long nothing counts as published, s.
_SILENCE = 1.0


def joint_places(skeleton: Skeleton, chain: ChainLike) -> dict[str, int]:
    """Return the joints of a chain, with their places in a configuration q.

    Examples
    --------
    >>> places = joint_places(Skeleton.load(), "right_arm")
    >>> len(places), min(places.values()) >= NQ_ROOT
    (7, True)
    """
    names = skeleton.joint_names
    return {name: NQ_ROOT + names.index(name) for name in chain_joints(chain)}


class RosSink:
    """Topics of a namespace, and /diagnostics.

    ========================  =============================  ==========================
    NAMESPACE/joint_states    sensor_msgs/msg/JointState     rad, of frames that count
    NAMESPACE/c               std_msgs/msg/Float64           of every frame
    NAMESPACE/flexion         std_msgs/msg/Float64           of every frame
    NAMESPACE/events          std_msgs/msg/String            safety and trials
    /diagnostics              diagnostic_msgs/msg/           on a change of state, and
                              DiagnosticArray                every second
    ========================  =============================  ==========================

    Of several freedoms they are c_1, c_2, flexion_1 and flexion_2.

    A Float64 has no stamp of its own; its source time, which ROS shows as
    ``message_info.source_timestamp``, is that of the joint states.

    Parameters
    ----------
    address : RosAddress
        Its name is the namespace.
    n_dof : int
        Number of control signals; 0: only events are published.
    joints : mapping
        Joints to publish, with their places in q.
    simulated : bool
        Whether the person is; stands in the diagnostics.

    Raises
    ------
    StreamError
        When no router answers, or zenoh is not installed.
    """

    def __init__(
        self,
        address: RosAddress,
        *,
        n_dof: int,
        joints: Mapping[str, int],
        simulated: bool = False,
    ) -> None:
        space = address.name
        self._where = f"ros2:{space}"
        self._node = RosNode(address, needed_by=f"publishing to {self._where}")
        self._ahead = time.time_ns() - time.monotonic_ns()
        self._names, self._columns = list(joints), list(joints.values())
        self._about = {"simulated": "yes" if simulated else "no"}
        self._said = ("", -math.inf)
        node = self._node
        # This thread may wait, and what does not fit into its queue is counted.
        publisher = partial(node.publisher, wait=True)
        self._events = publisher(f"{space}/events", "std_msgs/msg/String")
        self._numbers, self._joints, self._state = [], None, None
        if n_dof:
            names = [*signal_names(n_dof), *signal_names(n_dof, "flexion")]
            kind = "std_msgs/msg/Float64"
            self._numbers = [publisher(f"{space}/{name}", kind) for name in names]
            self._state = publisher(DIAGNOSTICS, "diagnostic_msgs/msg/DiagnosticArray")
            if joints:
                self._joints = publisher(
                    f"{space}/joint_states", "sensor_msgs/msg/JointState"
                )

    def sample(self, at: float, sample: PublishedFrame) -> None:
        """Publish a frame, received at a time of `time.monotonic`."""
        self._check_router()
        decision, ns = sample.decision, self._ns(at)
        values = (*decision.solved.c.tolist(), *decision.flexions)
        for publisher, value in zip(self._numbers, values, strict=True):
            publisher.put({"data": value}, at=ns)
        if self._joints and decision.valid:
            message = {
                "header": {"stamp": stamp(ns), "frame_id": ""},
                "name": self._names,
                "position": decision.solved.q[self._columns].tolist(),
                "velocity": (),
                "effort": (),
            }
            self._joints.put(message, at=ns)
        state, since = self._said
        if self._state and (decision.state != state or at - since >= _REPEAT):
            self._said = decision.state, at
            self._state.put(self._diagnostics(ns, sample), at=ns)

    def event(self, at: float, words: str) -> None:
        """Publish an event."""
        self._check_router()
        self._events.put({"data": words}, at=self._ns(at))

    def close(self) -> None:
        """Leave the graph."""
        self._node.close()

    def _ns(self, at: float) -> int:
        return round(at * 1e9) + self._ahead

    def _check_router(self) -> None:
        silent = self._node.silence()
        if not self._node.connected or silent > _SILENCE:
            raise StreamError(
                f"the router at {self._node.address.router} "
                + ("does not answer" if self._node.connected else "went away")
            )

    def _diagnostics(self, ns: int, sample: PublishedFrame) -> dict[str, object]:
        decision = sample.decision
        solved = decision.solved
        values = {
            "state": decision.state,
            "rejected": decision.rejection,
            "residual_m": f"{solved.residual:.6f}",
            "uncertainty_of_c": f"{float(solved.uncertainty[0]):.4f}",
            **self._about,
        }
        status = {
            "level": _LEVELS[decision.state],
            "name": f"{self._where}: safety",
            "message": decision.state
            + (f": {decision.rejection}" if decision.rejection else ""),
            "hardware_id": "ikns",
            "values": [{"key": k, "value": v} for k, v in values.items()],
        }
        return {"header": {"stamp": stamp(ns), "frame_id": ""}, "status": [status]}
