"""Why a frame is rejected, so that the experimenter can act on it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.live.control.frame import FrameSolver
from ikns.live.control.frame_result import ControlFrame
from ikns.live.control.settings import ControlSettings
from ikns.motion.marker_ik.rejection import (
    chain_columns,
    misfit_reason,
    say_exchanged,
)
from ikns.nullspace.signal_names import signal_names

NONE_EXCHANGED: NDArray[np.int64] = np.empty(0, dtype=np.int64)


def fits_markers(solved: ControlFrame, settings: ControlSettings) -> bool:
    """Whether a pose fits the markers; an error of NaN does not fit."""
    return (
        solved.residual <= settings.max_residual
        and solved.worst_residual <= settings.max_worst_residual
        and solved.intermarker_error <= settings.max_intermarker_error
    )


def rejection_reason(
    solver: FrameSolver,
    settings: ControlSettings,
    markers: NDArray[np.float64],
    solved: ControlFrame,
    *,
    new: bool,
    exchanged: NDArray[np.int64] = NONE_EXCHANGED,
) -> str:
    """Say why a frame is rejected; empty if it is valid.

    Parameters
    ----------
    solver : FrameSolver
        The solver of the frame.
    settings : ControlSettings
    markers : (M, 3) array
        Positions in the world, m; NaN = not seen.
    solved : ControlFrame
    new : bool
        Whether it is newer than and different from the last frame.
    exchanged : (K,) integer array
        Columns of labels that have changed places.
    """
    if not new:
        return "the same frame again"
    limit, worth = solver.max_uncertainty, solved.uncertainty.tolist()
    doubtful = 0
    for dof in settings.dofs:
        # A deviation that is NaN is not certain either.
        if not (solved.in_sight if limit is None else worth[dof - 1] <= limit):
            doubtful = dof
            break
    fits = fits_markers(solved, settings)
    # A marker that is wrong matters more than one that is hidden.
    hides = fits or not math.isfinite(solved.residual)
    if doubtful and not solved.in_sight and hides:
        return f"the {_hidden(solver, markers)} is not visible"
    if len(exchanged):
        labels = solver.skeleton.marker_set.labels
        return say_exchanged(tuple(labels[column] for column in exchanged))
    if not fits:
        return misfit_reason(
            solver.skeleton,
            solver.chain,
            markers,
            solved.q,
            solved.residual,
            settings.limits,
        )
    if doubtful and math.isfinite(worth[doubtful - 1]):
        names = signal_names(len(worth))
        return uncertain_reason(
            solver.skeleton, solver.chain, markers, names[doubtful - 1]
        )
    c = solved.c.tolist()
    for dof in settings.dofs:
        if not math.isfinite(c[dof - 1]):
            return "the hand is outside the map"
    return ""


def uncertain_reason(
    skeleton: Skeleton,
    chain: ChainLike,
    markers: NDArray[np.float64],
    signal: str = "c",
) -> str:
    """Say which hidden markers of a chain leave a signal uncertain, the first three."""
    columns = chain_columns(skeleton, chain)
    hidden = columns[~np.isfinite(markers[columns]).all(axis=1)]
    if not hidden.size:
        return f"{signal} is uncertain"
    named = [skeleton.marker_set.labels[column] for column in hidden[:3]]
    more = " and others" if len(hidden) > 3 else ""
    return f"{signal} is uncertain without {', '.join(named)}{more}"


def _hidden(solver: FrameSolver, markers: NDArray[np.float64]) -> str:
    seen = np.all(np.isfinite(markers), axis=1)
    hidden = [
        link
        for link, (own, need) in solver.sight_needs.items()
        if seen[own].sum() < need
    ]
    return ", ".join(hidden).replace("_", " ")
