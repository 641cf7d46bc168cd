"""Whether a body has the size of a person, or of a wrong unit or calibration."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array, Indices
from ikns.calibration.judge.distances import quantile
from ikns.calibration.judge.finding import Finding

#: Units that are taken for one another: how many times too large positions then are.
_FACTORS = {
    1000.0: "millimeters read as meters",
    100.0: "centimeters read as meters",
    25.4: "millimeters read as inches",
    10.0: "millimeters read as centimeters",
    1 / 10: "centimeters read as millimeters",
    1 / 25.4: "inches read as millimeters",
    1 / 100: "meters read as centimeters",
    1 / 1000: "meters read as millimeters",
}
#: Postures and people differ by less than this factor from one another: an adult of
#: 1.4 to 2.1 m against 1.69 m, arms hanging or stretched out.
_ALIKE = 1.9
#: Shorter distances say nothing about a size, m.
_SHORTEST = 0.01
#: Another scale: the median ratio of at least so many distances within segments to
#: those of the static trial differs from one by this share, and by more than half of
#: them scatter. 168 clean recordings of seven people have up to 0.0024.
_SCALED, _FEWEST_RATIOS = 0.015, 10


def wrong_unit(ratio: float) -> tuple[float, str] | None:
    """Factor by which a body is too large, and what mistake of units that is.

    None for a ratio to the expected size that a person can have, the words empty for
    one that no mistake explains.

    Examples
    --------
    >>> wrong_unit(1.2), wrong_unit(0.11)
    (None, (0.1, 'centimeters read as millimeters'))
    """
    if not np.isfinite(ratio) or 1 / _ALIKE < ratio < _ALIKE:
        return None
    known = np.array(list(_FACTORS))
    near = known[int(np.argmin(np.abs(np.log(known / ratio))))]
    # Half way between 10 and 25.4 is a factor of 1.59.
    if abs(np.log(near / ratio)) < np.log(1.59):
        return float(near), _FACTORS[float(near)]
    return ratio, ""


def size_ratio(markers: Array, expected: Array) -> float:
    """How large markers (T, M, 3) are beside the same ones on a body (M, 3).

    Median over some frames of the ratio of their spreads about their middles; NaN where
    no frame shows four of them.
    """
    ratios = []
    for frame in markers[:: max(1, len(markers) // 20)]:
        seen = np.isfinite(frame).all(axis=1)
        if seen.sum() >= 4:
            # Medians: a marker or two may be anywhere.
            spread = [
                np.median(np.linalg.norm(p - np.median(p, axis=0), axis=1))
                for p in (frame[seen], expected[seen])
            ]
            if spread[1] > 0:
                ratios.append(spread[0] / spread[1])
    return float(np.median(ratios)) if ratios else float("nan")


def size_beside(
    where: str, markers: Array, pairs: Indices, apart: Array
) -> list[Finding]:
    """Compare distances within segments (N,) with those on the person, m."""
    step = max(1, len(markers) // 60)
    first, second = np.moveaxis(markers[::step][:, pairs[apart > _SHORTEST]], 2, 0)
    ratio = np.linalg.norm(first - second, axis=2) / apart[apart > _SHORTEST]
    seen = ratio[np.isfinite(ratio)]
    wrong = wrong_unit(float(np.median(seen))) if seen.size else None
    if wrong is None:
        usual = quantile(ratio, 0.5)
        return _scaled(where, usual[np.isfinite(usual)])
    return [
        Finding(
            "unit",
            "refuse",
            where,
            f"the body is {wrong[0]:.3g} times as large as in the static trial",
            f"probably {wrong[1]}: correct the unit in one of the files"
            if wrong[1]
            else "expected the same person in the same unit",
        )
    ]


def _scaled(where: str, ratio: Array) -> list[Finding]:
    """Say that distances (N,) are all so many times those of the static trial."""
    if len(ratio) < _FEWEST_RATIOS:
        return []
    logs = np.log(ratio)
    middle = float(np.median(logs))
    # Quantiles of 1/4: markers of one segment may have moved on the skin.
    scatter = float(np.subtract(*np.quantile(logs, [0.75, 0.25])))
    if abs(middle) <= _SCALED or scatter > abs(middle):
        return []
    return [
        Finding(
            "scale",
            "refuse",
            where,
            f"all distances within segments are {np.exp(middle):.3f} times those of "
            "the static trial",
            "use the static trial of this person, recorded with the same calibration "
            "of the cameras",
        )
    ]
