"""The judge of static trials: still, of a person's size, and a posture of a person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ikns.arrays import Array
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import Finding, Severity, say_markers
from ikns.calibration.judge.plausible import (
    LIKELY_BEYOND,
    LIKELY_OFFSET,
    LIKELY_SIZE,
    Assumed,
    assumed,
)
from ikns.calibration.judge.repair import Repair, find_repair
from ikns.calibration.judge.sides import mirror_image, renaming
from ikns.calibration.judge.trace_findings import judge_traces
from ikns.calibration.judge.unit import size_ratio, wrong_unit
from ikns.calibration.size_fit import SizeFit
from ikns.errors import NotEnoughData
from ikns.numerics.rigid import aligned
from ikns.recording.recording import Recording

#: Largest displacement of a marker of a person who stands still, without the sway of
#: the whole body, m: as much as markers are misplaced on the skin (10 mm for most of a
#: set). Eight real static trials have 0.3 to 3.2 mm, simulated ones 2 to 7 mm.
STILL_MARKERS = 0.010
#: Beyond these no one is; between them and the likely ones it is said, but used.
_IMPOSSIBLE_OFFSET, _IMPOSSIBLE_BEYOND = 10.0, np.radians(30.0)
#: Whatever a marker set promises, hands misplace markers by this much, m, and by no
#: more than this.
_MISPLACED, _IMPOSSIBLY_MISPLACED = 0.02, 0.04
#: Sizes of a body beside the generic adult's: from a small child to the tallest man.
_SIZES = (0.5, 1.5)
#: Markers named in a sentence.
_NAMED = 3


def marker_displacement(markers: Array) -> Array:
    """Root mean square displacement of each marker without body sway, (M,) m."""
    seen = np.all(np.isfinite(markers), axis=2)
    middle = np.full(markers.shape[1:], np.nan)
    some = seen.any(axis=0)
    middle[some] = np.nanmean(markers[:, some], axis=0)
    distances = np.linalg.norm(aligned(markers, middle) - middle, axis=2)
    rms = np.zeros(seen.shape[1])
    measured = np.isfinite(distances).any(axis=0)
    rms[measured] = np.sqrt(np.nanmean(distances[:, measured] ** 2, axis=0))
    return rms


def movement(where: str, labels: Sequence[str], markers: Array) -> list[Finding]:
    """Say that a person moves who should stand still; markers (T, M, 3) m."""
    spread = marker_displacement(markers)
    if not len(spread) or spread.max() <= STILL_MARKERS:
        return []
    worst = np.argsort(-spread)[:_NAMED]
    names = tuple(labels[i] for i in worst if spread[i] > STILL_MARKERS)
    return [
        Finding(
            "moved",
            "refuse",
            where,
            f"the person moved: {names[0]} by {1000 * spread[worst[0]]:.0f} mm",
            "expected a static trial in which no marker moves by more than "
            f"{1000 * STILL_MARKERS:.0f} mm",
            names,
        )
    ]


def refuse_moving(static: Recording, worn: MarkerSet) -> None:
    """Refuse a static trial in which the person moves, as :func:`ikns.scale` does.

    Raises
    ------
    NotEnoughData
        With the marker that moves the most.
    """
    where, labels = static.source, worn.labels
    markers = worn.pick(static.labels, static.markers)
    _, spoiled, measured = judge_traces(where, labels, static.time, markers)
    if moved := movement(where, labels, measured[~spoiled]):
        raise NotEnoughData(moved[0].sentence)


def body_size(where: str, markers: Array, body: Skeleton) -> list[Finding]:
    """Say that markers (T, M, 3) m are not those of a body of a person's size."""
    expected = body.markers_in_world(body.neutral())
    wrong = wrong_unit(size_ratio(markers, expected))
    if wrong is None:
        return []
    times, mistake = wrong
    return [
        Finding(
            "unit",
            "refuse",
            where,
            f"the body is {times:.3g} times as large as expected for a person",
            f"probably {mistake}: correct the unit in the file"
            if mistake
            else "expected positions in the file's own unit: export it again",
        )
    ]


def judge_posture(
    where: str,
    reference: Skeleton,
    target: Array,
    fit: SizeFit,
    *,
    in_file: Sequence[str],
    repair: bool = True,
) -> list[Finding]:
    """Judge what the fit to a static trial had to assume.

    Parameters
    ----------
    where : str
        Name of the recording.
    reference : Skeleton
        The body with the markers at their nominal places.
    target : (M, 3) array
        Mean marker positions, m; NaN where never seen.
    fit : SizeFit
        What :func:`ikns.calibration.size_fit.fit_sizes` found.
    in_file : sequence of M str
        How the recording's file names the markers.
    repair : bool
        Whether to look for the exchange of names that explains it, which takes ten
        times as long as the fit.
    """
    found = assumed(reference, target, fit)
    tried = repair and found.suspect
    mended = find_repair(reference, target, found) if tried else None
    if mended is not None:
        return [_exchanged(where, reference.marker_set.labels, mended, found, in_file)]
    findings = _lengths(where, found, fit)
    if not fit.converged:
        findings.append(
            Finding(
                "not converged",
                "refuse",
                where,
                "the body could not be fitted to the markers",
                "expected markers of the set on one person",
            )
        )
    return findings + _places(where, reference, found) + _joints(where, reference, fit)


def _exchanged(
    where: str,
    labels: Sequence[str],
    repair: Repair,
    found: Assumed,
    in_file: Sequence[str],
) -> Finding:
    severity: Severity = "refuse" if repair.sure else "warn"
    if repair.mirrored:
        image = mirror_image(where, "then everything fits", or_sides=True)
        return replace(image, severity=severity)
    names = tuple(labels[i] for pair in repair.exchanges for i in pair)
    pairs = [f"{a} and {b}" for a, b in zip(names[::2], names[1::2], strict=True)]
    worst = int(np.nanargmax(found.offsets_sd))
    return Finding(
        "exchanged",
        severity,
        where,
        f"{', '.join(pairs)} have swapped names ({_misfit(labels, worst, found)})",
        f"swap {', and '.join(pairs)}: then everything fits "
        f"({renaming(in_file, repair.exchanges)})",
        names,
    )


def _misfit(labels: Sequence[str], worst: int, found: Assumed) -> str:
    if found.offsets_sd[worst] <= LIKELY_OFFSET and found.beyond.max() > LIKELY_BEYOND:
        return (
            f"a joint would be {np.degrees(found.beyond.max()):.0f} deg beyond limits"
        )
    return _far(labels, worst, found)


def _far(labels: Sequence[str], i: int, found: Assumed) -> str:
    return (
        f"{labels[i]} would be {1000 * found.offsets[i]:.0f} mm from its place, "
        f"{found.offsets_sd[i]:.0f} sd"
    )


def _places(where: str, reference: Skeleton, found: Assumed) -> list[Finding]:
    off = np.nan_to_num(found.offsets_sd)
    far = [
        int(i)
        for i in np.argsort(-off)
        if off[i] > LIKELY_OFFSET and found.offsets[i] > _MISPLACED
    ]
    if not far:
        return []
    labels = reference.marker_set.labels
    impossible = (off[far] > _IMPOSSIBLE_OFFSET) & (
        found.offsets[far] > _IMPOSSIBLY_MISPLACED
    )
    return [
        Finding(
            "misplaced",
            "refuse" if impossible.any() else "warn",
            where,
            "; ".join(_far(labels, i, found) for i in far[:_NAMED]),
            f"check {say_markers([labels[i] for i in far])}: a wrong name, or not "
            "where the marker set has it",
            tuple(labels[i] for i in far),
        )
    ]


def _joints(where: str, reference: Skeleton, fit: SizeFit) -> list[Finding]:
    angles = fit.q[-len(reference.joint_names) :]
    beyond = np.maximum(reference.lower - angles, angles - reference.upper)
    worst = int(np.argmax(beyond))
    if beyond[worst] <= LIKELY_BEYOND:
        return []
    name = reference.joint_names[worst]
    return [
        Finding(
            "beyond limits",
            "refuse" if beyond[worst] > _IMPOSSIBLE_BEYOND else "warn",
            where,
            f"{name} would be at {np.degrees(angles[worst]):.0f} deg",
            f"expected {np.degrees(reference.lower[worst]):.0f} to "
            f"{np.degrees(reference.upper[worst]):.0f} deg: markers near it are "
            "mislabeled or misplaced",
            tuple(
                m.label
                for m in reference.marker_set.markers
                if m.link.startswith(name.split("_")[0])
            ),
        )
    ]


def _lengths(where: str, found: Assumed, fit: SizeFit) -> list[Finding]:
    names, factors = list(SEGMENTS), np.exp(fit.log_sizes)
    worst = int(np.argmax(np.abs(found.sizes_sd)))
    impossible = ~((factors > _SIZES[0]) & (factors < _SIZES[1]))
    if impossible.any():
        worst = int(np.argmax(impossible * np.abs(fit.log_sizes)))
    elif abs(found.sizes_sd[worst]) <= LIKELY_SIZE:
        return []
    return [
        Finding(
            "length",
            "refuse" if impossible.any() else "warn",
            where,
            f"the {names[worst].replace('_', ' ')} is {factors[worst]:.2f} times an "
            f"average adult's, {found.sizes_sd[worst]:+.1f} sd",
            "expected an adult: check names and unit",
        )
    ]
