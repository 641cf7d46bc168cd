"""Directions that each read one known motion and leave the others alone."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence

import numpy as np

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.map.checks import MapWarning, format_point, listed

#: From a joint vector (n,), rad, to d motions (d, n) of the joints there.
Motions = Callable[[Array], Array]

#: A freedom that is explored spans at least this, rad of its joints: half of a hand
#: that turns by 15 deg to either side, and twice what a hand that is meant to be still
#: tilts in 5 s (`ikns.simulation.Unsteadiness`).
LEAST_SPAN = np.radians(15.0)
#: An output of whose variance this much is a quadratic of those before it follows them
#: (a self-motion is bent, so that one freedom alone also moves the second output).
_FOLLOWS = 0.8
#: The freedoms are there when so many of the places show each of them.
_MOST = 2 / 3
#: So many of the joint vectors at a place, at least, say how its motions go.
_VISITED = 20
#: A motion was not explored if less than this share (cosine) is within what was.
_EXPLORED = 0.2


def dual_rows(components: Array, motions: Array) -> Array:
    """Rows in a span that are dual to motions: ``rows @ motions.T`` is the identity.

    Each row gives 1 for its own motion and 0 for the others; of all such rows in the
    span these are the shortest.

    Parameters
    ----------
    components : (k, n) array
        Orthonormal rows, the span; k of at least d.
    motions : (d, n) array
        Independent motions, rad.

    Returns
    -------
    (d, n) array
        NaN where the span does not show every motion by itself.

    Examples
    --------
    >>> motions = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    >>> rows = dual_rows(np.eye(3)[:2], motions)
    >>> np.allclose(rows @ motions.T, np.eye(2), atol=1e-15)
    True
    """
    inside = components @ motions.T
    unit = inside / np.linalg.norm(motions, axis=1)
    if len(components) < len(motions) or (
        np.linalg.svd(unit, compute_uv=False).min() < _EXPLORED
    ):
        return np.full(motions.shape, np.nan)
    return np.asarray(np.linalg.pinv(inside) @ components)


def mean_motions(motions: Motions, q: Array) -> Array:
    """Motions (d, n), averaged over joint vectors (N, n): a self-motion is bent.

    Signs are those at the mean: beyond its highest place an elbow sinks.
    """
    middle = np.asarray(motions(q.mean(axis=0)), dtype=np.float64)
    found = np.array([motions(row) for row in q[:: max(1, len(q) // _VISITED)]])
    if found.shape[1:] != middle.shape or middle.ndim != 2:
        return middle
    along = np.where((found * middle).sum(axis=2) < 0, -1.0, 1.0)
    return np.asarray((along[:, :, None] * found).mean(axis=0))


def assemble_dual(
    centers: Array,
    components: Sequence[Array],
    samples: Sequence[Array],
    motions: Motions,
    *,
    n_dof: int,
    quantiles: tuple[float, float],
) -> tuple[list[int], Array, Array, Array]:
    """Which points show every motion, and their directions and ranges.

    As :func:`ikns.nullspace.map.assembly.assemble`, but a row is orthogonal to the
    other motions and not to the other rows, and its output rises with its own motion.
    Rows have unit length. A point does not show a motion that is not within the
    components, spans less than :data:`LEAST_SPAN` or only follows those before it; a
    MapWarning names it. Without a direction, in the first case, it is left out.

    Returns
    -------
    shown : list of int
        Points that have all directions, K of P.
    directions : (K, d, n) array
    lower, upper : (K, d) arrays
        rad.

    Raises
    ------
    InvalidInput
        When `motions` gives another shape.
    NotEnoughData
        When fewer than two thirds of the points do, or fewer than four of four or more.
    """
    directions, ends, faults = [], [], []
    for rows, q in zip(components, samples, strict=True):
        wanted = mean_motions(motions, q)
        if wanted.shape != (n_dof, q.shape[1]):
            raise InvalidInput(
                f"expected motions ({n_dof}, {q.shape[1]}), found {wanted.shape}."
            )
        z = dual_rows(rows, wanted) if len(rows) else np.full(wanted.shape, np.nan)
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        directions.append(z)
        ends.append(np.quantile(q @ z.T, quantiles, axis=0))
        faults.append(_fault(q, z, wanted, ends[-1]))
    shown = [k for k, z in enumerate(directions) if np.isfinite(z).all()]
    _check_shown(centers, faults, n_dof)
    lower, upper = np.swapaxes(np.array(ends)[shown], 0, 1)
    return shown, np.array(directions)[shown], lower, upper


def _fault(q: Array, z: Array, wanted: Array, ends: Array) -> str:
    """Say which motion a place does not show; empty where it shows all."""
    if not np.isfinite(z).all():
        return "does not show each by itself and is left out"
    spans = (ends[1] - ends[0]) / np.einsum("dn,dn->d", z, wanted)
    outputs = (q - q.mean(axis=0)) @ z.T
    for i, span in enumerate(spans):
        if not span >= LEAST_SPAN:
            return f"spans {np.degrees(span):.0f} deg of the {_nth(i)}"
        share = _explained(outputs, i)
        if not share < _FOLLOWS:
            return f"moves the {_nth(i)} only with the others ({100 * share:.0f} %)"
    return ""


def _check_shown(centers: Array, faults: Sequence[str], n_dof: int) -> None:
    """Refuse points of which too few show every motion; warn of those that do not."""
    wrong = [
        f"{format_point(centers, k)} {fault}" for k, fault in enumerate(faults) if fault
    ]
    if not wrong:
        return
    count, good = len(faults), len(faults) - len(wrong)
    least = max(math.ceil(_MOST * count), min(4, count))
    if good < least:
        raise NotEnoughData(
            f"expected {n_dof} degrees of freedom at {least} of the {count} places or "
            "more, "
            f"found them at {good}: {listed(wrong)}: explore each by itself there "
            "(lift the elbow, turn the hand), or ask for fewer with --n-dof."
        )
    warnings.warn(
        f"{len(wrong)} of {count} places do not show {n_dof} degrees of freedom: "
        f"{listed(wrong)}.",
        MapWarning,
        stacklevel=4,
    )


def _explained(outputs: Array, i: int) -> float:
    """Share of an output's variance that is a quadratic of those before it."""
    others = outputs[:, :i]
    size = np.maximum(others.std(axis=0), 1e-12)
    terms = others / size
    pairs = [
        terms[:, a] * terms[:, b]
        for a in range(terms.shape[1])
        for b in range(a, terms.shape[1])
    ]
    columns = np.column_stack([np.ones(len(terms)), terms, *pairs])
    rest = outputs[:, i] - columns @ np.linalg.lstsq(columns, outputs[:, i])[0]
    total = float(np.var(outputs[:, i]))
    return 1.0 - float(np.var(rest)) / total if total > 0 else 1.0


def _nth(i: int) -> str:
    """Word for a place in a row, from 0 on."""
    names = ("first", "second", "third", "fourth", "fifth", "sixth")
    return names[i] if i < len(names) else f"{i + 1}th"
