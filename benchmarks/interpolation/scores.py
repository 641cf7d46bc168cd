"""How far interpolated values are from true ones, and how c jumps."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from interpolation.schemes import Known, Local
from interpolation.truth import Visit, line_angle

__all__ = [
    "errors",
    "hull_jump",
    "in_hull",
    "largest_steps",
    "left_out",
    "revisited",
]

Array = np.ndarray
Scheme = Callable[[Known], Callable[[Array], Local]]

#: Every so many samples of a visit are compared: a tenth of a second apart.
_EVERY = 5
#: How far to either side of the hull two places are, m: far above rounding. Where a
#: point lies just inside the hull c is steep, yet changes by a few 1e-4 at most.
_ASIDE = 1e-7
#: Steps along a reach are looked at after every millimeter of the hand's path.
_MM = 1e-3


def errors(at: Callable[[Array], Local], visits: Sequence[Visit]) -> tuple[Array, ...]:
    """Error at places visited, from true directions and signals.

    Returns
    -------
    angle : (V,) array
        Between interpolated and true direction, at the middle of the visit, deg.
    c : (V,) array
        Root mean square error of c over the visit, % of the range.
    """
    z = at(np.array([visit.center for visit in visits])).directions[:, 0]
    angle = line_angle(z, np.array([visit.direction for visit in visits]))
    x = np.concatenate([visit.x[::_EVERY] for visit in visits])
    q = np.concatenate([visit.q[::_EVERY] for visit in visits])
    c = at(x).signal(q)[:, 0]
    truth = np.concatenate([visit.signal[::_EVERY] for visit in visits])
    ends = np.cumsum([len(visit.x[::_EVERY]) for visit in visits])[:-1]
    square = [part.mean() for part in np.split((c - truth) ** 2, ends)]
    return np.degrees(angle), 100 * np.sqrt(square)


def revisited(visits: Sequence[Visit], again: Sequence[Known]) -> tuple[Array, ...]:
    """Error of what is learned at the place itself, on another visit; as `errors`."""
    angle, c = [], []
    for visit, known in zip(visits, again, strict=True):
        angle.append(np.degrees(line_angle(known.directions[0, 0], visit.direction)))
        q = visit.q[::_EVERY]
        found = (q @ known.directions[0, 0] - known.lower[0]) / (
            known.upper[0] - known.lower[0]
        )
        c.append(100 * np.sqrt(np.mean((found - visit.signal[::_EVERY]) ** 2)))
    return np.array(angle), np.array(c)


def left_out(
    scheme: Scheme, known: Known, visits: Sequence[Visit]
) -> tuple[Array, Array]:
    """Error at each point, learned from the others: what a lab can measure.

    The truth is what was learned at the point itself, so no Jacobian is needed.
    """
    angle, c = [], []
    for k, visit in enumerate(visits):
        at = scheme(known.without(k))
        z = at(known.centers[[k]]).directions[0, 0]
        angle.append(np.degrees(line_angle(z, known.directions[k, 0])))
        x, q = visit.x[::_EVERY], visit.q[::_EVERY]
        own = (q @ known.directions[k, 0] - known.lower[k]) / (
            known.upper[k] - known.lower[k]
        )
        c.append(100 * np.sqrt(np.mean((at(x).signal(q)[:, 0] - own) ** 2)))
    return np.array(angle), np.array(c)


def in_hull(points: Array, x: Array) -> Array:
    """Whether places (N, 3) lie in the hull of the points."""
    return Delaunay(points).find_simplex(x) >= 0


def hull_jump(
    at: Callable[[Array], Local], known: Known, rng: np.random.Generator, n: int = 200
) -> Array:
    """Jump of c across the hull in a posture between those of its corners, (n,) %."""
    hull = ConvexHull(known.centers)
    a, b, c = (known.centers[hull.simplices[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    facet = rng.choice(len(area), n, p=area / area.sum())
    share = rng.dirichlet(np.ones(3), n)
    corners = hull.simplices[facet]
    on = np.einsum("nk,nkd->nd", share, known.centers[corners])
    q = np.einsum("nk,nkd->nd", share, known.postures[corners])
    out = _ASIDE * hull.equations[facet, :3]
    apart = at(on + out).signal(q) - at(on - out).signal(q)
    return 100 * np.abs(apart[:, 0])


def largest_steps(
    at: Callable[[Array], Local], reaches: Sequence[tuple[Array, Array]]
) -> tuple[Array, Array]:
    """Largest step of c on each reach: from frame to frame, and per mm of hand path, %.

    Parameters
    ----------
    at : function
        Interpolated values.
    reaches : sequence of (x, q)
        Hand positions (T, 3), m, and joint vectors (T, 7), 10 ms apart.
    """
    frame, mm = [], []
    for x, q in reaches:
        way = np.linalg.norm(np.diff(x, axis=0), axis=1)
        path = np.append(0.0, np.cumsum(way))
        even = np.arange(0.0, path[-1], _MM)
        both = np.hstack([x, q])
        fine = np.column_stack([np.interp(even, path, column) for column in both.T])
        for steps, xs, qs in ((frame, x, q), (mm, fine[:, :3], fine[:, 3:])):
            steps.append(100 * np.abs(np.diff(at(xs).signal(qs)[:, 0])).max())
    return np.array(frame), np.array(mm)
