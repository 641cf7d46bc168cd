"""What is said of distances within segments that are not as they were."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array, Indices
from ikns.calibration.judge.finding import Finding, say_markers
from ikns.calibration.judge.sides import renaming


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
