"""Every figure holds the data it was given, names its units, and repeats exactly.

Numbers are compared with what the artists hold. A coordinate is only permuted or
multiplied by a unit factor on its way there: 1e-12 relative is rounding.
"""

import base64
import re
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from ikns.body.chains import chain_joints
from ikns.errors import InvalidInput
from ikns.view.body import body_surfaces
from ikns.view.directions import directions_figure, principal_angle_figure
from ikns.view.methods import methods_figure
from ikns.view.render import data_uri, png, svg
from ikns.view.residuals import residual_figure
from ikns.view.signals import control_figure, swivel_figure
from ikns.view.style import point_color
from ikns.view.workspace import workspace_figure

JOINTS = chain_joints("right_arm")


def unit_directions(shape: tuple[int, ...]) -> np.ndarray:
    z = np.random.default_rng(1).normal(size=shape)
    return z / np.linalg.norm(z, axis=-1, keepdims=True)


TIME = np.arange(50) / 10
HAND = np.random.default_rng(2).random((50, 3))
NOISE = np.random.default_rng(3).random((2, 50))
DRAW: dict[str, Callable[[bool], Figure]] = {
    "workspace": lambda simulated: workspace_figure(
        HAND, HAND, np.arange(50) % 4, HAND[:4], simulated=simulated
    ),
    "directions": lambda simulated: directions_figure(
        unit_directions((3, 7)), JOINTS, simulated=simulated
    ),
    "angles": lambda simulated: principal_angle_figure(
        {"pose": [0.1, 0.2]}, simulated=simulated
    ),
    "swivel": lambda simulated: swivel_figure(
        TIME, TIME, np.arange(50) % 2, [1, np.nan], simulated=simulated
    ),
    "control": lambda simulated: control_figure(
        TIME, *NOISE, TIME > 2, simulated=simulated
    ),
    "methods": lambda simulated: methods_figure(
        TIME,
        {"paper": NOISE[0], "intent": NOISE[1]},
        TIME / 10,
        {"paper": NOISE[1], "intent": 0 * TIME},
        TIME / 20,
        {"paper": TIME, "intent": 2 * TIME},
        simulated=simulated,
    ),
    "residual": lambda simulated: residual_figure(TIME, NOISE[0], simulated=simulated),
}


@pytest.mark.parametrize("name", DRAW)
def test_the_title_says_simulated_exactly_when_the_data_are(name: str) -> None:
    assert "simulated" in DRAW[name](True).get_suptitle()
    assert "simulated" not in DRAW[name](False).get_suptitle()


@pytest.mark.parametrize("name", DRAW)
def test_every_drawn_axis_names_its_quantity_with_a_unit(name: str) -> None:
    figure = DRAW[name](True)
    shared = [figure.get_supxlabel(), figure.get_supylabel()]
    texts = [label for label in shared if label]
    for axes in figure.axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        labels += [axes.get_zlabel()] if axes.name == "3d" else []
        texts += [label for label in labels if label]
    unit = re.compile(r"\((s|m|mm|m/s|deg|no unit)\)|PCA point")
    assert texts
    assert all(unit.search(text) for text in texts), texts


def test_directions_are_the_lengths_of_the_bars_from_top_to_bottom() -> None:
    learned, analytic = unit_directions((4, 7)), -unit_directions((4, 7))
    figure = directions_figure(learned, JOINTS, analytic=analytic, simulated=False)
    assert len(figure.axes) == 4
    for point, axes in enumerate(figure.axes):
        behind, front = axes.containers
        widths = [bar.get_width() for bar in front]
        np.testing.assert_allclose(widths, learned[point], rtol=1e-12)
        widths = [bar.get_width() for bar in behind]
        np.testing.assert_allclose(widths, analytic[point], rtol=1e-12)
        assert axes.get_title(loc="left") == f"point {point + 1}"
    first = figure.axes[0]
    names = [text.get_text() for text in first.get_yticklabels()]
    assert names == [joint.removeprefix("right_").replace("_", " ") for joint in JOINTS]
    assert first.yaxis_inverted()
    assert "grows as c rises" in figure.get_supxlabel()


def test_several_directions_per_point_get_a_panel_each() -> None:
    learned = unit_directions((3, 2, 14))
    learned[1, 1] = np.nan
    figure = directions_figure(learned, chain_joints("both_arms"), simulated=True)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [f"point {p}, direction {d}" for d in (1, 2) for p in (1, 2, 3)]
    assert [text.get_text() for text in figure.axes[4].texts] == ["no direction"]
    assert svg(figure)


def test_principal_angles_are_shown_in_degrees_beside_their_goal() -> None:
    angles = {"pose": np.array([0.02, np.nan, 0.3]), "position": np.zeros(3)}
    figure = principal_angle_figure(angles, goal=np.pi / 30, simulated=False)
    (axes,) = figure.axes
    for line, (name, values) in zip(axes.lines, angles.items(), strict=False):
        assert line.get_label() == name
        np.testing.assert_allclose(line.get_xdata(), np.rad2deg(values), rtol=1e-12)
        assert list(line.get_ydata()) == [1, 2, 3]
    assert axes.lines[-1].get_label() == "goal: at most 6 deg"
    assert axes.get_xlim()[0] == 0
    assert axes.get_xlim()[1] > np.rad2deg(0.3)


def test_swivel_panels_hold_their_own_samples_and_their_r() -> None:
    rng = np.random.default_rng(4)
    swivel, c = rng.normal(size=30), rng.normal(size=30)
    labels = rng.integers(-1, 3, 30)
    figure = swivel_figure(swivel, c, labels, [0.987, np.nan, -0.5], simulated=True)
    expected = ["r = +0.987", "r unknown", "r = -0.500"]
    for point, (axes, r) in enumerate(zip(figure.axes, expected, strict=True)):
        x, y = axes.lines[0].get_data()
        np.testing.assert_allclose(x, np.rad2deg(swivel[labels == point]), rtol=1e-12)
        np.testing.assert_array_equal(y, c[labels == point])
        assert axes.get_title(loc="left") == f"point {point + 1}:  {r}"


def test_control_shades_the_time_outside_the_volume() -> None:
    time = np.arange(10) / 10
    inside = np.array([0, 1, 1, 0, 0, 1, 1, 1, 1, 0], dtype=bool)
    c = np.linspace(0, 1, 10)
    figure = control_figure(time, c, 0.1 * c, inside, gate=0.05, simulated=False)
    upper, lower = figure.axes
    for axes in (upper, lower):
        paths = axes.collections[0].get_paths()
        spans = [
            (path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in paths
        ]
        # The last frame has no next frame to end at.
        expected = [(0, 0.1), (0.3, 0.5), (0.9, 0.9)]
        np.testing.assert_allclose(spans, expected, atol=1e-12)
    np.testing.assert_array_equal(upper.lines[-1].get_ydata(), c)
    np.testing.assert_array_equal(lower.lines[0].get_ydata(), 0.1 * c)
    assert list(lower.lines[1].get_ydata()) == [0.05, 0.05]


def test_control_says_how_many_values_its_axis_cuts_off() -> None:
    c = np.array([0.0, 0.5, 9.0, np.nan, -7.0])
    figure = control_figure(np.arange(5), c, c * 0, c < 2, simulated=False)
    notes = [text.get_text() for text in figure.axes[0].texts]
    assert notes == ["2 of 4 values lie beyond this axis"]


def test_residuals_are_millimeters() -> None:
    residual = np.array([1e-3, np.nan, 3e-3])
    (axes,) = residual_figure(np.arange(3), residual, simulated=True).axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [1, np.nan, 3])
    assert axes.lines[1].get_label() == "median 2.0 mm"


def test_neighboring_points_differ_in_color_and_fourteen_are_distinct() -> None:
    colors = [to_rgb(point_color(k)) for k in range(14)]
    assert len(set(colors)) == 14


@pytest.mark.parametrize(
    "draw",
    [
        lambda: workspace_figure(HAND, HAND, [0, 1], HAND, simulated=True),
        lambda: workspace_figure(HAND[:, :2], HAND, [0], HAND, simulated=True),
        lambda: directions_figure(np.ones((2, 6)), JOINTS, simulated=True),
        lambda: directions_figure(
            np.ones((2, 7)), JOINTS, analytic=np.ones((3, 7)), simulated=True
        ),
        lambda: principal_angle_figure({"a": [1], "b": [1, 2]}, simulated=True),
        lambda: principal_angle_figure({}, simulated=True),
        lambda: swivel_figure([1, 2], [1], [0, 0], [1], simulated=True),
        lambda: control_figure([0], [0], [0, 1], [True], simulated=True),
        lambda: residual_figure([0], [0, 1], simulated=True),
        lambda: body_surfaces(np.zeros((2, 3, 3))),
    ],
)
def test_arrays_that_do_not_fit_are_refused(draw: Callable[[], object]) -> None:
    with pytest.raises(InvalidInput, match="expected|need|must"):
        draw()


def test_drawing_leaves_the_settings_of_matplotlib_alone_and_ignores_them() -> None:
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    first = png(DRAW["residual"](True))
    assert dict(mpl.rcParams) == before
    with mpl.rc_context({"font.size": 20, "axes.facecolor": "black"}):
        assert png(DRAW["residual"](True)) == first


def test_figures_need_neither_pyplot_nor_a_screen_and_load_late() -> None:
    code = (
        "import sys, ikns, ikns.view\n"
        "assert 'matplotlib' not in sys.modules\n"
        "from ikns.view.figures import control_figure\n"
        "from ikns.view.render import png\n"
        "png(control_figure([0], [0], [0], [True], simulated=True))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", DRAW)
def test_the_same_input_gives_the_same_bytes(name: str) -> None:
    figure = DRAW[name](True)
    assert data_uri(figure) == data_uri(DRAW[name](True))


def test_pictures_are_svg_whose_crowds_alone_are_pixels() -> None:
    crowd = np.random.default_rng(5).normal(size=(4000, 2))
    many = swivel_figure(*crowd.T, np.zeros(4000, int), [0.0], simulated=True)
    for figure, pixels in (
        (Figure(figsize=(1, 1)), False),
        (many, True),
        (DRAW["workspace"](True), True),
    ):
        kind, _, data = data_uri(figure).partition(",")
        assert kind == "data:image/svg+xml;base64"
        picture = base64.b64decode(data)
        assert (b"<image" in picture) == pixels
        # 60 bytes a point would be more.
        assert len(picture) < 240_000
    # The figure itself is as it was: its PDF has no pixels.
    assert b"<image" not in svg(many)


def test_labels_are_drawn_as_they_are_not_as_formulas() -> None:
    hostile = ["$\\frac{", "<&>\"'", "骨", "a\nb"]
    figure = principal_angle_figure({text: [0.1] for text in hostile}, simulated=False)
    assert svg(figure)


def test_reaches_and_turns_of_each_method_are_drawn_from_0() -> None:
    left, middle, right = DRAW["methods"](False).get_axes()[:3]
    for axes, values, zero in (
        (left, NOISE[0], NOISE[0][0]),
        (middle, NOISE[1], NOISE[1][25]),
        (right, TIME, 0.0),
    ):
        drawn = next(line for line in axes.get_lines() if len(line.get_xdata()) == 50)
        np.testing.assert_allclose(drawn.get_ydata(), values - zero, atol=1e-12)
    with pytest.raises(InvalidInput, match="turn"):
        methods_figure(
            TIME, {"paper": TIME}, TIME, {"paper": TIME[1:]}, TIME, {"paper": TIME},
            simulated=False,
        )  # fmt: skip
