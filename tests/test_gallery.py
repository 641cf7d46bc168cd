"""Pictures for the pages: a body at each place, with the hand there."""

import numpy as np
import pytest
import small_person

from ikns.errors import InvalidInput
from ikns.nullspace.self_motion import posture_at_point
from ikns.view.figures import arm_points, hand_places_figure


def test_each_panel_has_the_hand_at_its_own_place() -> None:
    person = small_person.subject()
    body, learned, chain = person.skeleton, person.null_space_map, person.chain
    centers = learned.centers_[:2]
    arms = [arm_points(body, posture_at_point(body, learned, chain, k)) for k in (0, 1)]
    figure = hand_places_figure(arms, centers, simulated=True, title="Two places")
    assert figure.get_suptitle() == "Two places (simulated subject)"
    assert len(figure.axes) == 2
    for k, axes in enumerate(figure.axes):
        dot = axes.collections[-1]  # the large one is drawn last
        right, forward, up = (float(values[0]) for values in dot._offsets3d)
        np.testing.assert_allclose([forward, up, right], centers[k], atol=1e-12)
        # The drawn arm ends there: the hand's marker is between wrist and knuckle,
        # which are 9 cm apart.
        assert np.linalg.norm(arms[k][0, 2:] - centers[k], axis=1).min() < 0.09
        for limits, value in zip(
            (axes.get_xlim(), axes.get_ylim(), axes.get_zlim()),
            (right, forward, up),
            strict=True,
        ):
            assert limits[0] < value < limits[1]


def test_a_place_without_a_posture_is_refused() -> None:
    with pytest.raises(InvalidInput, match="places"):
        hand_places_figure(np.zeros((2, 2, 4, 3)), np.zeros((3, 3)), simulated=True)
