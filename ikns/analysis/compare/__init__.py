"""Learned against analytic null spaces: how alike, and what the difference costs.

`samples` does it all on plain arrays and is read first; `fronts` feeds it a motion and
a skeleton, or any robot; `maps` compares two maps on a motion. What is measured has its
own file: `subspaces` (angles and variance), `leak`, `bending`, `reaching` (crosstalk);
`chance` is what random subspaces would show, `coordinates` what other joint angles
make of the same movement.
"""

from ikns.analysis.compare.chance import chance_angles, chance_inside
from ikns.analysis.compare.coordinates import (
    COORDINATES,
    Coordinates,
    shoulder_coordinates,
)
from ikns.analysis.compare.from_motion import (
    compare_motion,
    compare_robot,
    motion_crosstalk,
)
from ikns.analysis.compare.kinematics import Kinematics
from ikns.analysis.compare.maps import Comparison, compare
from ikns.analysis.compare.reaching import Crosstalk, crosstalk, find_reaches
from ikns.analysis.compare.samples import NullSpaceComparison, compare_samples
from ikns.analysis.compare.subspaces import learned_directions

__all__ = [
    "COORDINATES",
    "Comparison",
    "Coordinates",
    "Crosstalk",
    "Kinematics",
    "NullSpaceComparison",
    "chance_angles",
    "chance_inside",
    "compare",
    "compare_motion",
    "compare_robot",
    "compare_samples",
    "crosstalk",
    "find_reaches",
    "learned_directions",
    "motion_crosstalk",
    "shoulder_coordinates",
]
