"""Whether one direction of the room is longer: a wrong calibration of the cameras.

A segment keeps its length while it turns. In a room whose axes are scaled unlike, w is
measured where there is u, and |u|^2 = w^T (1 - E) w with the same symmetric E for
everything. So the squared distances of two markers vary with the direction between
them:

    |w|^2 = constant + w^T E w

with the trace of E left open, which is the size of the segment. Skin makes distances
vary as well, but not by what all other segments say.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.finding import Finding

#: Least difference between the scales of two directions; and least share of the changes
#: of a segment's distances that the other segments' E explains. Clean recordings of
#: seven people have at most 0.016 (168 trials); with an axis 8 % long, seven of eight
#: trials have more than 0.2 (benchmarks/silent_faults.py).
_LONGER, _EXPLAINED = 0.03, 0.2
#: Frames looked at; and fewest in which two markers are seen.
_GLANCES, _FEWEST = 200, 20
#: Change of a distance that means nothing, m; and least change, root mean square, that
#: a direction of twice the scale would make: a segment that does not turn shows noise.
_NOISE, _TURNED = 3e-4, 0.003
#: A direction within 18 deg of an axis is called by its name.
_NAMED = 0.95


class _Sums(NamedTuple):
    """Sums of least squares of one segment."""

    normal: Array  # (5, 5)
    right: Array  # (5,)
    squares: float  # m^2
    frames: int


def room_stretch(markers: Array, pairs: Indices, links: Array) -> tuple[Array, float]:
    """Estimate how unlike the axes of the room are, from lengths that stay the same.

    Parameters
    ----------
    markers : (T, M, 3) array
        m in the world; NaN = not seen.
    pairs : (N, 2) integer array
        Markers of one segment each.
    links : (M,) array
        Segment of each marker.

    Returns
    -------
    stretch : (3, 3) array
        E, symmetric with trace 0.
    explained : float
        Share of the squared changes of distances that is explained by the E of the
        other segments; 0 where fewer than two turn.
    """
    some = markers[:: max(1, -(-len(markers) // _GLANCES))]
    of_pair = links[pairs[:, 0]] if len(pairs) else links[:0]
    sums = [
        one
        for link in dict.fromkeys(of_pair.tolist())
        if (one := _sums(some, pairs[of_pair == link])).frames
    ]
    if len(sums) < 2:
        return np.zeros((3, 3)), 0.0
    left = 0.0
    for k, one in enumerate(sums):
        other = _solve(sums[:k] + sums[k + 1 :])
        left += float(one.squares - 2 * other @ one.right + other @ one.normal @ other)
    # What noise alone would change.
    total = sum(one.squares + one.frames * _NOISE**2 for one in sums)
    found = _solve(sums)
    a, b, xy, xz, yz = found.tolist()
    stretch = np.array([[a, xy, xz], [xy, b, yz], [xz, yz, -a - b]])
    turned = [found @ one.normal @ found / one.frames for one in sums]
    if max(turned) < _TURNED**2 * np.sum(stretch**2):
        return stretch, 0.0
    changes = sum(one.squares for one in sums)
    return stretch, float((changes - left) / total)


def _sums(markers: Array, pairs: Indices) -> _Sums:
    normal, right, squares, frames = np.zeros((5, 5)), np.zeros(5), 0.0, 0
    for i, j in pairs.tolist():
        w = markers[:, i] - markers[:, j]
        w = w[np.isfinite(w).all(axis=1)]
        if len(w) < _FEWEST:
            continue
        square = np.sum(w**2, axis=1)
        # Half of a change of the square, by the length, is the change of the length.
        scale = 2 * np.sqrt(max(float(np.median(square)), _NOISE**2))
        x, y, z = w.T
        terms = [x * x - z * z, y * y - z * z, 2 * x * y, 2 * x * z, 2 * y * z]
        design = np.stack(terms, axis=1) / scale
        design -= design.mean(axis=0)
        change = (square - square.mean()) / scale
        normal += design.T @ design
        right += design.T @ change
        squares += float(change @ change)
        frames += len(w)
    return _Sums(normal, right, squares, frames)


def _solve(sums: list[_Sums]) -> Array:
    """Least squares over segments; directions that nothing shows stay 0."""
    noise = sum(one.frames for one in sums) * _NOISE**2
    normal = np.sum([one.normal for one in sums], axis=0) + noise * np.eye(5)
    return np.linalg.solve(normal, np.sum([one.right for one in sums], axis=0))


def judge_axes(
    where: str, worn: MarkerSet, markers: Array, pairs: Indices
) -> list[Finding]:
    """Say that one direction of the room is longer or shorter than the others.

    Arguments as for :func:`room_stretch`.
    """
    links = np.array([marker.link for marker in worn.markers])
    stretch, explained = room_stretch(markers, pairs, links)
    if not explained > _EXPLAINED:
        return []
    values, directions = np.linalg.eigh(stretch)
    # Lengths in a direction are measured this many times too long, but for one factor.
    scale = 1 / np.sqrt(np.maximum(1 - values, 0.1))
    low, middle, high = scale.tolist()
    longer = high / middle > middle / low
    k, ratio = (2, high / np.sqrt(low * middle)) if longer else (0, 0.0)
    if not longer:
        ratio = low / np.sqrt(middle * high)
    if abs(ratio - 1) < _LONGER:
        return []
    return [
        Finding(
            "stretched",
            "warn",
            where,
            f"distances are {100 * abs(ratio - 1):.0f} % {'more' if longer else 'less'}"
            f" along {_say_direction(directions[:, k])} than across it: markers of one "
            "segment change their distance as it turns, alike on all segments",
            "calibrate the cameras again, or correct the scale of that axis in the "
            "file; the static trial may have it too",
        )
    ]


def _say_direction(direction: Array) -> str:
    worst = int(np.abs(direction).argmax())
    if abs(direction[worst]) > _NAMED:
        return f"the {'xyz'[worst]} axis"
    x, y, z = (direction * np.sign(direction[worst])).tolist()
    return f"the direction ({x:.2f}, {y:.2f}, {z:.2f})"
