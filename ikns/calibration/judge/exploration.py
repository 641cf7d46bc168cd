"""The judge of recordings in which a person moves, with their body known or not."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.chains import ChainLike, chain_sides
from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.axes import judge_axes
from ikns.calibration.judge.distance_findings import (
    another_shape,
    exchanged_names,
    moved_marker,
    unsteady_pair,
)
from ikns.calibration.judge.distances import (
    MOST_CHANGE,
    Distances,
    all_distances,
    changed_pairs,
    exchanged_by_distance,
    pair_distances,
    quantile,
)
from ikns.calibration.judge.finding import (
    Finding,
    refused,
    say_frames,
    worst_first,
)
from ikns.calibration.judge.labels import judge_labels
from ikns.calibration.judge.lags import judge_lags
from ikns.calibration.judge.offsets import UsualFit
from ikns.calibration.judge.sides import labels_in_file, other_side, sides_exchanged
from ikns.calibration.judge.static import body_size
from ikns.calibration.judge.steps import judge_steps
from ikns.calibration.judge.trace_findings import judge_traces
from ikns.calibration.judge.traces import repeated
from ikns.calibration.judge.tracking import judge_tracking
from ikns.calibration.judge.unit import size_beside
from ikns.motion.marker_ik.visibility import segment_pairs
from ikns.recording.recording import Recording

#: A distance within a segment is off in a frame by more than this, m, as for a live
#: frame: landmarks on the skin of real people move by up to 24 mm against each other.
_ASTRAY = 0.04
#: Another person: so many of the distances within segments are off, by so much, m. Of
#: the same person, 14 % were off by 5 mm, none of them by 16.
_OTHERS, _OTHERS_CHANGE = 0.35, 0.008
#: Frames whose median distance is the usual one.
_GLANCES = 60
#: Share of the frames that may repeat the one before.
_REPEATS = 0.02


def judge_exploration(
    recording: Recording,
    worn: MarkerSet,
    generic: Skeleton,
    *,
    skeleton: Skeleton | None = None,
    chain: ChainLike = "both_arms",
    usual: UsualFit | None = None,
) -> list[Finding]:
    """Judge a recording in which a person moves.

    Parameters
    ----------
    recording : Recording
    worn : MarkerSet
        The markers on the person.
    generic : Skeleton
        Any body; its size is compared where the person's is not known.
    skeleton : Skeleton, optional
        The person's, from the static trial.
    chain : str
        See :class:`ikns.Chain`; what is wrong with the other arm alone is
        left out.
    usual : UsualFit, optional
        How the markers lay on this body at calibration.

    Returns
    -------
    list of Finding
        The worst first.
    """
    findings = _judge(recording, worn, generic, skeleton, usual)
    sides = ("thorax", *chain_sides(chain))
    own = {m.label for m in worn.markers if m.link.startswith(sides)}
    return worst_first(f for f in findings if not f.markers or own & set(f.markers))


def _judge(
    recording: Recording,
    worn: MarkerSet,
    generic: Skeleton,
    skeleton: Skeleton | None,
    usual: UsualFit | None,
) -> list[Finding]:
    where = recording.source
    others = judge_labels(
        where, recording.labels, worn, calibrated=skeleton is not None
    )
    if refused(others):
        return others
    if skeleton is None:
        worn = worn.without_static()
        pairs, apart = _pairs(worn), None
    else:
        worn = skeleton.marker_set
        pairs, apart = segment_pairs(skeleton, "both_arms")
    markers = worn.pick(recording.labels, recording.markers)
    in_file = labels_in_file(worn, recording.labels)
    if skeleton is None or apart is None:
        size = body_size(where, markers, generic.with_nominal_markers(worn))
    else:
        size = size_beside(where, markers, pairs, apart)
    if size:
        return size
    findings, spoiled, measured = judge_traces(
        where, worn.labels, recording.time, markers
    )
    findings = others + findings + _repeated(where, markers)
    if spoiled.all():
        return findings
    good = measured[~spoiled]
    distant, exchanges = _judge_distances(
        where,
        worn,
        good,
        pairs,
        apart,
        noisy=any(finding.kind == "noise" for finding in findings),
        in_file=in_file,
    )
    findings += distant
    if not distant:
        firm = _firm(worn, pairs)
        findings += judge_axes(where, worn, good, firm)
        findings += judge_lags(where, worn.labels, recording.time, measured, firm)
    if not exchanges and len(pairs):
        every = pair_distances(measured, pairs)
        every[spoiled] = np.nan
        findings += _astray(where, worn, every, pairs)
        findings += judge_steps(where, worn.labels, recording.time, every, pairs)
    if skeleton is not None:
        order = np.arange(len(worn.markers))
        for a, b in exchanges:
            order[[a, b]] = order[[b, a]]
        seconds = recording.time[~spoiled]
        findings += judge_tracking(
            where, skeleton, seconds, good[:, order], usual=usual, in_file=in_file
        )
    return findings


def _repeated(where: str, markers: Array) -> list[Finding]:
    """Say that frames (T, M, 3) repeat the one before, which no camera does."""
    again = repeated(markers)
    if again.sum() <= _REPEATS * len(again):
        return []
    return [
        Finding(
            "repeated",
            "warn",
            where,
            f"{100 * again.mean():.0f} % of the frames are "
            "identical to the previous one",
            "export at the cameras' own rate, with gaps where they saw nothing",
            (),
            say_frames(again),
        )
    ]


def _pairs(worn: MarkerSet) -> Indices:
    """Pairs (N, 2) of markers of one segment."""
    links = [marker.link for marker in worn.markers]
    pairs = [
        (i, j) for i, j in combinations(range(len(links)), 2) if links[i] == links[j]
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _firm(worn: MarkerSet, pairs: Indices) -> Indices:
    """Pairs (K, 2) of markers that go with their segment: neither weighs less."""
    weight = np.array([marker.weight for marker in worn.markers])
    return np.asarray(pairs[(weight[pairs] >= 1).all(axis=1)])


def _judge_distances(
    where: str,
    worn: MarkerSet,
    markers: Array,
    pairs: Indices,
    apart: Array | None,
    *,
    noisy: bool,
    in_file: tuple[str, ...],
) -> tuple[list[Finding], list[tuple[int, int]]]:
    """Judge distances within segments; also return the exchanges that mend them.

    That distances vary says nothing where markers are `noisy`; that their middle is
    another than on the person does.
    """
    if not len(pairs):
        return [], []
    labels = worn.labels
    found = all_distances(markers)
    changes = changed_pairs(found, pairs, apart)
    with np.errstate(invalid="ignore"):
        if not (changes > MOST_CHANGE).any() and apart is None:
            return [], []
    if apart is not None and _sides_exchanged(found, pairs, apart, labels):
        return [sides_exchanged(where, "then all distances fit")], []
    exchanges, left = exchanged_by_distance(found, pairs, apart)
    findings = exchanged_names(where, labels, exchanges, in_file)
    if apart is not None and not exchanges:
        i, j = pairs.T
        off = np.abs(found.middle[i, j] - apart)
        links = {worn.markers[i].link for i in pairs[off > _OTHERS_CHANGE][:, 0]}
        share = _share_off(found, pairs, apart)
        if share > _OTHERS and len(links) > 2:
            return [
                Finding(
                    "another person",
                    "refuse",
                    where,
                    f"{100 * share:.0f} % of the distances within segments differ from "
                    f"the static trial by more than {1000 * _OTHERS_CHANGE:.0f} mm",
                    "use the static trial of this person and session",
                )
            ], []
    if left.any() and not exchanges:
        i, j = pairs[left].T
        spread = found.spread[i, j]
        shift = np.zeros(len(i)) if apart is None else found.middle[i, j] - apart[left]
        if np.abs(shift).max() > MOST_CHANGE:
            findings.append(moved_marker(where, labels, pairs[left], shift))
        elif not noisy:
            findings.append(unsteady_pair(where, labels, pairs[left], spread))
    if apart is not None and not findings:
        findings += another_shape(where, worn, found, pairs, apart)
    return findings, exchanges


def _share_off(found: Distances, pairs: Indices, apart: Array) -> float:
    """Share of the known distances that are off by more than a person's own."""
    i, j = pairs.T
    off = np.abs(found.middle[i, j] - apart)
    known = np.isfinite(off)
    return float(np.mean(off[known] > _OTHERS_CHANGE)) if known.any() else 0.0


def _sides_exchanged(
    found: Distances, pairs: Indices, apart: Array, labels: tuple[str, ...]
) -> bool:
    """Whether distances are another person's, but with left for right this one's."""
    share = _share_off(found, pairs, apart)
    if share <= _OTHERS:
        return False
    other = other_side(labels)
    swapped = Distances(
        found.middle[np.ix_(other, other)], found.spread[np.ix_(other, other)]
    )
    return _share_off(swapped, pairs, apart) < min(_OTHERS, share / 2)


def _astray(where: str, worn: MarkerSet, apart: Array, pairs: Indices) -> list[Finding]:
    """Find frames in which a distance is off that is right in most others.

    `apart` (T, N) are the distances of pairs (N, 2), m.
    """
    usual = quantile(apart[:: max(1, len(apart) // _GLANCES)], 0.5)
    with np.errstate(invalid="ignore"):
        wrong: Mask = np.asarray(np.abs(apart - usual) > _ASTRAY)
    off: Mask = np.asarray(wrong.any(axis=1))
    if not off.any() or off.mean() > 0.5:
        return []
    often = np.bincount(pairs.ravel(), np.repeat(wrong.sum(axis=0), 2))
    named = [worn.labels[i] for i in np.argsort(-often)[:2]]
    return [
        Finding(
            "astray",
            "warn",
            where,
            f"{named[0]} is not where the other markers of its segment say",
            f"check {named[0]} there: a ghost marker, or a swapped name",
            tuple(named),
            say_frames(off),
        )
    ]
