"""Contact physics of hand, finger and object, one control frame at a time."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput

# The motor is that of the simulated finger.
from ikns.finger.guard import Guard, Safety
from ikns.finger.simulated import FOLLOW, SPEED, SPIN
from ikns.simulation.grasp.parts import Solid, constant, finger_parts
from ikns.simulation.grasp.world import world_model


class Observation(NamedTuple):
    """What can be seen and felt after a frame.

    `flexion` is the mean over the finger's joints, `load` the pull of the tendon as a
    share of its full effort, `place` the middle of the object in the world and
    `in_hand` in the gripper's frame, m, `speed` its speed, m/s; `finger`, `hand` and
    `table` are the total normal force of each on the object, N.
    """

    flexion: float
    load: float
    place: Array
    in_hand: Array
    speed: float
    finger: float
    hand: float
    table: float


class Grasp:
    """The physics of one pick.

    Commands to the finger pass the same guard as for every finger (limits of range,
    rate and acceleration; less force after a long push). Its motor is that of
    :class:`ikns.finger.SimulatedFinger`, and its tendon pulls on all joints equally.
    `model` is passed to :func:`ikns.simulation.grasp.world.world_model`.

    >>> grasp = Grasp(Solid("cylinder", (0.075, 0.068), 0.021))
    >>> for _ in range(150):
    ...     seen = grasp.frame(1.0)
    >>> seen.flexion < 0.9 and seen.finger > 1.0  # it holds the cup
    True
    """

    def __init__(
        self,
        solid: Solid,
        *,
        rate: float = 100.0,
        **model: Any,
    ) -> None:
        import mujoco

        self.steps = round(1 / (rate * constant("timestep")))
        if self.steps < 1 or abs(self.steps * rate * constant("timestep") - 1) > 1e-9:
            raise InvalidInput(
                f"expected a rate that divides {1 / constant('timestep'):g} steps per "
                f"second, found {rate:g}."
            )
        self.solid, self.rate, self.frames = solid, rate, 0
        self.model = world_model(solid, **model)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self._step, self._force = mujoco.mj_step, mujoco.mj_contactForce
        self._quaternion = mujoco.mju_axisAngle2Quat
        self._product, self._rotate = mujoco.mju_mulQuat, mujoco.mju_rotVecQuat
        self._motor = self._spin = 0.0
        self._dt = constant("timestep")
        self.guard = Guard(Safety())
        self.guard.start(0.0, 0.0)
        # Views: MuJoCo's Python makes new ones whenever it is asked.
        data = self.data
        self._guide, self._control = data.mocap_pos[0], data.ctrl
        self._guide_facing, self._warnings = data.mocap_quat[0], data.warning.number
        self._tendon, self._pull = data.ten_length, data.actuator_force
        self._velocity = data.qvel[:3]
        self._shares = np.arange(1, self.steps + 1)[:, None] / self.steps
        self._home = self._guide.copy()
        self._middle = np.array([0.0, 0.0, self._home[2]])
        self._facing = self._guide_facing.copy()
        self._wrench = np.zeros(6)
        hand, held = (self.model.body(name).id for name in ("hand", "object"))
        self._hand, self._axes = data.xpos[hand], data.xmat[hand].reshape(3, 3)
        self._object = data.xpos[held]
        thing = self.model.geom("object").id
        self._thing = thing
        kinds = {"table": 2, "palm": 1, "heel": 1}
        kinds |= {part.name: 0 for part in finger_parts()}
        self._kind = {self.model.geom(name).id: kind for name, kind in kinds.items()}
        # One unit of the tendon's force is 1 / full N m at each joint.
        modules = finger_parts()[1:]
        full = sum(module.upper for module in modules)
        self._full_force = modules[0].effort * full

    @property
    def time(self) -> float:
        """Time of the frames done, s."""
        return self.frames / self.rate

    def frame(
        self, flexion: float, shift: ArrayLike = (0, 0, 0), turn: ArrayLike = (0, 0, 0)
    ) -> Observation:
        """Advance by one frame with a command to the finger, 0 to 1; NaN: none.

        At its end the hand is shifted from where it grips the object at the start, m in
        the world, and turned about the object's middle by a rotation vector, rad in the
        world.
        """
        data = self.data
        now = self.time
        self.guard.command(now, flexion)
        goal = self.guard.goal
        start = self._guide.copy()
        end, facing = self._hand_pose(np.asarray(shift), np.asarray(turn))
        if self.frames == 0:  # the hand starts there, without a jump
            start = end
            data.qpos[7:10] = end
            data.qpos[10:14] = facing
        self._guide_facing[:] = facing
        places = start + (end - start) * self._shares
        for place, motor in zip(places, self._motor_path(goal), strict=True):
            self._guide[:] = place
            self._control[0] = motor
            self._step(self.model, data)
        self.frames += 1
        if np.count_nonzero(self._warnings):
            raise InvalidInput(
                f"the simulated contact came apart after {self.time:g} s, expected an "
                f"object and a hand that 2 ms resolve, found {self.solid}."
            )
        self.guard.measured(self.time, self.flexion)
        return self.seen()

    @property
    def flexion(self) -> float:
        """Mean flexion of the joints, 0 to 1."""
        return float(self._tendon[0])

    def seen(self) -> Observation:
        """Return what can be seen and felt now."""
        place = self._object.copy()
        finger, hand, table = self._normal_forces()
        return Observation(
            flexion=self.flexion,
            load=float(self._pull[0]) / self._full_force,
            place=place,
            in_hand=(place - self._hand) @ self._axes,
            speed=_length(self._velocity),
            finger=finger,
            hand=hand,
            table=table,
        )

    def _hand_pose(self, shift: Array, turn: Array) -> tuple[Array, Array]:
        """Return position and orientation of the hand after a shift and a turn."""
        angle = _length(turn)
        axis = turn / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
        way, facing, arm = np.empty(4), np.empty(4), np.empty(3)
        self._quaternion(way, axis, angle)
        self._product(facing, way, self._facing)
        self._rotate(arm, self._home - self._middle, way)
        return self._middle + shift + arm, facing

    def _normal_forces(self) -> list[float]:
        total, wrench = [0.0, 0.0, 0.0], self._wrench
        pairs = self.data.contact.geom.tolist()
        for i, (one, other) in enumerate(pairs):
            if self._thing not in (one, other):
                continue
            self._force(self.model, self.data, i, wrench)
            total[self._kind[other if one == self._thing else one]] += wrench[0]
        return [float(force) for force in total]

    def _motor_path(self, goal: float) -> list[float]:
        """Return the motor's positions in the steps of a frame."""
        if math.isnan(goal):  # without a command the gear holds the motor
            self._spin = 0.0
            return [self._motor] * self.steps
        motor, spin, dt = self._motor, self._spin, self._dt
        share, path = min(dt / SPIN, 1.0), []
        for _ in range(self.steps):
            wanted = min(max((goal - motor) / FOLLOW, -SPEED), SPEED)
            spin += (wanted - spin) * share
            motor += spin * dt
            path.append(motor)
        self._motor, self._spin = motor, spin
        return path


def _length(vector: Array) -> float:
    """Length of a vector (3,); np.linalg.norm takes ten times as long."""
    return math.sqrt(vector.dot(vector))
