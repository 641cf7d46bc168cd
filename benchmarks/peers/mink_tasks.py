"""mink: a frame task a marker over MuJoCo's kinematics, steps until the pose rests."""

from __future__ import annotations

from importlib.metadata import version

import mink
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from ikns.motion.marker_ik import PRIOR
from peers.problem import ACCURACY, Problem
from peers.timing import FrameByFrame

#: Steps at most.
STEPS = 20


class Mink(FrameByFrame):
    """A site at every marker, its orientation free; set up as in pink_tasks.py."""

    version = version("mink")

    def __init__(self, problem: Problem) -> None:
        model = mujoco.MjModel.from_xml_string(_text(problem.plain()))
        self.tasks = [
            mink.FrameTask(label, "site", position_cost=1.0, orientation_cost=0.0)
            for label in problem.skeleton.marker_set.labels
        ]
        self.posture = mink.PostureTask(model, cost=PRIOR)
        self.configuration = mink.Configuration(model)
        super().__init__(self._solve, problem.markers, problem.start)

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        self.configuration.update(_to_mujoco(q))
        return np.array(
            [
                self.configuration.data.site(task.frame_name).xpos.copy()
                for task in self.tasks
            ]
        )

    def _solve(self, seen, before):
        configuration = self.configuration
        before = _to_mujoco(before)
        configuration.update(before)
        self.posture.set_target(before)
        tasks = [self.posture]
        for task, place in zip(self.tasks, seen, strict=True):
            if np.isfinite(place[0]):
                pose = configuration.get_transform_frame_to_world(
                    task.frame_name, "site"
                )
                target = mink.SE3.from_rotation_and_translation(pose.rotation(), place)
                task.set_target(target)
                tasks.append(task)
        for _ in range(STEPS):
            velocity = mink.solve_ik(
                configuration, tasks, 1.0, solver="daqp", limits=[]
            )
            configuration.integrate_inplace(velocity, 1.0)
            if np.abs(velocity).max() < ACCURACY:
                break
        q = configuration.q.copy()
        q[3:7] = np.roll(q[3:7], -1)
        return q


def _to_mujoco(q):
    """Quaternion as w, x, y, z."""
    x = np.array(q)
    x[3:7] = np.roll(x[3:7], 1)
    return x


def _text(body) -> str:
    """Write the body as MJCF."""
    children: dict[int, list[int]] = {i: [] for i in range(-1, len(body["parent"]))}
    for i, parent in enumerate(body["parent"]):
        children[parent].append(i)

    def numbers(values) -> str:
        return " ".join(map(repr, map(float, values)))

    def link(i: int) -> str:
        turn = np.roll(Rotation.from_matrix(body["rotation"][i]).as_quat(), 1)
        joint = "<freejoint/>" if body["parent"][i] < 0 else '<joint axis="0 0 1"/>'
        sites = "".join(
            f'<site name="{label}" pos="{numbers(place)}"/>'
            for label, joint_of, place in zip(
                body["labels"], body["marker_joint"], body["marker_place"], strict=True
            )
            if joint_of == i
        )
        return (
            f'<body pos="{numbers(body["translation"][i])}" quat="{numbers(turn)}">'
            f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{joint}{sites}'
            + "".join(link(child) for child in children[i])
            + "</body>"
        )

    bodies = "".join(link(i) for i in children[-1])
    return f"<mujoco><worldbody>{bodies}</worldbody></mujoco>"
