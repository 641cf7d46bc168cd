"""Markers of a segment that slip together during a recording: a band that slides.

Their distances stay the same, and the body follows for a part of the way, so that no
residual is large. But at one posture they lie elsewhere after it than before: the mean
distance of a segment's markers from the body is a smooth function of posture, with a
step at that moment. What turns with the joint, as a band about a forearm, cannot be
told; nor can a slip where joints take it up: with one marker on a clavicle that is
free, the body follows a slip of 30 mm to within 5. What slipped before the recording
began is looked for in `offsets`. Fewer than three markers are no band, and their skin
makes such steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import Finding
from ikns.calibration.turning_skin import CLUSTER

#: Least step of a segment's mean distance from the body, m, for markers of weight 1;
#: what is weighed more gives way less. A slip of 20 mm makes a step of 5 to 18. Clean
#: recordings have up to 7 mm (benchmarks/silent_faults.py).
_STEP = 0.010
#: The step must be so many of its own standard deviations.
_SURE = 5.0
#: Segments of an arm on which bands slide.
_PARTS = ("upper_arm", "forearm", "hand")
#: Least frames looked at, and on each side of the step.
_FEWEST, _BESIDE = 30, 6
#: Joints that turn by less than this say nothing about the skin, rad; and those of the
#: wrist take up a slip themselves.
_TURNS, _LEFT_OUT = np.radians(1.0), "wrist"
#: Squared length of what a step has that posture does not explain, frames: a step at
#: which the posture changes for good is not told.
_OWN_PART = 1.0


class Slip(NamedTuple):
    """A step of a segment's markers."""

    link: str
    frame: int  # the first one after it, among those looked at
    step: float  # m


def find_slips(
    skeleton: Skeleton, q: Array, offsets: Mapping[str, Array]
) -> list[Slip]:
    """Find the segments of the arms whose markers slipped together, the worst first.

    Parameters
    ----------
    skeleton : Skeleton
    q : (T, nq) array
        Poses of some frames.
    offsets : dict of (T, 3) arrays
        Of each segment's markers from the body, m, as
        :func:`ikns.calibration.judge.offsets.offsets_in_links` returns them.
    """
    found: list[Slip] = []
    names = skeleton.joint_names
    for link, apart in offsets.items():
        side, _, part = link.partition("_")
        if part not in _PARTS:
            continue
        own = [
            i
            for i, name in enumerate(names)
            if name.startswith(side) and _LEFT_OUT not in name
        ]
        worn = [m for m in skeleton.marker_set.markers if m.link == link and m.weight]
        if len(worn) < CLUSTER:
            continue
        limit = _STEP / np.sqrt(max(1.0, *(marker.weight for marker in worn)))
        if (step := _step(q[:, -len(names) :][:, own], apart, limit)) is not None:
            found.append(Slip(link, *step))
    return sorted(found, key=lambda slip: -slip.step)


def judge_slips(
    where: str,
    skeleton: Skeleton,
    time: Array,
    q: Array,
    offsets: Mapping[str, Array],
) -> list[Finding]:
    """Say which segment's markers slipped; arguments as above, times (T,) s."""
    slips = find_slips(skeleton, q, offsets)
    # The body moves with what slipped, and takes others along: the worst is named.
    return [
        Finding(
            "slipped",
            "warn",
            where,
            f"the markers of the {link.replace('_', ' ')} and those next to it moved "
            f"{1000 * step:.0f} mm or more relative to each other, at about "
            f"{time[frame]:.1f} s",
            f"use the part before it, for example with --to {time[frame - 1]:.2f}, and "
            "calibrate again for the rest",
            tuple(m.label for m in skeleton.marker_set.markers if m.link == link),
        )
        for link, frame, step in slips[:1]
    ]


def _step(angles: Array, apart: Array, limit: float) -> tuple[int, float] | None:
    """Find the step of apart (T, 3) m that posture (T, J) rad does not explain."""
    seen = np.flatnonzero(np.isfinite(apart).all(axis=1) & np.isfinite(angles).all(1))
    n = len(seen)
    if n < _FEWEST:
        return None
    angles, apart = angles[seen], apart[seen]
    turning = angles.std(axis=0) > _TURNS
    posture = np.column_stack([np.ones(n), angles[:, turning]])
    basis = np.linalg.qr(posture)[0]
    # A row a step: 0 before it and 1 from there on; less what posture explains.
    after = (np.arange(n) >= np.arange(_BESIDE, n + 1 - _BESIDE)[:, None]) * 1.0
    after -= after @ basis @ basis.T
    rest = apart - basis @ (basis.T @ apart)
    size = np.sum(after**2, axis=1)
    own = size > _OWN_PART
    if not own.any():
        return None
    step = np.where(own[:, None], after @ rest, 0.0) / size[:, None]
    gain = np.sum(step**2, axis=1) * size
    best = int(gain.argmax())
    length = float(np.linalg.norm(step[best]))
    freedom = 3 * (n - basis.shape[1] - 1)
    deviation = np.sqrt((np.sum(rest**2) - gain[best]) / freedom / size[best])
    if length <= max(limit, _SURE * float(deviation)):
        return None
    return int(seen[best + _BESIDE]), length
