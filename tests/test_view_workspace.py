"""The figure of the workspace holds the data it was given, in the right places.

Coordinates are only permuted on their way to the artists: 1e-12 relative is rounding.
"""

import numpy as np
from matplotlib.figure import Figure

from ikns.body.skeleton import Skeleton
from ikns.view.body import arm_points, body_surfaces
from ikns.view.render import png
from ikns.view.style import point_color
from ikns.view.workspace import workspace_figure


def box() -> np.ndarray:
    """Eight vertices of a box in front of the right chest, m."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    return np.array([0.2, -0.3, 0.0]) + corners * [0.2, 0.2, 0.3]


def workspace(labels: np.ndarray | None = None) -> Figure:
    rng = np.random.default_rng(2)
    samples = np.repeat(box(), 5, axis=0) + rng.normal(0, 0.01, (40, 3))
    given_labels = np.repeat(np.arange(8), 5) if labels is None else labels
    hand = np.cumsum(rng.normal(0, 0.01, (60, 3)), axis=0)
    hand[20:23] = np.nan
    return workspace_figure(
        hand,
        samples,
        given_labels,
        box(),
        facets=[[0, 1, 2], [1, 2, 3], [4, 5, 6]],
        simulated=True,
    )


def test_workspace_draws_the_hand_right_forward_up() -> None:
    hand = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])
    figure = workspace_figure(hand, box(), np.arange(8), box(), simulated=True)
    left = figure.axes[0]
    drawn = np.array(left.lines[0].get_data_3d())
    np.testing.assert_allclose(drawn, hand[:, [2, 0, 1]].T, rtol=1e-12)
    assert left.get_xlabel().startswith("Z right")
    assert left.get_ylabel().startswith("X forward")
    assert left.get_zlabel().startswith("Y up")


def test_workspace_draws_every_sample_once_in_the_color_of_its_point() -> None:
    labels = np.repeat(np.arange(8), 5)
    labels[:7] = -1
    right = workspace(labels).axes[1]
    clouds = {c.get_label(): c for c in right.collections}
    sizes = {
        name: len(c._offsets3d[0]) for name, c in clouds.items() if "still" in name
    }
    assert sizes == {"still, discarded": 7}
    for point in range(8):
        cloud = clouds[f"point {point + 1}"]
        assert len(cloud._offsets3d[0]) == (labels == point).sum()
        if (labels == point).any():
            color = cloud.get_facecolor()[0, :3]
            np.testing.assert_allclose(color, point_color(point), rtol=1e-12)


def test_workspace_marks_the_points_and_numbers_them_from_one_close_by() -> None:
    right = workspace().axes[1]
    (marks,) = [c for c in right.collections if c.get_label() == "PCA point"]
    drawn = box()[:, [2, 0, 1]]
    np.testing.assert_allclose(np.transpose(marks._offsets3d), drawn, rtol=1e-12)
    places = {text.get_text(): text.get_position_3d() for text in right.texts}
    assert list(places) == [str(k) for k in range(1, 9)]
    # Straight outwards and nearer to its own point than to any other.
    away = np.array(list(places.values()))[:, None] - drawn
    assert (np.linalg.norm(away, axis=2).argmin(axis=1) == np.arange(8)).all()
    outward = drawn - drawn.mean(axis=0)
    own = away[np.arange(8), np.arange(8)]
    np.testing.assert_allclose(np.cross(own, outward), 0, atol=1e-15)
    assert ((own * outward).sum(axis=1) > 0).all()


def test_workspace_has_one_scale_on_all_axes() -> None:
    for axes in workspace().axes:
        spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
        # Lengths on the page are proportional to the box aspect.
        scale = np.array(axes._box_aspect) / spans
        np.testing.assert_allclose(scale, scale[0], rtol=1e-9)


def test_workspace_draws_each_facet_of_the_volume() -> None:
    figure = workspace()
    named = {c.get_label(): c for c in figure.axes[1].collections}
    volume = named["interpolation volume"]
    # A 3-D collection knows its paths once it is projected.
    png(figure)
    assert len(volume.get_paths()) == 3
    assert (volume.get_facecolor()[:, 3] < 0.5).all()


def test_workspace_stands_without_samples_facets_or_body() -> None:
    none = np.zeros((0, 3))
    figure = workspace_figure(none, none, np.zeros(0, int), box()[:2], simulated=False)
    assert png(figure).startswith(b"\x89PNG")
    # No path is promised where there is none.
    assert [t.get_text()[:1] for t in figure.texts].count("a") == 1
    assert not any("hand went" in text.get_text() for text in figure.texts)


def test_workspace_shows_the_body_in_front_of_which_the_hand_moved() -> None:
    skeleton = Skeleton.load()
    arms = arm_points(skeleton, skeleton.neutral())
    figure = workspace_figure(
        box(), box(), np.arange(8), box(), arms=arms, simulated=True
    )
    # Trunk, neck, head and three links of each arm.
    assert len(figure.axes[0].collections) == 3 + 2 * 3
    # The second panel stays close to the points: the left shoulder is out of it.
    assert figure.axes[1].get_xlim()[0] > arms[1, 0, 2] > figure.axes[0].get_xlim()[0]


def test_arm_points_follow_the_segment_lengths() -> None:
    skeleton = Skeleton.load()
    arms = arm_points(skeleton, skeleton.neutral())
    lengths = np.linalg.norm(np.diff(arms, axis=1), axis=2)
    for side, row in zip(("right", "left"), lengths, strict=True):
        names = [f"{side}_{part}" for part in ("upper_arm", "forearm", "hand")]
        known = [skeleton.segment_lengths[name] for name in names]
        np.testing.assert_allclose(row, known, rtol=1e-9)
    assert arms[0, 0, 2] > 0 > arms[1, 0, 2]


def test_surfaces_of_the_body_face_outwards() -> None:
    skeleton = Skeleton.load()
    for grid in body_surfaces(arm_points(skeleton, skeleton.neutral())):
        # Drawing swaps axes cyclically (Z, X, Y), so orientation is kept.
        along, around = grid[2:-1, :-1] - grid[1:-2, :-1], np.diff(grid, axis=1)[1:-2]
        normal = np.cross(around, along)
        outward = grid[1:-2, :-1] - grid[1:-2].mean(axis=1, keepdims=True)
        big = np.linalg.norm(outward, axis=-1) > 1e-6
        sign = np.sign((normal * outward).sum(axis=-1)[big])
        assert (sign == sign[0]).all()
        assert sign[0] > 0
