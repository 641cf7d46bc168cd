"""The comparison's figure holds what was found."""

import dataclasses

import numpy as np
import pytest
from test_compare_samples import planted

from ikns.analysis.compare import compare_samples, crosstalk
from ikns.errors import InvalidInput
from ikns.view.comparison import comparison_figure
from ikns.view.render import png, svg


@pytest.fixture(scope="module")
def found():
    case = planted(0.2, np.random.default_rng(0), across=0.1)
    pose = compare_samples(**case, resamples=50)
    other = dict(case, jacobians=case["jacobians"][:, :3])
    position = compare_samples(**other, resamples=50)
    return {"pose held": pose, "position held": position}


@pytest.fixture(scope="module")
def reaches():
    x = np.repeat(np.random.default_rng(1).uniform(0, 1, 9), 20)
    speed = np.abs(np.diff(x, prepend=x[0])) * 100
    return crosstalk(2 * x, speed, np.outer(x, [1, 0, 0]))


def drawn(axes):
    return [np.asarray(line.get_xdata(), dtype=float) for line in axes.lines]


def holds(axes, values):
    """Whether one of the lines of a panel has these abscissas."""
    return any(
        len(x) == len(values) and np.allclose(x, values, rtol=1e-12)
        for x in drawn(axes)
    )


def test_the_panels_hold_the_values_in_their_units(found, reaches):
    figure = comparison_figure(found, simulated=True, crosstalk=reaches)
    angle, inside, leak, reach = figure.axes
    for each in found.values():
        assert holds(angle, np.degrees(each.angle_corrected))
        assert holds(angle, [np.degrees(each.chance_angles[0])] * 2)
        assert holds(inside, 100 * each.inside)
        assert holds(inside, 100 * each.inside_chance[:, 1])
    first = found["pose held"]
    assert holds(leak, 1000 * first.leak_corrected[:, 0])
    bars = leak.collections[0].get_segments()
    np.testing.assert_allclose(
        [[bar[0, 0], bar[1, 0]] for bar in bars], 1000 * first.leak_interval[:, 0]
    )
    assert holds(reach, reaches.distance)
    assert "simulated" in figure.get_suptitle()
    assert "simulated" not in comparison_figure(found, simulated=False).get_suptitle()
    units = ["(deg)", "(%)", "(mm)", "(m)"]
    for axes, unit in zip(figure.axes, units, strict=True):
        assert unit in axes.get_xlabel()


def test_without_intervals_and_reaches_it_still_draws(found):
    bare = {
        name: dataclasses.replace(
            each,
            angle_corrected=np.full_like(each.angle_corrected, np.nan),
            angle_interval=np.full_like(each.angle_interval, np.nan),
            leak_corrected=np.full_like(each.leak_corrected, np.nan),
            leak_interval=np.full_like(each.leak_interval, np.nan),
            points=each.points + 4,
        )
        for name, each in found.items()
    }
    figure = comparison_figure(bare, simulated=False)
    first = bare["pose held"]
    assert holds(figure.axes[2], 1000 * first.leak[:, 0])
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["5", "6"]
    assert len(png(figure)) > 1000


def test_the_same_findings_give_the_same_bytes(found, reaches):
    pictures = [
        svg(comparison_figure(found, simulated=True, crosstalk=reaches))
        for _ in range(2)
    ]
    assert pictures[0] == pictures[1]


def test_nothing_to_draw_is_told():
    with pytest.raises(InvalidInput, match="1 to 4 comparisons"):
        comparison_figure({}, simulated=True)
