"""The body of a calibration, measured: scaled, judged, tracked, and fitted again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.body.chains import ChainLike, chain_sides
from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import set_worn
from ikns.body.skeleton import Skeleton
from ikns.calibration.exploration_fit import BodyReport, fit_explorations
from ikns.calibration.judged_motion import require_usable
from ikns.calibration.scaled_body import scaled_body
from ikns.calibration.scaling import ScalingReport, scale
from ikns.calibration.steps import FITTING, JUDGING, SCALING, silent
from ikns.errors import InvalidInput, naming
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.recording.recording import Recording


class MeasuredBody(NamedTuple):
    """A person's body and movements."""

    skeleton: Skeleton
    scaling: ScalingReport
    fitted: BodyReport | None  # None where the explorations do not show more
    explorations: tuple[Motion, ...]
    natural: tuple[Motion, ...]
    warnings: list[str]


def measured_body(
    static: Recording | None,
    explorations: Sequence[Recording],
    natural: Sequence[Recording],
    *,
    generic: Skeleton | None,
    marker_set: str | Path | MarkerSet | None,
    chain: ChainLike,
    min_static: float,
    progress: Callable[[str, int, int], None] | None,
    known: bool = False,
) -> MeasuredBody:
    """Scale the body, judge and track the recordings; see :func:`ikns.calibrate`.

    `known` says that the generic body is the person's, whose markers alone are fitted.
    The steps that are reported are those of :mod:`ikns.calibration.steps`.
    """
    say = progress or silent
    say(SCALING, 0, 1)
    body = Skeleton.load() if generic is None else generic
    worn = set_worn(marker_set, body.marker_set)
    if static is None:
        if generic is None:
            raise InvalidInput(
                "expected a static trial, or a body from stature, mass and sex."
            )
        skeleton, scaling = scaled_body(body, explorations, marker_set=worn)
        missing = [_assumed(scaling)]
    else:
        with naming(static.source):
            skeleton, scaling = scale(
                body,
                static,
                marker_set=worn,
                min_duration=min_static,
                known=known,
            )
        missing = _left_out(static, scaling, worn, explorations, chain)
    recordings = (*explorations, *natural)
    warned: list[str] = []
    for k, recording in enumerate(recordings):
        say(JUDGING, k, len(recordings))
        warned += require_usable(
            skeleton,
            recording,
            chain=chain,
            static=static,
            measured=static is not None,
        )
    tracked = _tracked(skeleton, recordings, chain, progress)
    fitted = None
    if static is not None:
        say(FITTING, 0, 1)
        skeleton, fitted = fit_explorations(
            body,
            skeleton,
            static,
            explorations,
            tracked[: len(explorations)],
            marker_set=worn,
            min_duration=min_static,
            known=known,
        )
    if fitted is not None:
        tracked = _tracked(skeleton, recordings, chain, progress)
    return MeasuredBody(
        skeleton,
        scaling,
        fitted,
        tracked[: len(explorations)],
        tracked[len(explorations) :],
        [*missing, *warned],
    )


def _assumed(scaling: ScalingReport) -> str:
    """Say what is not known without a static trial."""
    arm = [sd for name, sd in scaling.length_sd.items() if name.endswith("arm")]
    return (
        "no static trial: segments have the lengths of an average person of this "
        f"stature, and people differ from that by {1000 * min(arm):.0f} to "
        f"{1000 * max(arm):.0f} mm (standard deviation of an arm's segments)."
    )


def _tracked(
    skeleton: Skeleton,
    recordings: Sequence[Recording],
    chain: ChainLike,
    progress: Callable[[str, int, int], None] | None,
) -> tuple[Motion, ...]:
    """Marker inverse kinematics of every recording."""
    solver = MarkerIK(skeleton)
    return tuple(
        solver.track(
            recording,
            chain=chain,
            progress=progress and partial(progress, Path(recording.source).name),
        )
        for recording in recordings
    )


def _left_out(
    static: Recording,
    scaling: ScalingReport,
    worn: MarkerSet,
    recordings: Sequence[Recording],
    chain: ChainLike,
) -> list[str]:
    """Name markers, of the chain or seen later, that the static trial lacks.

    The other arm's may be missing from all of them: no one asked for it.
    """
    own = ("thorax", *chain_sides(chain))
    counts = np.array([marker.link.startswith(own) for marker in worn.markers])
    for recording in recordings:
        with naming(recording.source):
            markers = worn.pick(recording.labels, recording.markers)
        counts |= np.isfinite(markers).all(axis=2).any(axis=0)
    named = [label for label, count in zip(worn.labels, counts, strict=True) if count]
    return scaling.sentences(static.source, only=named)
