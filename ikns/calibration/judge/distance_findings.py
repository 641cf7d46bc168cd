"""What is said of distances within segments that are not as they were."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.distances import Distances
from ikns.calibration.judge.finding import Finding, say_markers
from ikns.calibration.judge.sides import renaming
from ikns.calibration.turning_skin import ANYWHERE, CLUSTER

#: Largest change of a distance within a cluster from the static trial, m. Seven people
#: whose clusters sit on plates have up to 7.7 mm in 168 trials, and 1 mm in the middle
#: one; the forearm of the one with another plate is 16 to 22 mm off the others'.
#: Simulated skin that moves by 10 mm changes distances by 11.
_SHAPE = 0.015


def exchanged_names(
    where: str,
    labels: tuple[str, ...],
    exchanges: list[tuple[int, int]],
    in_file: Sequence[str],
) -> list[Finding]:
    """Name the markers of each exchange, those that share one together.

    The recording's file names the markers `in_file`.
    """
    groups: list[list[tuple[int, int]]] = []
    for pair in exchanges:
        joined = [g for g in groups if any(set(pair) & set(p) for p in g)]
        groups = [g for g in groups if g not in joined]
        groups.append([*(p for g in joined for p in g), pair])
    findings = []
    for group in groups:
        names = tuple(
            labels[i] for i in dict.fromkeys(i for pair in group for i in pair)
        )
        steps = ", then ".join(f"{labels[a]} and {labels[b]}" for a, b in group)
        findings.append(
            Finding(
                "exchanged",
                "refuse",
                where,
                f"{say_markers(names)} have swapped names: their distances to other "
                "markers of their segments are off",
                f"swap {steps}: then all distances fit ({renaming(in_file, group)})",
                names,
            )
        )
    return findings


def moved_marker(
    where: str, labels: tuple[str, ...], pairs: Indices, changes: Array
) -> Finding:
    """Name the two markers whose distance changes most; changes (N,) are signed, m."""
    total = np.bincount(pairs.ravel(), np.repeat(np.abs(changes), 2), len(labels))
    worst = int(total.argmax())
    own = np.flatnonzero((pairs == worst).any(axis=1))
    k = own[int(np.abs(changes[own]).argmax())]
    pair = [labels[i] for i in pairs[k]]
    size = f"{1000 * abs(changes[k]):.0f} mm"
    side = "farther apart" if changes[k] > 0 else "closer"
    return Finding(
        "marker moved",
        "warn",
        where,
        f"{pair[0]} and {pair[1]} are {size} {side} than in the static trial",
        f"check {labels[worst]}: a marker moved or has another marker's name",
        (labels[worst], *(name for name in pair if name != labels[worst])),
    )


def unsteady_pair(
    where: str, labels: tuple[str, ...], pairs: Indices, spread: Array
) -> Finding:
    """Name the two markers of a segment whose distance varies most."""
    k = int(spread.argmax())
    pair = tuple(labels[i] for i in pairs[k])
    return Finding(
        "marker moved",
        "warn",
        where,
        f"the distance of {pair[0]} and {pair[1]}, on one segment, varies by "
        f"{1000 * spread[k]:.0f} mm",
        f"check {pair[0]} and {pair[1]}: a marker has another marker's name",
        pair,
    )


def another_shape(
    where: str, worn: MarkerSet, found: Distances, pairs: Indices, apart: Array
) -> list[Finding]:
    """Say that a cluster has another shape than in the static trial.

    Pairs (N, 2) were `apart` (N,) m. Markers on landmarks go with the skin, and count
    on their own.
    """
    links = np.array([marker.link for marker in worn.markers])
    plate = np.array(
        [
            marker.weight >= 1 and np.linalg.norm(marker.placement_sd) > ANYWHERE
            for marker in worn.markers
        ]
    )
    change = np.abs(found.middle[pairs[:, 0], pairs[:, 1]] - apart)
    own = plate[pairs].all(axis=1) & np.isfinite(change)
    worst = {
        link: float(change[own & (links[pairs[:, 0]] == link)].max())
        for link in dict.fromkeys(links[pairs[own, 0]].tolist())
        if (plate & (links == link)).sum() >= CLUSTER
    }
    wrong = [link for link, size in worst.items() if size > _SHAPE]
    if not wrong:
        return []
    first = max(wrong, key=lambda link: worst[link])
    return [
        Finding(
            "another shape",
            "warn",
            where,
            f"the cluster on the {first.replace('_', ' ')} has another shape than in "
            f"the static trial, by {1000 * worst[first]:.0f} mm: another person's, or "
            "one that was put on again",
            "use the static trial of this person and wearing",
            tuple(worn.labels[m] for m in np.flatnonzero(plate & (links == first))),
        )
    ]
