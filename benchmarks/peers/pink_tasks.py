"""pin-pink: a frame task a marker, differential inverse kinematics until it rests."""

from __future__ import annotations

from importlib.metadata import version

import daqp  # noqa: F401 (the solver that pink is told to use)
import numpy as np
import pink
import pinocchio as pin

from ikns.motion.marker_ik import PRIOR
from peers.problem import ACCURACY, Problem
from peers.timing import FrameByFrame

#: Steps at most.
STEPS = 20


class Pink(FrameByFrame):
    """A frame at every marker, its orientation free.

    A task of no orientation still measures its error along the screw to the target, so
    each target gets the orientation that the frame has. A posture task holds what
    hidden markers leave open, as our prior does: without it the pose runs away.
    """

    version = version("pin-pink")

    def __init__(self, problem: Problem) -> None:
        skeleton = problem.skeleton
        model = pin.buildModelFromXML(skeleton.urdf, pin.JointModelFreeFlyer())
        self.tasks = []
        for marker in skeleton.marker_set.markers:
            link = model.frames[model.getFrameId(marker.link, pin.FrameType.BODY)]
            place = link.placement * pin.SE3(np.eye(3), np.array(marker.position))
            model.addFrame(
                pin.Frame(
                    f"marker {marker.label}",
                    link.parentJoint,
                    place,
                    pin.FrameType.OP_FRAME,
                )
            )
            self.tasks.append(
                pink.FrameTask(
                    f"marker {marker.label}", position_cost=1.0, orientation_cost=0.0
                )
            )
        self.posture = pink.PostureTask(cost=PRIOR)
        self.configuration = pink.Configuration(
            model, model.createData(), problem.start
        )
        super().__init__(self._solve, problem.markers, problem.start)

    def markers_at(self, q):
        """Return the markers at a configuration, (M, 3) m."""
        self.configuration.update(q)
        places = [
            self.configuration.get_transform_frame_to_world(task.frame)
            for task in self.tasks
        ]
        return np.array([place.translation for place in places])

    def _solve(self, seen, before):
        configuration = self.configuration
        configuration.update(before)
        self.posture.set_target(before)
        tasks = [self.posture]
        for task, place in zip(self.tasks, seen, strict=True):
            if np.isfinite(place[0]):
                pose = configuration.get_transform_frame_to_world(task.frame)
                task.set_target(pin.SE3(pose.rotation, place))
                tasks.append(task)
        for _ in range(STEPS):
            velocity = pink.solve_ik(
                configuration,
                tasks,
                1.0,
                solver="daqp",
                limits=(),
                safety_break=False,
            )
            configuration.integrate_inplace(velocity, 1.0)
            if np.abs(velocity).max() < ACCURACY:
                break
        return configuration.q.copy()
