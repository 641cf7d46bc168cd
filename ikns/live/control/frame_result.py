"""What a live frame shows: pose, control signal, and how far they can be trusted."""

from __future__ import annotations

from typing import NamedTuple

from ikns.arrays import Array


class ControlFrame(NamedTuple):
    """Pose and control signal of one frame.

    Parameters
    ----------
    c : (d,) array
        Control signals, not clipped; NaN where they are too uncertain, without a marker
        in sight, and where :meth:`ikns.NullSpaceMap.control_signal` is.
    q : (nq,) array
        Configuration of the skeleton.
    hand_in_thorax : (3,) array
        Task position, m.
    in_sight : bool
        Whether every segment of the chain was seen.
    inside : bool
        Whether the hand is among the points of the map; false where the first signal is
        unknown and where the weights of the points cannot be trusted.
    residual : float
        Root mean square distance between pose and markers, m; NaN without markers.
    worst_residual : float
        Largest distance between pose and a marker of the chain, m; NaN without any.
    intermarker_error : float
        Largest difference between the distance of two markers of a segment and that on
        the person's skeleton, m; 0 where no two are seen.
    iterations : int
    converged : bool
    uncertainty : (d,) array
        Standard deviations of the signals, in their unit, by what the frame's markers
        and those that are hidden tell of the pose; see
        :mod:`ikns._kernels.body.uncertainty`. Known where c is left out for it, too;
        NaN without a pose.
    """

    c: Array
    q: Array
    hand_in_thorax: Array
    in_sight: bool
    inside: bool
    residual: float
    worst_residual: float
    intermarker_error: float
    iterations: int
    converged: bool
    uncertainty: Array
