"""The static trial: mean marker positions, and the body with these markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import SIDES, chain_joints
from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import other_set, set_worn, too_few_of_set
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import Finding
from ikns.errors import MarkerMismatch, NotEnoughData
from ikns.numerics.rigid import aligned
from ikns.recording.recording import Recording

#: With this many frames that show every marker only these are averaged; noise is then a
#: third.
_COMPLETE_FRAMES = 10


def static_posture(
    generic: Skeleton,
    static: Recording,
    *,
    marker_set: str | Path | MarkerSet | None = None,
    min_duration: float = 1.0,
) -> tuple[Skeleton, Array, float]:
    """Average a static trial, and put the marker set on the generic body.

    Arguments as :func:`ikns.scale` takes them. Returns the generic body with the set at
    its nominal places, where joints of an arm without any marker are held; mean marker
    positions (M, 3) m, NaN where never seen; and the duration of the trial, s.
    """
    worn = set_worn(marker_set, generic.marker_set)
    if short := too_short(static, min_duration):
        raise NotEnoughData(short[0].sentence)
    target = _mean_posture(static, worn)
    absent = absent_joints(static.source, worn, seen_markers(target), static.labels)
    worn = replace(worn, held=worn.held + absent)
    return generic.with_nominal_markers(worn), target, trial_seconds(static)


def trial_seconds(static: Recording) -> float:
    """Return how long a trial is, s: from its first frame to the end of its last."""
    if len(static.time) < 2:
        return 0.0
    return float(static.time[-1] - static.time[0]) + 1 / static.rate


def too_short(static: Recording, min_duration: float) -> list[Finding]:
    """Say that a static trial is shorter than so many seconds."""
    seconds = trial_seconds(static)
    if seconds >= min_duration * (1 - 1e-6):
        return []
    return [
        Finding(
            "short",
            "refuse",
            static.source,
            f"the static trial lasts {seconds:.2f} s, expected at least "
            f"{min_duration:g} s",
            f"record a longer one, or accept it with --min-static "
            f"{np.floor(10 * seconds) / 10:g}",
        )
    ]


def _mean_posture(static: Recording, worn: MarkerSet) -> Array:
    """Mean marker positions, the sway of the whole body removed, (M, 3) m."""
    markers = worn.pick(static.labels, static.markers)
    seen = seen_markers(markers)
    if not seen.any():
        if (worn.columns(static.labels) >= 0).any():
            raise MarkerMismatch(
                f"{static.source}: no marker of {worn.name} is in any frame; export "
                "the labeled trajectories."
            )
        raise MarkerMismatch(too_few_of_set(static.source, worn, static.labels))
    # No one stands quite still, so markers averaged over different frames do not match:
    # where enough frames show everything, only those count.
    complete = seen[:, seen.any(axis=0)].all(axis=1)
    if complete.sum() >= _COMPLETE_FRAMES:
        markers, seen = markers[complete], seen[complete]
    reference = markers[int(np.argmax(seen.sum(axis=1)))]
    still = aligned(markers, reference)
    known = seen_markers(still)
    count = known.sum(axis=0)
    mean = np.full((len(worn.markers), 3), np.nan)
    some = count > 0
    total = np.where(known[..., None], still, 0.0).sum(axis=0)
    mean[some] = total[some] / count[some, None]
    return mean


def absent_joints(
    source: str, worn: MarkerSet, seen: Mask, labels: Sequence[str]
) -> tuple[str, ...]:
    """Joints of an arm without any marker; one segment without markers is an error.

    `seen` (M,) says which markers of the set the recordings of this `source` show,
    which have these `labels`.
    """
    links = {m.link for m in worn.markers}
    shown = {m.link for m, s in zip(worn.markers, seen, strict=True) if s}
    absent: tuple[str, ...] = ()
    for side in SIDES:
        arm = {link for link in links if link.startswith(side)}
        if arm and not arm & shown:
            absent += tuple(chain_joints(f"{side}_arm_clavicle"))
            links -= arm
    bare = sorted(links - shown)
    if bare:
        wanted = [m.label for m in worn.markers if m.link == bare[0]]
        other = other_set(worn, labels, calibrated=False)
        advice = "" if other is None else f"; {other[0]}: {other[1]}"
        raise MarkerMismatch(
            f"{source}: the segment {bare[0]} has no marker; expected at least "
            f"one of {', '.join(wanted)} of {worn.name}{advice}."
        )
    return tuple(joint for joint in absent if joint not in worn.held)


def seen_markers(markers: Array) -> Mask:
    """Which markers (..., 3) were seen, (...)."""
    return np.asarray(np.isfinite(markers).all(axis=-1))
