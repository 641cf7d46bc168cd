"""The control signal of a whole recording, as a table and its summary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.live.control.frame import MAX_UNCERTAINTY, FrameSolver
from ikns.motion.marker_ik.rejection import count_rejections
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import nearest_center
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.interpolator import NearestPoint
from ikns.nullspace.readout import IntentMap, Method, Readout
from ikns.nullspace.signal_names import signal_names
from ikns.numerics.median import finite_median
from ikns.recording.recording import Recording

#: Share of the frames without c that calls for a reason.
_MANY = 0.25
#: No person moves c by more from one frame of cameras to the next.
_JUMP = 0.1


class ControlTable(NamedTuple):
    """The control signal of a recording by frame.

    Parameters
    ----------
    columns : list of str
        ``time_s``; ``c``, clipped to 0 to 1 (``c_1``, ``c_2``, ... for several degrees
        of freedom), NaN while it is too uncertain or the chain's markers are rejected;
        ``hand_speed_m_s`` in the thorax frame; ``inside``, 1 where the method was
        taught, see :func:`inside_means`; ``residual_m`` of the markers;
        ``c_uncertainty`` (``c_1_uncertainty``, ...), a standard deviation.
    rows : (T, len(columns)) array
    summary : dict
        Counts, shares and medians, ready for JSON. ``jumps_outside`` counts changes of
        c by more than 0.1 from one frame to the next that come from the rule of the
        nearest point outside the volume.
    """

    columns: list[str]
    rows: NDArray[np.float64]
    summary: dict[str, Any]


def control_table(
    subject: Subject,
    motion: Motion,
    *,
    recording: Recording | None = None,
    method: Method = "paper",
    max_uncertainty: float = MAX_UNCERTAINTY,
) -> ControlTable:
    """Compute the control signal of a recording.

    Parameters
    ----------
    subject : Subject
    motion : Motion
        Of that subject.
    recording : Recording, optional
        That the motion was tracked from: which markers are hidden says how uncertain c
        is. Without it, and where :class:`FrameSolver` does not know the map, that is
        NaN, and c is known while the chain is in sight.
    method : {"paper", "proximal", "intent"}
        What reads c off the posture, see :mod:`ikns.nullspace.readout`.
    max_uncertainty : float
        c is NaN where its standard deviation is larger, by the rule of the live loop.

    Raises
    ------
    InvalidInput
        When the subject was calibrated without the method.
    """
    chain, readout = subject.chain, subject.readout(method)
    raw, inside, uncertainty, uncertain = recorded_signal(
        subject,
        motion,
        recording=recording,
        method=method,
        max_uncertainty=max_uncertainty,
    )
    c = np.clip(raw, 0.0, 1.0)
    names = signal_names(c.shape[1])
    known_worth = uncertainty[:, : c.shape[1]]
    speed = motion.hand_speed(chain)
    rows = np.column_stack(
        [motion.time, c, speed, inside, motion.residual, known_worth]
    )
    known = np.isfinite(raw).all(axis=1)
    clipped = (raw < 0) | (raw > 1)
    rejections = count_rejections(motion, chain)
    summary = {
        "frames": len(c),
        "frames_without_signal": int((~known).sum()),
        "frames_uncertain": uncertain,
        "frames_rejected": sum(rejections.values()),
        "rejections": rejections,
        "inside_share": float((inside & known).sum() / max(known.sum(), 1)),
        "inside_means": inside_means(readout),
        "jumps_outside": _jumps_outside(readout, motion, c, inside),
        "c_median": finite_median(c[:, 0]),
        "clipped_share": float(clipped.any(axis=1).sum() / max(known.sum(), 1)),
        "residual_median_m": finite_median(motion.residual),
        "uncertainty_median": finite_median(uncertainty[:, 0]),
    }
    columns = ["time_s", *names, "hand_speed_m_s", "inside", "residual_m"]
    columns += [f"{name}_uncertainty" for name in names]
    return ControlTable(columns, rows, summary)


class RecordedSignal(NamedTuple):
    """c of a recording before it is clipped, and where it can be relied upon."""

    raw: NDArray[np.float64]  # (T, d), NaN where it is too uncertain or unknown
    inside: NDArray[np.bool_]  # (T,), whether the arm is known to be where taught
    uncertainty: NDArray[np.float64]  # (T, d), standard deviations; NaN where unknown
    uncertain: int  # frames whose markers are believed, but c is too uncertain


def recorded_signal(
    subject: Subject,
    motion: Motion,
    *,
    recording: Recording | None = None,
    method: Method = "paper",
    max_uncertainty: float = MAX_UNCERTAINTY,
) -> RecordedSignal:
    """Read c off a recording, unclipped; arguments as for :func:`control_table`."""
    learned, chain = subject.null_space_map, subject.chain
    if not max_uncertainty > 0:
        raise InvalidInput(
            f"max_uncertainty must be above 0, found {max_uncertainty:g}."
        )
    readout, n = subject.readout(method), len(motion.time)
    if recording is None or not _knows(readout):
        inside = readout.inside(subject.skeleton, motion)
        uncertainty, uncertain = np.full((n, learned.directions_.shape[1]), np.nan), 0
        raw = readout.control_signal(subject.skeleton, motion)
    else:
        c, uncertainty = _read(subject, readout, motion, recording)
        raw, within = readout.of_postures(subject.skeleton, motion.q)
        if isinstance(readout.map, IntentMap) and readout.map.leash:
            raw = c[:, 0]  # less what hidden markers shift
        if raw.ndim == 1:
            uncertainty = uncertainty[:, :1]
        certain = uncertainty.reshape(raw.shape) <= max_uncertainty
        known = motion.believed(chain)
        believed = known.reshape(n, *[1] * (raw.ndim - 1))
        uncertain = int((~certain & believed).reshape(n, -1).any(axis=1).sum())
        raw = np.where(certain & believed, raw, np.nan)
        inside = within & known
    return RecordedSignal(raw.reshape(n, -1), inside, uncertainty, uncertain)


def uncertain_sentence(summary: dict[str, Any], max_uncertainty: float) -> str:
    """Say why c is unknown in many frames of a :class:`ControlTable`; else empty."""
    unknown, frames = summary["frames_uncertain"], summary["frames"]
    if unknown <= _MANY * frames:
        return ""
    return (
        f"c is unknown in {unknown} of {frames} frames, as its standard deviation is "
        f"above {max_uncertainty:g}: the range learned there is small, or markers are "
        "hidden; calibrate with wider swings of the elbow, or show c all the same with "
        "a larger --max-uncertainty."
    )


def inside_means(readout: Readout) -> str:
    """Say in words where the hand is while ``inside`` is 1."""
    if isinstance(readout.map, IntentMap):
        return "where natural movement was taught"
    if readout.map.interpolation == "smooth":
        return "in the ellipsoid around the places"
    return "in the volume of the places"


def jump_sentence(method: str, jumps: int) -> str:
    """Warn of jumps outside the volume; empty without any."""
    if not jumps:
        return ""
    remedy = "calibrate with --outside project"
    if method == "paper":
        remedy += ", or read c with --method intent"
    times = "once" if jumps == 1 else f"{jumps} times"
    return (
        f"c jumps {times} by more than {_JUMP:g} from one frame to the next where the "
        "hand is outside the volume of the places, as the map of the nearest place "
        f"counts there; {remedy}."
    )


def _jumps_outside(
    readout: Readout, motion: Motion, c: NDArray[np.float64], inside: NDArray[np.bool_]
) -> int:
    """Count jumps of c where the nearest point changes or the hand crosses the hull."""
    learned = readout.map
    if isinstance(learned, IntentMap) or learned.interpolation == "smooth":
        return 0
    if learned.outside != "nearest":
        return 0
    hand = np.nan_to_num(motion.task_position(readout.chain))
    nearest = nearest_center(hand, learned.centers_, radius=np.inf)[0]
    other = (np.diff(nearest) != 0) & ~inside[1:] & ~inside[:-1]
    other |= inside[1:] != inside[:-1]
    far = (np.abs(np.diff(c, axis=0)) > _JUMP).any(axis=1)
    return int((other & far).sum())


def _knows(readout: Readout) -> bool:
    """Whether the live kernel knows a readout's map."""
    if readout.method != "paper":
        return True
    known = NaturalNeighborInterpolator, NearestPoint
    learned = readout.map
    return isinstance(learned, NullSpaceMap) and isinstance(
        learned.interpolator_, known
    )


def _read(
    subject: Subject, readout: Readout, motion: Motion, recording: Recording
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the signals of a recording and their standard deviation, (T, d) each."""
    skeleton, chain = subject.skeleton, subject.chain
    solver = FrameSolver(skeleton, subject.null_space_map, chain, readout=readout)
    markers = skeleton.marker_set.pick(recording.labels, recording.markers)
    believed = motion.believed(chain)
    return solver.read(motion.q, markers, motion.time, believed)
