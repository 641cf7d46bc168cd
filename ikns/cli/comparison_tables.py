"""What ``ikns compare`` found, as tables for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from ikns.cli.comparison_json import Named
from ikns.cli.output import table

if TYPE_CHECKING:
    from ikns.analysis.compare import Crosstalk, NullSpaceComparison

#: Names in words.
HELD = {"pose": "position and orientation", "position": "position"}
SHOULDER = {"internal": "internal", "isb": "ISB", "rotation_vector": "vector"}


def point_table(found: NullSpaceComparison, title: str) -> Any:
    """Return one row a PCA point, 80 columns wide."""
    import numpy as np

    rows = [
        [
            int(found.points[i]) + 1,
            int(found.counts[i]),
            _with_ends(
                _known(found.angle_corrected[i], found.angles[i, -1]),
                found.angle_interval[i],
                np.degrees,
            ),
            float(np.degrees(found.mean_posture_angles[i, -1])),
            _with_ends(found.inside[i], found.inside_interval[i], _percent),
            _with_ends(*_worst_leak(found, i), _milli),
            float(np.degrees(found.turn[i].max())),
            float(1000 * found.straight_leak[i]),
            float(np.degrees(found.curvature[i])),
        ]
        for i in range(len(found.points))
    ]
    return table(
        title,
        {
            "point": "d",
            "still": "d",
            "angle\ndeg": "s",
            "at mean\nposture": ".1f",
            "inside\n%": "s",
            "leak\nmm/c": "s",
            "turn\ndeg/c": ".1f",
            "ends\nmm": ".1f",
            "bend\ndeg": ".0f",
        },
        rows,
    )


def pooled_table(
    findings: Iterable[tuple[Sequence[str], NullSpaceComparison]], title: str
) -> Any:
    """Return one row a chain, task and set of coordinates; all points together."""
    import numpy as np

    rows = []
    for (_, task, coordinates), found in findings:
        pooled = found.pooled

        def cell(name: str, unit: Any, own: Any = pooled) -> str:
            value, *ends = own[name]
            return _with_ends(value, ends, unit)

        rows.append(
            [
                found.directions.shape[2],
                task,
                SHOULDER[coordinates],
                cell(_corrected(found, "angle"), np.degrees),
                float(np.degrees(found.chance_angles[0])),
                cell("inside", _percent),
                100 * float(np.mean(found.inside_chance[:, 1])),
                1000 * pooled[_corrected(found, "leak")][0],
                1000 * pooled["straight_leak"][0],
            ]
        )
    return table(
        title,
        {
            "joints": "d",
            "held": "s",
            "shoulder": "s",
            "angle\ndeg": "s",
            "chance\nbelow": ".0f",
            "inside\n%": "s",
            "chance\nabove": ".0f",
            "leak\nmm/c": ".1f",
            "ends\nmm": ".1f",
        },
        rows,
    )


#: What the columns of both tables mean.
LEGEND = (
    "angle: largest between learned and analytic directions, averaged over the visited "
    "postures.  inside: joint variance inside the null space.  leak, turn: hand "
    "motion while c "
    "goes from 0 to 1.  ends: how far the hand is off where straight Z ends.  "
    "bend: turn of the null space over the range.  chance: one random subspace in "
    "twenty is below (above).  angle and leak are corrected for "
    "noise if there are intervals; --json has both."
)


def leak_sentence(found: NullSpaceComparison) -> str:
    """Say how the hand moves with c, all points together, and without noise."""
    import numpy as np

    parts = []
    for name, unit, written in (("leak", _milli, "mm"), ("turn", np.degrees, "deg")):
        corrected = _with_ends(*_value_and_ends(found, name), unit)
        plain = _with_ends(found.pooled[name][0], (np.nan, np.nan), unit)
        if _corrected(found, name) == name:
            parts.append(f"{plain} {written}")
        else:
            parts.append(f"{corrected} {written} ({plain} with noise)")
    return f"While c goes from 0 to 1 the hand goes {parts[0]} and turns {parts[1]}."


def _corrected(found: NullSpaceComparison, name: str) -> str:
    """Name of a pooled value without what noise adds, where there is one."""
    better = f"{name}_corrected"
    return name if math.isnan(found.pooled[better][0]) else better


def _value_and_ends(found: NullSpaceComparison, name: str) -> tuple[Any, Any]:
    value, *ends = found.pooled[_corrected(found, name)]
    return value, ends


def _known(value: Any, other: Any) -> Any:
    return other if math.isnan(value) else value


def crosstalk_sentence(found: Crosstalk) -> str:
    """Say what reaches do to c."""
    reaches = f"{len(found.change)} reaches" if len(found.change) > 1 else "1 reach"
    mean = _with_ends(found.mean_change, found.mean_change_interval, float)
    rate = _with_ends(found.per_meter, found.per_meter_interval, float)
    return (
        f"Crosstalk on {reaches}: c changes by {mean} per reach, {rate} per meter; at "
        f"most by {found.largest:.2f}."
    )


def _with_ends(value: Any, ends: Any, unit: Any) -> str:
    """Write a value and its interval, such as ``3.1 (0-4.4)``."""
    shown = float(unit(value))
    if math.isnan(shown):
        return "-"
    low, high = (float(unit(end)) for end in ends)
    text = _short(shown)
    if math.isnan(low) or math.isnan(high):
        return text
    return f"{text} ({_short(low)}-{_short(high)})"


def _short(value: float) -> str:
    """Write a number with two or three digits.

    >>> [_short(x) for x in (0.0, 0.123, 4.56, 45.6, 99.94)]
    ['0', '0.12', '4.6', '46', '99.9']
    """
    if value == 0:
        return "0"
    if 99 < value < 99.95:  # shares near 100 %
        return f"{value:.1f}"
    return f"{value:.2f}" if value < 1 else f"{value:.{1 if value < 9.95 else 0}f}"


def _worst_leak(found: NullSpaceComparison, i: int) -> tuple[Any, Any]:
    """Of the signal that moves the hand most at a point."""
    values = found.leak[i]
    worst = int(values.argmax()) if not math.isnan(values.max()) else 0
    best = _known(found.leak_corrected[i][worst], values[worst])
    return best, found.leak_interval[i][worst]


def _percent(share: Any) -> Any:
    return 100 * share


def _milli(meters: Any) -> Any:
    return 1000 * meters


def found_tables(
    found: list[Named],
    plain: list[Named],
    across: Crosstalk | None,
    *,
    title: str,
    intervals: bool,
) -> list[Any]:
    """Return tables of every point, where `plain`, and of all points together."""
    brackets = "; in brackets 95 % intervals" if intervals else ""
    return [
        *(
            point_table(each, f"{title}: {names[0]}, hand {HELD[names[1]]} held")
            for names, each in plain
        ),
        pooled_table(found, f"All points together (root mean squares){brackets}"),
        leak_sentence(plain[0][1]),
        *([] if across is None else [crosstalk_sentence(across)]),
        LEGEND,
    ]
