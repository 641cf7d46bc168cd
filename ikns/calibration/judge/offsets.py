"""Where the markers of a segment lie on the body, in the mean of all of them.

Skin, joint centers and what a model leaves out put them a centimeter or two from where
the static trial has them, and posture moves them by as much; but nearly the same for
one person and wearing. On another person, or where a band slid before the recording,
they lie elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import Finding
from ikns.errors import InvalidInput
from ikns.motion.marker_ik import turned_markers
from ikns.motion.motion import Motion
from ikns.numerics.rigid import quaternion_matrix
from ikns.recording.recording import Recording

#: Segments of an arm, and how far the median offset of markers of weight 1 may be from
#: the static trial's and from those at calibration, m; that of a hand's that weigh more
#: is less. The largest of seven people (UE_ADL; their hands weigh 10) are 19, 35, 19
#: and 4 mm, and 6, 11, 8 and 3 mm where one reach was the whole calibration. Limits of
#: 1.5 times the largest of six people suit the seventh; after one reach, 1 trial in 50
#: is beyond (benchmarks/silent_faults.py).
_LIMITS = {
    "clavicle": (0.028, 0.0126),
    "upper_arm": (0.052, 0.019),
    "forearm": (0.029, 0.0095),
    "hand": (0.018, 0.009),
}
#: Frames looked at, and fewest that say something.
_GLANCES, _FEWEST = 60, 10
#: What a segment's offset is in ordinary movement: these percentiles over the frames.
_RANGE = (5.0, 95.0)


class UsualFit(NamedTuple):
    """How a person's markers lay on their body at calibration."""

    residual: float | None  # median of the worst recording, m
    offsets: Mapping[str, Array]  # by link, (2, 3) m: lowest and highest


def usual_fit(report: Mapping[str, Any]) -> UsualFit:
    """Read from the report of a calibration how the markers lay on the body.

    After :func:`ikns.rewear` the new wearing counts. What the report of an older
    calibration does not say is left out.

    Raises
    ------
    InvalidInput
        When offsets are not what :func:`offsets_report` writes.
    """
    worn_again = report.get("rewear")
    rows = worn_again.get("natural") if isinstance(worn_again, Mapping) else None
    rows = rows or report.get("explorations")
    rows = rows if isinstance(rows, list) else []
    known = [row.get("residual_median_m") for row in rows if isinstance(row, Mapping)]
    return UsualFit(
        max((float(one) for one in known if isinstance(one, float)), default=None),
        _offsets(report.get("offsets_m", {})),
    )


def _offsets(found: object) -> dict[str, Array]:
    try:
        offsets = {
            str(link): np.array(ends, dtype=np.float64)
            for link, ends in dict(found).items()  # type: ignore[call-overload]
        }
    except (TypeError, ValueError):
        offsets = {"": np.empty(0)}
    if all(e.shape == (2, 3) and np.isfinite(e).all() for e in offsets.values()):
        return offsets
    raise InvalidInput(
        "offsets_m in calibration.json: expected for each segment its lowest and "
        f"highest offset, three numbers each, found {str(found)[:60]}; calibrate again."
    )


def offsets_report(
    skeleton: Skeleton,
    chain: ChainLike,
    recordings: Sequence[Recording],
    motions: Sequence[Motion],
) -> dict[str, list[list[float]]]:
    """Lowest and highest offset of each segment of a chain's arms, m, ready for JSON.

    Over recordings and how a skeleton followed them.
    """
    ends: dict[str, list[Array]] = {}
    for recording, motion in zip(recordings, motions, strict=True):
        markers = skeleton.marker_set.pick(recording.labels, recording.markers)
        step = max(1, len(markers) // _GLANCES)
        q, some = motion.q[::step], markers[::step]
        placed = turned_markers(skeleton, q, some)
        for link, apart in offsets_in_links(skeleton, q, placed, some).items():
            seen = apart[np.isfinite(apart).all(axis=1)]
            if len(seen) >= _FEWEST and link.startswith(chain_sides(chain)):
                ends.setdefault(link, []).append(np.percentile(seen, _RANGE, axis=0))
    return {
        link: [
            np.min([low for low, _ in own], axis=0).tolist(),
            np.max([high for _, high in own], axis=0).tolist(),
        ]
        for link, own in ends.items()
    }


def offsets_in_links(
    skeleton: Skeleton, q: Array, placed: Array, markers: Array
) -> dict[str, Array]:
    """Mean of each segment's markers from where poses have them, in their link.

    Parameters
    ----------
    skeleton : Skeleton
    q : (T, 25) array
        Poses of some frames.
    placed, markers : (T, M, 3) array
        Where the poses have the markers, and where they were seen, m.

    Returns
    -------
    dict of (T, 3) arrays
        By link of the arms, m; NaN where one of its markers was not seen.
    """
    found: dict[str, Array] = {}
    thorax = quaternion_matrix(q[:, 3:7])
    for link, own in _worn(skeleton).items():
        turn = thorax @ skeleton.link_in_thorax(q, link)[1]
        shift = (markers[:, own] - placed[:, own]).mean(axis=1)
        found[link] = np.einsum("tij,ti->tj", turn, shift)
    return found


def judge_offsets(
    where: str,
    skeleton: Skeleton,
    offsets: Mapping[str, Array],
    usual: Mapping[str, Array],
) -> list[Finding]:
    """Say which segments' markers lie elsewhere on the body than they did.

    `offsets` (T, 3) m by link, as :func:`offsets_in_links` returns them; `usual` (2, 3)
    those at calibration, empty if that is the static trial.
    """
    beyond: dict[str, tuple[float, float]] = {}  # share of the limit, m
    worn = _worn(skeleton)
    for link, apart in offsets.items():
        seen = apart[np.isfinite(apart).all(axis=1)]
        if len(seen) < _FEWEST:
            continue
        middle = np.median(seen, axis=0)
        known = usual.get(link)
        if known is not None:
            middle = middle - np.clip(middle, *known)
        limit = _LIMITS[link.partition("_")[2]][known is not None]
        weight = max(skeleton.marker_set.markers[m].weight for m in worn[link])
        if "hand" in link:
            limit /= np.sqrt(max(1.0, weight))
        off = float(np.linalg.norm(middle))
        beyond[link] = off / limit, off
    wrong = sorted(
        (link for link, (share, _) in beyond.items() if share > 1),
        key=lambda link: -beyond[link][0],
    )
    if not wrong:
        return []
    named = " and ".join(link.replace("_", " ") for link in wrong[:2])
    far = f"{1000 * beyond[wrong[0]][1]:.0f} mm"
    since, remedy = (
        (
            "at calibration",
            "use this person's subject folder, or `ikns calibrate --rewear`",
        )
        if wrong[0] in usual
        else ("in the static trial", "use that of this person and wearing")
    )
    return [
        Finding(
            "another person" if len(wrong) > 1 else "slipped",
            "warn",
            where,
            f"the markers of the {named} lie elsewhere on the body than {since}, those "
            f"of the {wrong[0].replace('_', ' ')} by {far}: another person, or markers "
            "that slid or were put on again",
            remedy,
            tuple(
                skeleton.marker_set.markers[m].label
                for link in wrong
                for m in worn[link]
            ),
        )
    ]


def _worn(skeleton: Skeleton) -> dict[str, list[int]]:
    """Columns of the markers that weigh something, by link of the arms."""
    found: dict[str, list[int]] = {}
    links = {f"{side}_{part}" for side in SIDES for part in _LIMITS}
    for column, marker in enumerate(skeleton.marker_set.markers):
        if marker.link in links and marker.weight > 0:
            found.setdefault(marker.link, []).append(column)
    return found
