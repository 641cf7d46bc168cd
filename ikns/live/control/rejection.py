"""Why a frame is rejected, so that the experimenter can act on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.calibration import say_apart, segment_pairs, sight_needs
from ikns.live.control.frame import ControlFrame, FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.motion.marker_ik.size import power_of_ten, say_size


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
    """
    if not new:
        return "the same picture again"
    if not solved.in_sight:
        return f"the {_hidden(solver, markers)} is not in sight"
    if not solved.intermarker_error <= settings.max_intermarker_error:
        return _apart(solver, markers)
    if not solved.worst_residual <= settings.max_worst_residual:
        return _astray(solver, markers, solved)
    if not solved.residual <= settings.max_residual:
        return f"no posture fits the markers ({_mm(solved.residual)} off)"
    if not np.isfinite(solved.c[0]):
        return "the hand is outside the map"
    return ""


def _hidden(solver: FrameSolver, markers: NDArray[np.float64]) -> str:
    seen = np.all(np.isfinite(markers), axis=1)
    needs = sight_needs(solver.skeleton, solver.chain)
    hidden = [link for link, (own, need) in needs.items() if seen[own].sum() < need]
    return ", ".join(hidden).replace("_", " ")


def _apart(solver: FrameSolver, markers: NDArray[np.float64]) -> str:
    """Name the two markers of a segment whose distance is farthest off, or the unit."""
    pairs, calibrated = segment_pairs(solver.skeleton, solver.chain)
    power = power_of_ten(solver.skeleton, solver.chain, markers[None])
    if power:
        return f"{say_size(power)}; the unit may be wrong"
    first, second = markers[pairs.T]
    change = np.linalg.norm(first - second, axis=1) - calibrated
    k = int(np.nanargmax(np.abs(change)))
    return f"{say_apart(solver.skeleton, pairs[k], change[k])} than at calibration"


def _astray(
    solver: FrameSolver, markers: NDArray[np.float64], solved: ControlFrame
) -> str:
    """Name the marker that is farthest from its position in the pose."""
    away = np.linalg.norm(solver.skeleton.markers_in_world(solved.q) - markers, axis=1)
    needs = sight_needs(solver.skeleton, solver.chain).values()
    columns = np.concatenate([own for own, _ in needs])
    marker = columns[int(np.nanargmax(away[columns]))]
    label = solver.skeleton.marker_set.labels[marker]
    return f"{label} is {_mm(away[marker])} from where any posture has it"


def _mm(meters: float) -> str:
    return f"{1000 * meters:.0f} mm"
