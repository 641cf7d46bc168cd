"""The figure of a variance split holds what it was given, in its units.

Values are multiplied by one factor on their way: 1e-12 relative is rounding.
"""

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.figure import Figure

from ikns.errors import InvalidInput
from ikns.view.render import pdf, png, svg
from ikns.view.variance_split import variance_split_figure

RNG = np.random.default_rng(1)
AT = np.linspace(0, 100, 21)
UCM, ORT = RNG.uniform(1e-4, 1e-2, size=(2, 21))
Z = np.log(UCM / ORT) / 2
LOW_HIGH = np.stack([Z - 0.3, Z + 0.4])


def draw(over: str = "time", *, simulated: bool = True, **options) -> Figure:
    given = {"interval": LOW_HIGH, "surrogates": LOW_HIGH - 1, "no_structure": 0.14}
    return variance_split_figure(
        AT,
        UCM,
        ORT,
        Z,
        over=over,  # type: ignore[arg-type]
        simulated=simulated,
        **(given | options),
    )


@pytest.mark.parametrize("over", ["time", "points"])
def test_both_variances_are_square_degrees_and_the_index_is_as_given(over: str) -> None:
    upper, lower = draw(over).axes
    factor = (180 / np.pi) ** 2
    for line, values in zip(upper.lines, (UCM, ORT), strict=True):
        np.testing.assert_array_equal(line.get_xdata(), AT)
        np.testing.assert_allclose(line.get_ydata(), factor * values, rtol=1e-12)
    lines = {line.get_label(): line for line in lower.lines}
    np.testing.assert_array_equal(lines["dVz"].get_ydata(), Z)
    assert list(lines["V_UCM = V_ORT"].get_ydata()) == [0.14, 0.14]
    assert "deg²" in upper.get_ylabel()
    expected = "normalized time (%)" if over == "time" else "PCA point"
    assert lower.get_xlabel() == expected


@pytest.mark.parametrize("over", ["time", "points"])
def test_interval_and_band_reach_from_low_to_high(over: str) -> None:
    lower = draw(over).axes[1]
    named = {area.get_label(): area for area in lower.collections}
    for name, values in (
        ("confidence interval", LOW_HIGH),
        ("surrogates: joints on their own", LOW_HIGH - 1),
    ):
        points = np.concatenate([path.vertices for path in named[name].get_paths()])
        for at, low, high in zip(AT, *values, strict=True):
            y = points[points[:, 0] == at, 1]
            np.testing.assert_allclose([y.min(), y.max()], [low, high], rtol=1e-12)
    bare = draw(over, interval=None, surrogates=None, no_structure=None).axes[1]
    assert not bare.collections
    assert len(bare.lines) == 1


def test_both_variances_differ_in_dash_and_mark_not_in_color_alone() -> None:
    dashes = [line.get_linestyle() for line in draw("time").axes[0].lines]
    marks = [line.get_marker() for line in draw("points").axes[0].lines]
    assert len(set(dashes)) == len(set(marks)) == 2


@pytest.mark.parametrize("over", ["time", "points"])
def test_the_title_says_simulated_exactly_when_the_data_are(over: str) -> None:
    assert "simulated" in draw(over).get_suptitle()
    assert "simulated" not in draw(over, simulated=False).get_suptitle()


@pytest.mark.parametrize("over", ["time", "points"])
def test_the_same_input_gives_the_same_picture(over: str) -> None:
    assert svg(draw(over)) == svg(draw(over))
    assert pdf(draw(over)) == pdf(draw(over))
    assert png(draw(over)).startswith(b"\x89PNG")


@pytest.mark.parametrize("over", ["time", "points"])
def test_gaps_and_infinite_indices_are_drawn(over) -> None:
    z, none = Z.copy(), UCM * np.nan
    z[3], z[5] = np.nan, np.inf
    assert svg(variance_split_figure(AT, none, ORT, z, over=over, simulated=False))
    assert svg(variance_split_figure(AT, none, 0 * ORT, z, over=over, simulated=False))


@pytest.mark.parametrize(
    "draw_wrong",
    [
        lambda: variance_split_figure(AT, UCM[1:], ORT, Z, simulated=False),
        lambda: variance_split_figure(AT, UCM, ORT, [Z, Z], simulated=False),
        lambda: draw(interval=Z),
        lambda: draw(surrogates=LOW_HIGH[:, 1:]),
        lambda: draw("trials"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(draw_wrong: Callable[[], Figure]) -> None:
    with pytest.raises(InvalidInput, match="expected|must"):
        draw_wrong()
