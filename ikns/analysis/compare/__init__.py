"""Learned against analytic null spaces: how alike, and what the difference costs.

`samples` runs the whole comparison on plain arrays and is read first; `from_motion` and
`from_robot` call it with a person's motion and with a robot's recording, `combinations`
repeats it for several tasks, chains and shoulder coordinates. `maps` compares two maps
on a motion, `visited` a learned one with the analytic one. Each quantity has its own
file: `subspaces` and `null_spaces` (angles, variance, agreement), `leak`, `kinematics`,
`reaching` (crosstalk). `chance` is what random subspaces would show; `coordinates` are
other joint angles for the same movement.
"""

from ikns.analysis.compare.chance import chance_angles, chance_inside
from ikns.analysis.compare.combinations import compare_combinations
from ikns.analysis.compare.coordinates import (
    COORDINATES,
    shoulder_coordinates,
)
from ikns.analysis.compare.from_motion import compare_motion, motion_crosstalk
from ikns.analysis.compare.from_robot import compare_robot, free_tasks
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.maps import compare
from ikns.analysis.compare.reaching import Crosstalk, crosstalk
from ikns.analysis.compare.samples import NullSpaceComparison, compare_samples
from ikns.analysis.compare.subspaces import learned_directions
from ikns.analysis.compare.visited import compare_visited
from ikns.motion.reaches import find_reaches

__all__ = [
    "COORDINATES",
    "Crosstalk",
    "Kinematics",
    "NullSpaceComparison",
    "chance_angles",
    "chance_inside",
    "compare",
    "compare_combinations",
    "compare_motion",
    "compare_robot",
    "compare_samples",
    "compare_visited",
    "crosstalk",
    "find_reaches",
    "free_tasks",
    "learned_directions",
    "motion_crosstalk",
    "shoulder_coordinates",
]
