"""A motion as a table: named columns, degrees, and counts that add up."""

import numpy as np
import small_person

from ikns.motion.table import motion_table


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
