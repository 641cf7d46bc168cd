"""A motion as a table: named columns, degrees, and counts that add up."""

import numpy as np
import small_person

from ikns.body.skeleton import Skeleton
from ikns.motion.table import limits_passed, motion_table


def test_the_table_holds_the_motion_and_its_ranges() -> None:
    motion = small_person.subject().motions[0]
    found = motion_table(motion)
    assert found.rows.shape == (len(motion.time), len(found.columns))
    for k, joint in enumerate(motion.joint_names):
        column = found.rows[:, found.columns.index(f"{joint}_deg")]
        np.testing.assert_allclose(np.radians(column), motion.angles[:, k], atol=1e-12)
        known = column[np.isfinite(column)]
        assert known.size == motion.known[:, k].sum()
        assert found.range_deg[joint] == (known.min(), known.max())
        assert found.summary["moved_deg"][joint] == np.ptp(known)
    assert found.summary["frames_converged"] == int(motion.converged.sum())


def test_joints_beyond_their_limits_are_named() -> None:
    body = Skeleton.load()
    ends = dict.fromkeys(body.joint_names, (0.0, 1.0))
    ends["right_forearm_pronation"] = (-40.6, 98.6)
    ends["right_wrist_deviation"] = (-30.5, 45.2)  # of -30 to 45
    ends["left_wrist_deviation"] = (0.0, 45.05)  # as good as at its limit
    ends["left_wrist_flexion"] = (np.nan, np.nan)
    assert limits_passed(body, ends) == {
        "right_forearm_pronation": 90.0,
        "right_wrist_deviation": -30.0,
    }
