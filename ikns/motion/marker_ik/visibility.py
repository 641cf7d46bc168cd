"""Which segments a frame shows, and which joints are known by that.

A limb is in sight with one marker, as its joints tie it to the thorax; the thorax with
three, or all of a set that has fewer. A chain is in sight when the thorax and every
segment of its arms are, live and offline alike; then all their joints are known.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.chains import SIDES, ChainLike, chain_sides
from ikns.body.set_choice import other_set
from ikns.body.skeleton import Skeleton
from ikns.errors import MarkerMismatch
from ikns.motion.motion import all_seen

#: Markers that determine a segment by themselves.
_ENOUGH = 3


class Visibility(NamedTuple):
    """What the markers of T frames show."""

    segments: tuple[str, ...]  # S links that carry markers, and the thorax
    seen: Mask  # (T, S) whether each is in sight
    known: Mask  # (T, J) whether each joint angle is known


class _Segment(NamedTuple):
    """A segment with markers, and what lies between it and the one before."""

    columns: list[int]  # its markers, without those that weigh nothing
    need: int  # how many must be seen
    before: str  # next such segment on the way to the thorax; empty for the thorax
    joints: list[int]  # joints between the two
    free: int  # how many of these are not held
    turns: int  # 1 where the markers have a turn of their own, which takes one number


def sight_needs(
    skeleton: Skeleton, chain: ChainLike
) -> dict[str, tuple[list[int], int]]:
    """By link of a chain, and the thorax: its markers, and how many must be seen."""
    return {
        link: (segment.columns, segment.need)
        for link, segment in _segments(skeleton).items()
        if link.startswith(("thorax", *chain_sides(chain)))
    }


def joint_segments(skeleton: Skeleton) -> tuple[Indices, Indices]:
    """Segment of each marker, (M,); segments on both sides of each joint, (nv, 2).

    They are numbers, -1 for none: of markers that weigh nothing, and on the far side of
    the thorax, whose six degrees of freedom are first.
    """
    segments = _segments(skeleton)
    number = {link: k for k, link in enumerate(segments)}
    of_marker = np.full(len(skeleton.marker_set.markers), -1, dtype=np.int64)
    of_joint = np.full((skeleton.nv, 2), -1, dtype=np.int64)
    root = skeleton.nv - len(skeleton.joint_names)
    of_joint[:root, 0] = number["thorax"]
    for link, segment in segments.items():
        of_marker[segment.columns] = number[link]
        if segment.before:
            own = [root + joint for joint in segment.joints]
            of_joint[own] = number[link], number[segment.before]
    return of_marker, of_joint


def seen_markers(markers: Array) -> Mask:
    """Say which markers (..., 3) have a position; three times as fast as `all`."""
    x, y, z = np.moveaxis(markers, -1, 0)
    with np.errstate(invalid="ignore"):  # infinite positions
        return np.asarray(np.isfinite(x + y + z))


def visible_segments(skeleton: Skeleton, markers: Array) -> Visibility:
    """Say which segments markers (T, M, 3) show, and which joints are known.

    While an arm is in sight from the thorax to the hand, all its joints are known.
    While it is not, a joint is known when the segments on both its sides are in sight
    and determined: by three markers of their own, or by the joints that tie them to a
    determined segment. One marker shows two such joints, as it keeps its distance from
    the last of them; the third of an upper arm takes another marker, or one on the
    forearm.

    A held joint is known by the same rule: its angle is the one at which it is held,
    and unknown while a segment next to it is out of sight.
    """
    finite = seen_markers(markers)
    segments, n = _segments(skeleton), len(markers)
    count = {
        link: finite[:, segment.columns].sum(axis=1)
        for link, segment in segments.items()
    }
    seen = {link: count[link] >= segment.need for link, segment in segments.items()}
    determined = {"thorax": seen["thorax"]}
    known: Mask = np.zeros((n, len(skeleton.joint_names)), dtype=bool)
    for link, (_, _, before, joints, free, turns) in segments.items():
        if link == "thorax":
            continue
        # Markers show three numbers each; what they have left over shows one more.
        spare = np.zeros(n, dtype=bool)
        for other, after in segments.items():
            if after.before == link:
                spare |= 3 * count[other] - after.turns > after.free
        tied = determined[before] & (2 * count[link] - turns + spare >= free)
        alone = (count[link] >= _ENOUGH) & (not turns)
        determined[link] = seen[link] & (tied | alone)
        known.T[joints] = determined[before] & determined[link]
    names, shown = tuple(segments), np.stack(list(seen.values()), axis=1)
    for side in SIDES:
        own = [joint.startswith(side) for joint in skeleton.joint_names]
        known.T[own] |= all_seen(names, shown, side)
    return Visibility(names, shown, known)


def require_sight(
    skeleton: Skeleton,
    visibility: Visibility,
    chain: ChainLike,
    labels: Sequence[str],
) -> None:
    """Refuse a recording that never shows a segment of a chain, or the thorax.

    `labels` are those of the recording; where another set fits them, that is the cause.
    """
    worn = skeleton.marker_set
    for link, (own, need) in sight_needs(skeleton, chain).items():
        if not own:
            raise MarkerMismatch(
                f"expected a marker on the segment {link}, found none in {worn.name}."
            )
        if not visibility.seen[:, visibility.segments.index(link)].any():
            if other := other_set(worn, labels, calibrated=True):
                raise MarkerMismatch(f"{other[0]}; {other[1]}.")
            raise MarkerMismatch(
                f"the segment {link} is never visible; expected at least {need} of "
                f"{', '.join(worn.labels[i] for i in own)} of {worn.name} in a frame."
            )


def segment_pairs(skeleton: Skeleton, chain: ChainLike) -> tuple[Indices, Array]:
    """Markers of the same segment of a chain, or of the thorax, two and two.

    Segments hardly stretch: where a distance differs, a marker has moved, or is taken
    for another.

    Returns
    -------
    pairs : (N, 2) integer array
        Columns of the skeleton's marker set.
    apart : (N,) array
        How far apart they are on the person, m.
    """
    needs = sight_needs(skeleton, chain).values()
    turns = [marker.free_turn for marker in skeleton.marker_set.markers]
    found = [
        pair
        for columns, _ in needs
        for pair in combinations(columns, 2)
        if turns[pair[0]] == turns[pair[1]]
    ]
    pairs = np.array(found, dtype=np.int64).reshape(-1, 2)
    # On one link, so these are its own coordinates.
    first, second = skeleton.marker_positions[pairs.T]
    return pairs, np.linalg.norm(first - second, axis=1)


def say_apart(skeleton: Skeleton, pair: Indices, change: float) -> str:
    """Say that two markers are nearer or farther than on the person, by so many m."""
    first, second = (skeleton.marker_set.labels[column] for column in pair)
    side = "farther apart" if change > 0 else "closer"
    return f"{first} and {second} are {abs(1000 * change):.0f} mm {side}"


def _segments(skeleton: Skeleton) -> dict[str, _Segment]:
    """Links that carry markers, the thorax first, each after those before it.

    A hand without markers is there too unless its joints are held: it is never in
    sight, and neither is its arm.
    """
    worn, names = skeleton.marker_set, skeleton.joint_names
    held = {names.index(joint) for joint in worn.held}
    columns: dict[str, list[int]] = {"thorax": []}
    for column, marker in enumerate(worn.markers):
        if not marker.static_only and marker.weight > 0:
            columns.setdefault(marker.link, []).append(column)
    for side in SIDES:
        joints, _ = _way(skeleton, f"{side}_hand", columns)
        bare = not any(link.startswith(side) for link in columns)
        if bare or set(joints) - held:
            columns.setdefault(f"{side}_hand", [])
    segments: dict[str, _Segment] = {}
    for link in sorted(columns, key=lambda link: skeleton.tree_link(link)[0]):
        own = columns[link]
        joints, before = _way(skeleton, link, segments)
        turns = int(_turns(skeleton, link))
        free = len(set(joints) - held)
        enough = _ENOUGH if link == "thorax" else 1 + turns
        if link != "thorax" and segments[before].turns:
            # Its own joints and the one that the segment before leaves open.
            enough = max(enough, -(-free // 2))
        need = max(1, min(enough, len(own)))
        segments[link] = _Segment(own, need, before, joints, free, turns)
    return segments


def _way(skeleton: Skeleton, link: str, others: Iterable[str]) -> tuple[list[int], str]:
    """Joints between a link and the next of others towards the thorax; and that.

    A link of which only clusters with a free turn are seen does not show its own joint.
    """
    carried = {_shown(skeleton, other): other for other in others}
    joints, at = [], _shown(skeleton, link)
    while at > 0 and at not in carried:
        joints.append(at - 1)
        at = int(skeleton.tree.parent[at])
    return joints, carried.get(at, "")


def _shown(skeleton: Skeleton, link: str) -> int:
    """Last joint of the tree that the markers of a link show."""
    joint = skeleton.tree_link(link)[0]
    return int(skeleton.tree.parent[joint]) if _turns(skeleton, link) else joint


def _turns(skeleton: Skeleton, link: str) -> bool:
    """Whether a link is seen by markers with a free turn only."""
    own = [
        marker.free_turn
        for marker in skeleton.marker_set.markers
        if marker.link == link and not marker.static_only and marker.weight > 0
    ]
    return bool(own) and all(own)
