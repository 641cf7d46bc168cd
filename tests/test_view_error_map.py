"""The error map shows each value at its place.

Numbers are passed through unchanged, or from meters to centimeters in a title: 1e-12
relative is rounding.
"""

import numpy as np
import pytest
from matplotlib.figure import Figure

from ikns.errors import InvalidInput
from ikns.view.error_map import Slices, error_map_figure, workspace_slices
from ikns.view.render import png

CENTERS = np.array([0.3, -0.2, 0.1]) + 0.1 * np.random.default_rng(1).normal(
    size=(9, 3)
)
SLICES = workspace_slices(CENTERS, n=3, spacing=0.02)
#: A field that tells every place from every other.
FIELD = 3 + SLICES.places @ [1.0, 10.0, 0.1]


def drawn(**options: object) -> Figure:
    given = {"label": "angle (deg)", "simulated": True} | options
    return error_map_figure(SLICES, FIELD, CENTERS, **given)


def test_every_value_is_drawn_at_its_place() -> None:
    figure = drawn()
    panels = figure.axes[:3]
    for k, axes in enumerate(panels):
        (mesh,) = axes.collections
        np.testing.assert_array_equal(np.ravel(mesh.get_array()), FIELD[k].ravel())
        corners = mesh.get_coordinates()
        middle = (corners[:-1, :-1] + corners[1:, 1:]) / 2
        np.testing.assert_allclose(
            middle, SLICES.places[k][..., [2, 0]], rtol=1e-12, atol=1e-12
        )
        assert f"{100 * abs(SLICES.height[k]):.0f} cm" in axes.get_title("left")
        assert axes.get_aspect() == 1
        # One scale for all, from zero.
        assert mesh.get_clim() == (0.0, FIELD.max())
    assert figure.axes[3].get_ylabel() == "angle (deg)"
    assert "Z right (m)" in panels[0].get_xlabel()
    assert "X forward (m)" in panels[0].get_ylabel()


def test_each_point_stands_once_in_the_slice_nearest_to_it() -> None:
    figure = drawn()
    for k, center in enumerate(CENTERS):
        panels = [
            row
            for row, axes in enumerate(figure.axes[:3])
            for text in axes.texts
            if text.get_text() == str(k + 1)
            and text.get_position() == (center[2], center[0])
        ]
        assert panels == [int(np.abs(SLICES.height - center[1]).argmin())]


def test_slices_cover_the_points_evenly() -> None:
    made = workspace_slices(CENTERS, n=4, spacing=0.007)
    low, high = CENTERS[:, 1].min(), CENTERS[:, 1].max()
    steps = np.diff([low, *made.height, high])
    np.testing.assert_allclose(steps, (high - low) / 5, rtol=1e-12)
    for axis, values in ((0, made.forward), (2, made.right)):
        assert values[0] < CENTERS[:, axis].min()
        assert values[-1] > CENTERS[:, axis].max()
        np.testing.assert_allclose(np.diff(values), 0.007, rtol=1e-9)
    assert made.places.shape == (4, len(made.forward), len(made.right), 3)
    i, a, b = 2, 3, 1
    expected = [made.forward[a], made.height[i], made.right[b]]
    np.testing.assert_array_equal(made.places[i, a, b], expected)


def test_places_without_a_value_stay_white_and_the_scale_may_end_early() -> None:
    hole = FIELD.copy()
    hole[:, :3] = np.nan
    figure = error_map_figure(
        SLICES, hole, CENTERS, label="x (mm)", simulated=False, highest=2.0
    )
    for axes in figure.axes[:3]:
        (mesh,) = axes.collections
        assert np.ma.getmaskarray(mesh.get_array())[:3].all()
        assert mesh.get_clim() == (0.0, 2.0)
    assert "simulated" not in figure.get_suptitle()
    nothing = error_map_figure(
        SLICES, np.full_like(FIELD, np.nan), CENTERS, label="x (mm)", simulated=True
    )
    assert png(nothing).startswith(b"\x89PNG")
    assert "simulated" in nothing.get_suptitle()


def test_the_same_errors_give_the_same_picture() -> None:
    assert png(drawn()) == png(drawn())


def test_bad_shapes_are_refused() -> None:
    with pytest.raises(InvalidInput, match="expected errors"):
        error_map_figure(SLICES, FIELD[:2], CENTERS, label="x (m)", simulated=True)
    for bad in (np.zeros((0, 3)), np.zeros((3, 2)), np.full((2, 3), np.nan)):
        with pytest.raises(InvalidInput, match="PCA points"):
            workspace_slices(bad)
    for options in ({"n": 0}, {"spacing": 0.0}, {"spacing": np.nan}):
        with pytest.raises(InvalidInput, match="at least 1 slice"):
            workspace_slices(CENTERS, **options)
    assert isinstance(SLICES, Slices)
