"""How well the cameras measured: noise, digits, and how much was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ikns.arrays import Array
from ikns.calibration.judge.finding import Finding, say_markers
from ikns.calibration.judge.traces import repeated

#: Noise of cameras that work, m: clean recordings have up to 1.1 mm (real, seven people
#: at 100 Hz) with what a fast hand's acceleration adds, simulated ones 1.
_NOISE = 0.003
#: What a hand's acceleration adds to that, m/s^2: the usual one of people who reach.
_ACCELERATION = 2.0
#: Positions rounded to more than this, m, lose what the cameras saw; whole millimeters
#: are as good as a calm camera's noise. Told from so many different values.
_ROUNDED, _VALUES = 0.0015, 5
#: Share of the markers of a set that may be missing, over frames, of those ever seen:
#: clean recordings lack 1 %.
_MISSING = 0.3


def judge_quality(
    where: str, labels: Sequence[str], time: Array, markers: Array
) -> list[Finding]:
    """Judge markers (T, M, 3) m, NaN where not seen, at times (T,) s."""
    rounded = _rounded_to(markers)
    findings = [] if rounded is None else [_coarse(where, rounded)]
    new = ~repeated(markers)
    noise = marker_noise(markers[new])
    step = float(np.median(np.diff(time[new]))) if new.sum() > 1 else 0.0
    limit = _NOISE + _ACCELERATION * step**2
    loud = np.flatnonzero(noise > limit)
    if loud.size and rounded is None:
        loud = loud[np.argsort(-noise[loud])]
        names = tuple(labels[i] for i in loud.tolist())
        findings.append(
            Finding(
                "noise",
                "warn",
                where,
                f"{say_markers(names)} jitter by {1000 * noise[loud[0]]:.0f} mm from "
                "frame to frame",
                f"expected less than {1000 * limit:.0f} mm: calibrate the cameras "
                "again, or check how these markers were reconstructed",
                names,
            )
        )
    seen = np.all(np.isfinite(markers), axis=2)
    worn = seen.any(axis=0)
    missing = 1 - float(seen[:, worn].mean()) if worn.any() else 0.0
    if missing > _MISSING:
        findings.append(
            Finding(
                "gaps",
                "warn",
                where,
                f"{100 * missing:.0f} % of the positions are missing",
                f"expected less than {100 * _MISSING:.0f} %: label the recording "
                "completely, or move the cameras",
            )
        )
    return findings


def marker_noise(markers: Array) -> Array:
    """Noise of each marker's coordinates, (M,) m; 0 where never seen three times.

    From second differences, which leave little of a movement.

    >>> still = np.random.default_rng(0).normal(0, 0.002, (1000, 1, 3))
    >>> print(marker_noise(still).round(3))
    [0.002]
    """
    noise = np.zeros(markers.shape[1])
    bends = np.abs(markers[2:] - 2 * markers[1:-1] + markers[:-2])
    known = np.asarray(np.isfinite(bends).all(axis=2))
    for column, bend in enumerate(np.moveaxis(bends, 1, 0)):
        own = bend[known[:, column]]
        if len(own):
            # The median of |x| of a normal distribution is 0.6745 of its deviation, and
            # a second difference has sqrt(6) of the noise.
            noise[column] = float(np.median(own)) / (0.6745 * np.sqrt(6))
    return noise


def _rounded_to(markers: Array) -> float | None:
    """To what positions are rounded, m; None for too fine to matter."""
    values = markers[np.isfinite(markers)]
    steps = np.diff(np.unique(np.round(values[:: max(1, values.size // 3000)], 7)))
    if len(steps) < _VALUES or steps.min() <= _ROUNDED:
        return None
    return float(steps.min())


def _coarse(where: str, step: float) -> Finding:
    return Finding(
        "coarse",
        "warn",
        where,
        f"positions are rounded to {1000 * step:.3g} mm",
        "export them with a digit after the millimeter",
    )
