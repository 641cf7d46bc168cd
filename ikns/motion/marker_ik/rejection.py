"""Why the markers of a frame are not believed, so that one can act on it."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.marker_gate import THORAX, MarkerGate
from ikns.arrays import Array, Indices
from ikns.body.chains import SIDES, ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.gate import GateLimits
from ikns.motion.marker_ik.label_changes import exchanges
from ikns.motion.marker_ik.pose import SolvedFrames
from ikns.motion.marker_ik.rejection_count import RejectionCount
from ikns.motion.marker_ik.size import power_of_ten, say_size
from ikns.motion.marker_ik.turns import turned_markers
from ikns.motion.marker_ik.visibility import say_apart, segment_pairs, sight_needs
from ikns.motion.motion import Motion


class _Worn(NamedTuple):
    """Markers of a chain and the thorax."""

    columns: Indices  # of the skeleton's marker set
    pairs: Indices  # (N, 2) of the same segment
    apart: Array  # (N,) their distance on the person, m


# A reason is asked for by frame, and finding the segments takes longer than saying it.
@lru_cache(maxsize=8)
def _worn(skeleton: Skeleton, chain: ChainLike) -> _Worn:
    needs = sight_needs(skeleton, chain).values()
    columns = np.concatenate([np.array(own, dtype=np.int64) for own, _ in needs])
    return _Worn(columns, *segment_pairs(skeleton, chain))


def chain_columns(skeleton: Skeleton, chain: ChainLike) -> Indices:
    """Columns of the markers of a chain and the thorax in the skeleton's set."""
    return _worn(skeleton, chain).columns


def misfit_reason(
    skeleton: Skeleton,
    chain: ChainLike,
    markers: Array,
    q: Array,
    residual: float,
    limits: GateLimits,
) -> str:
    """Say why the markers of a frame that exceeds the limits do not fit a pose.

    Parameters
    ----------
    skeleton : Skeleton
    chain : str
        See :class:`ikns.Chain`.
    markers : (M, 3) array
        Positions in the world, m; NaN = not seen.
    q : (nq,) array
        The pose found.
    residual : float
        Its root mean square distance from all markers, m.
    limits : GateLimits
    """
    worn = _worn(skeleton, chain)
    first, second = np.moveaxis(markers[worn.pairs], 1, 0)
    change = np.linalg.norm(first - second, axis=1) - worn.apart
    if np.nanmax(np.abs(change), initial=0.0) > limits.intermarker_error:
        power = power_of_ten(skeleton, chain, markers[None])
        if power:
            return f"{say_size(power)}; the unit may be wrong"
        k = int(np.nanargmax(np.abs(change)))
        return f"{say_apart(skeleton, worn.pairs[k], change[k])} than at calibration"
    placed = turned_markers(skeleton, q, markers)
    away = np.linalg.norm(placed - markers, axis=1)[worn.columns]
    if np.nanmax(away, initial=0.0) > limits.worst_residual:
        k = int(np.nanargmax(away))
        label = skeleton.marker_set.labels[worn.columns[k]]
        return f"{label} is {_mm(away[k])} from where any posture would put it"
    return f"no posture fits the markers ({_mm(residual)} off)"


def say_exchanged(labels: tuple[str, ...]) -> str:
    """Say that labels are swapped.

    >>> print(say_exchanged(("RWRA", "RWRB")))
    RWRA and RWRB are swapped
    """
    return f"{', '.join(labels[:-1])} and {labels[-1]} are swapped"


def recorded_reasons(
    skeleton: Skeleton,
    gate: MarkerGate,
    markers: Array,
    frames: SolvedFrames,
    rate: float,
) -> tuple[Indices, tuple[str, ...]]:
    """Say of each frame and arm of a recording why its markers are not believed.

    Returned are numbers (T, 2) of the reasons, -1 where there is none.
    """
    number = np.full(frames.fits.shape, -1)
    reasons: dict[str, int] = {}
    error = partial(frame_errors, gate, markers, frames.residual)
    for wrong, columns in exchanges(gate, markers, error, rate):
        labels = tuple(skeleton.marker_set.labels[column] for column in columns)
        k = reasons.setdefault(say_exchanged(labels), len(reasons))
        for side in range(len(SIDES)):
            if np.isin(gate.group[columns], (THORAX, 1 + side)).any():
                number[wrong, side] = k
    limits = GateLimits(*gate.limits.tolist())
    for i, side in np.argwhere(~frames.fits & (number < 0)).tolist():
        reason = misfit_reason(
            skeleton,
            f"{SIDES[side]}_arm",
            markers[i],
            frames.q[i],
            float(frames.residual[i]),
            limits,
        )
        number[i, side] = reasons.setdefault(reason, len(reasons))
    return number, tuple(reasons)


def frame_errors(gate: MarkerGate, markers: Array, residual: Array) -> Array:
    """Errors of a recording's poses and of distances within segments, (T,) m.

    The root of the sum of squares of the residual and the largest intermarker error.
    """
    first, second = np.moveaxis(markers[:, gate.pair], 2, 0)
    with np.errstate(invalid="ignore"):  # infinite positions
        apart = np.abs(np.linalg.norm(first - second, axis=2) - gate.apart)
    apart[~np.isfinite(apart)] = 0.0
    return np.hypot(residual, apart.max(axis=1, initial=0.0))


def count_rejections(motion: Motion, chain: ChainLike) -> dict[str, int]:
    """Count the frames of a motion whose markers are not believed, by reason.

    The most frequent first; frames in which an arm is out of sight are not counted for
    it. See :func:`ikns.motion.marker_ik.rejection_count.RejectionCount.table`.
    """
    count = RejectionCount()
    number = np.full(len(motion.time), -1)
    for side in chain_sides(chain):
        own = motion.rejected[:, SIDES.index(side)]
        number = np.where((number < 0) & motion.in_sight(f"{side}_arm"), own, number)
    for k in number[number >= 0].tolist():
        count.add(motion.reasons[k])
    return count.table()


def rejection_sentence(motion: Motion, chain: ChainLike) -> str:
    """Say how many frames are left out for their markers, and why; empty for none."""
    return say_rejections(count_rejections(motion, chain), len(motion.time))


def say_rejections(counts: dict[str, int], frames: int) -> str:
    """Say how many of so many frames were left out, by reason; empty for none.

    >>> print(say_rejections({"RUPA and RUPB are swapped": 30}, 100))
    30 of 100 frames left out: RUPA and RUPB are swapped
    >>> print(say_rejections({"RFIN is up to 90 mm away": 3, "RUPA is": 1}, 100))
    4 of 100 frames left out: RFIN is up to 90 mm away (3 frames); RUPA is (1 frame)
    """
    if not counts:
        return ""
    left_out = f"{sum(counts.values())} of {frames} frames left out"
    if len(counts) == 1:
        return f"{left_out}: {next(iter(counts))}"
    shown = list(counts.items())[:_SHOWN]
    why = "; ".join(f"{reason} ({_frames(n)})" for reason, n in shown)
    if len(counts) > _SHOWN:
        why += f"; other reasons ({_frames(sum(list(counts.values())[_SHOWN:]))})"
    return f"{left_out}: {why}"


#: Reasons that a sentence names.
_SHOWN = 3


def _frames(n: int) -> str:
    return f"{n} frame" + "s" * (n != 1)


def _mm(meters: float) -> str:
    return f"{1000 * meters:.0f} mm"
