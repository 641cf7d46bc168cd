"""c against the true swivel: a truth that is a straight line of c has r = 1."""

import numpy as np
import pytest
import small_person

from ikns.calibration.simulated import swivel_samples
from ikns.errors import InvalidInput


@pytest.mark.parametrize("slope", [0.7, -0.7])
def test_a_swivel_that_is_a_line_of_c_correlates_fully(slope: float) -> None:
    subject = small_person.subject()
    motion, learned = subject.motions[0], subject.null_space_map
    place = motion.task_position(subject.chain)
    c = learned.control_signal(motion.chain_angles(subject.chain), place)
    found = swivel_samples(subject, 0.2 + slope * c)
    # Rounding of sums over some hundred samples.
    np.testing.assert_allclose(found.correlations, np.sign(slope), atol=1e-12)
    np.testing.assert_array_equal(found.labels, learned.labels_)
    assert len(found.hand) == len(found.c) == len(found.swivel) == len(found.labels)


def test_a_swivel_of_another_recording_is_refused() -> None:
    with pytest.raises(InvalidInput, match="one exploration of 3 frames"):
        swivel_samples(small_person.subject(), [0.0, 0.1, 0.2])
