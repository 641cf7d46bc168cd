"""Whether a person's body can follow the markers of a recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.distances import quantile
from ikns.calibration.judge.finding import Finding, say_markers
from ikns.calibration.judge.offsets import (
    UsualFit,
    judge_offsets,
    offsets_in_links,
)
from ikns.calibration.judge.pose_cost import PoseCost
from ikns.calibration.judge.sides import (
    mirror_image,
    other_side,
    renaming,
    sides_exchanged,
)
from ikns.calibration.judge.slips import judge_slips
from ikns.calibration.turning_skin import turning_labels, with_free_turn
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording

#: Frames looked at, evenly spaced.
_GLANCES = 60
#: Largest distance of markers from the body that people have, m: weighted root mean
#: square in the median frame. Seven people with clusters have 10 to 22 mm, one with
#: single markers 9 mm, simulated ones 2 to 3 mm.
MOST_RESIDUAL = 0.03
#: From here on it is no body with one marker astray: three times that.
_NO_BODY = 0.1
#: The same for a single marker, over the frames; and where a wrong name is suspected.
_MOST_MARKER, _SUSPECT_MARKER = 0.08, 0.05
#: A joint beyond its limit by more than this, rad, in more than this share of frames.
_BEYOND, _SHARE = np.radians(30.0), 0.2
#: Share of frames in which inverse kinematics may fail.
_MOST_FAILED = 0.1
#: Another person: so many times the distance of the markers from the body that there
#: was at calibration, and more than this, m. In all 168 trials of seven people of
#: UE_ADL, calibrated with four each, it is at most 1.1 times that. With 24 of the 42
#: other people it is twice that in some trial; a name before the labels tells all.
_MORE, _ANYONE = 2.0, 0.01
#: What skin and modeling leave between a marker and the body, m.
_SKIN_SD = 0.02
#: Skin turns where the residual is at most this share of what it is with a cluster
#: fixed to the bone, and less by this much, m. In eight trials of UE_ADL, with sets of
#: their own and all weights 1, six people have 0.48 to 0.78 of it, the one whose skin
#: follows best 0.83 to 0.92.
_LEFT_BY_SKIN, _SKIN_TURNS = 0.85, 0.003
#: Frames on which exchanges are tried, and the share of the cost that one may leave.
_TRIED, _LEFT = 3, 0.3


def judge_tracking(
    where: str,
    skeleton: Skeleton,
    time: Array,
    markers: Array,
    *,
    in_file: Sequence[str],
    usual: UsualFit | None = None,
) -> list[Finding]:
    """Judge how a skeleton follows its markers (T, M, 3), m; NaN where not seen.

    At times (T,), s. The recording's file names them `in_file`; `usual` is how they
    lay on the body at calibration.
    """
    worn = skeleton.marker_set
    rows = _glances(markers)
    some = markers[rows]
    if not len(some):
        return []
    motion, placed, residual, off = _follow(skeleton, some)
    with np.errstate(invalid="ignore"):
        # Also of frames whose markers are not believed: they are in question here.
        angles = motion.q[:, -len(skeleton.joint_names) :]
        beyond = np.maximum(skeleton.lower - angles, angles - skeleton.upper)
        share = (beyond > _BEYOND).mean(axis=0)
    if image := _mirrored(where, skeleton, some, residual):
        return [image]
    if (
        off.max() > _SUSPECT_MARKER or residual > MOST_RESIDUAL or share.max() > _SHARE
    ) and (pair := _exchanged(skeleton, some, off)):
        first, second = (worn.labels[i] for i in pair)
        return [
            Finding(
                "exchanged",
                "refuse",
                where,
                f"{first} and {second} have swapped names: no posture fits "
                f"({1000 * residual:.0f} mm off)",
                f"swap {first} and {second}: then a posture fits "
                f"({renaming(in_file, [pair])})",
                (first, second),
            )
        ]
    findings = _residual(where, worn.labels, residual, off)
    if not findings and usual is not None and usual.residual is not None:
        findings = _unlike(where, float(np.nanmedian(motion.residual)), usual.residual)
    offsets = offsets_in_links(skeleton, motion.q, placed, some)
    elsewhere = judge_slips(where, skeleton, time[rows], motion.q, offsets)
    turning = _turning_skin(where, skeleton, some, residual)
    if not findings + elsewhere + turning:
        known = {} if usual is None else usual.offsets
        elsewhere = judge_offsets(where, skeleton, offsets, known)
    findings += elsewhere + turning
    if share.max() > _SHARE:
        worst = int(share.argmax())
        findings.append(
            Finding(
                "beyond limits",
                "warn",
                where,
                f"{skeleton.joint_names[worst]} is beyond its limits by more than "
                f"{np.degrees(_BEYOND):.0f} deg in {100 * share[worst]:.0f} % of the "
                "frames",
                "check the names and places of the markers next to it",
                _near(skeleton, skeleton.joint_names[worst]),
            )
        )
    if 1 - motion.converged.mean() > _MOST_FAILED:
        findings.append(
            Finding(
                "not converged",
                "warn",
                where,
                f"no posture was found in {100 * (1 - motion.converged.mean()):.0f} % "
                "of the frames",
                "expected the markers of the person of the static trial",
            )
        )
    return findings


def followed(skeleton: Skeleton, markers: Array) -> tuple[float, Array]:
    """Return how far a body is from its markers (T, M, 3) in a movement, m.

    The weighted root mean square in the median frame, and the median of each marker
    (M,), that of one of less weight less.
    """
    _, _, residual, off = _follow(skeleton, markers[_glances(markers)])
    return residual, off


def _glances(markers: Array) -> Indices:
    """Numbers of frames, evenly spaced, with three markers or more."""
    enough = np.flatnonzero(np.isfinite(markers).all(axis=2).sum(axis=1) >= 3)
    return enough[:: max(1, len(enough) // _GLANCES)]


def _turning_skin(
    where: str, skeleton: Skeleton, markers: Array, residual: float
) -> list[Finding]:
    """Say that a cluster turns with the skin of a forearm, which its set fixes."""
    worn = skeleton.marker_set
    labels = turning_labels(worn)
    if not labels:
        return []
    freed = skeleton.with_markers(with_free_turn(worn, labels))
    left = _follow(freed, markers)[2]
    if left > _LEFT_BY_SKIN * residual or residual - left < _SKIN_TURNS:
        return []
    return [
        Finding(
            "turning skin",
            "warn",
            where,
            f"markers and body are {1000 * residual:.0f} mm apart, and "
            f"{1000 * left:.0f} mm if {say_markers(labels)} turn with the skin",
            f"set free_turn = true for them in the marker set {worn.name}, and weight "
            "= 10 for the cluster on the hand, as `ikns markers new` does",
            labels,
        )
    ]


def _follow(skeleton: Skeleton, markers: Array) -> tuple[Motion, Array, float, Array]:
    """Track frames that are apart from each other.

    Returns the motion, where it has the markers (T, M, 3), the median frame's distance
    of all markers from the body, and each marker's (M,), m.
    """
    worn = skeleton.marker_set
    seconds = np.arange(len(markers), dtype=np.float64)
    motion = MarkerIK(skeleton).track(Recording(seconds, markers, worn.labels))
    placed = turned_markers(skeleton, motion.q, markers)
    weight = np.array([marker.weight for marker in worn.markers])
    apart = np.linalg.norm(placed - markers, axis=2)
    weighed = np.where(np.isfinite(apart), weight, 0.0).sum(axis=1)
    squares = np.nansum(weight * apart**2, axis=1)
    residual = float(np.median(np.sqrt(squares / weighed)))
    # What may give way more does not count more than it is weighed.
    off = np.nan_to_num(quantile(apart, 0.5)) * np.minimum(1.0, np.sqrt(weight))
    return motion, placed, residual, off


def _mirrored(
    where: str, skeleton: Skeleton, markers: Array, residual: float
) -> Finding | None:
    """Say that the body fits a mirror image, or with left for right."""
    if residual <= MOST_RESIDUAL:
        return None
    limit = min(MOST_RESIDUAL, residual / 2)
    image = _follow(skeleton, markers * [-1.0, 1.0, 1.0])[2]
    swapped = _follow(skeleton, markers[:, other_side(skeleton.marker_set.labels)])[2]
    if min(image, swapped) >= limit:
        return None
    then = "then a posture fits"
    if max(image, swapped) < limit:  # a body so even that both are the same
        return mirror_image(where, then, or_sides=True)
    made = mirror_image if image < swapped else sides_exchanged
    return made(where, then)


def _near(skeleton: Skeleton, joint: str) -> tuple[str, ...]:
    """Name the markers of a joint's arm."""
    side = joint.partition("_")[0]
    markers = skeleton.marker_set.markers
    return tuple(m.label for m in markers if m.link.startswith(side))


def _residual(
    where: str, labels: tuple[str, ...], residual: float, off: Array
) -> list[Finding]:
    """Say that the markers do not fit the body; `off` (M,) m is each one's distance."""
    worst = int(off.argmax())
    if residual <= MOST_RESIDUAL and off[worst] <= _MOST_MARKER:
        return []
    all_of_them = residual > MOST_RESIDUAL
    limit = MOST_RESIDUAL if all_of_them else _MOST_MARKER
    return [
        Finding(
            "residual",
            "refuse" if residual > _NO_BODY else "warn",
            where,
            f"markers and body are {1000 * residual:.0f} mm apart, {labels[worst]} "
            f"{1000 * off[worst]:.0f} mm",
            f"expected at most {1000 * limit:.0f} mm "
            f"{'' if all_of_them else 'for one marker '}with the static trial of "
            "this person and session: a marker moved, or has another marker's name",
            (labels[worst],),
        )
    ]


def _unlike(where: str, residual: float, usual: float) -> list[Finding]:
    """Say that the markers are much farther from the body than at calibration, m."""
    if not residual > max(_MORE * usual, _ANYONE):
        return []
    return [
        Finding(
            "another person",
            "warn",
            where,
            f"the markers are {1000 * residual:.0f} mm from the body in the median "
            f"frame, {1000 * usual:.0f} mm at calibration: another person, or markers "
            "that were put on again",
            "use this person's subject folder, or `ikns calibrate --rewear`",
        )
    ]


def _exchanged(
    skeleton: Skeleton, markers: Array, off: Array
) -> tuple[int, int] | None:
    """Find two markers that must be exchanged for any posture to fit."""
    weight = np.array([marker.weight for marker in skeleton.marker_set.markers])
    cost = PoseCost(skeleton, _SKIN_SD / np.sqrt(np.maximum(weight, 1e-3)))
    frames = markers[np.linspace(0, len(markers) - 1, _TRIED).astype(int)]
    before = sum(map(cost, frames))
    suspects = np.argsort(-off)[: max(3, int((off > _SUSPECT_MARKER).sum()))]
    best: tuple[float, tuple[int, int]] = (_LEFT * before, (-1, -1))
    for a in suspects.tolist():
        for b in range(len(off)):
            trial = frames.copy()
            trial[:, [a, b]] = frames[:, [b, a]]
            after = 0.0
            for frame in trial:
                after += cost(frame)
                if after >= best[0]:
                    break
            else:
                best = after, (min(a, b), max(a, b))
    return best[1] if best[1][0] >= 0 else None
