"""A marker set of one's own, from one static trial and where each marker sits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ikns.arrays import Array
from ikns.body.marker_set import Marker, MarkerSet
from ikns.body.sites import Site, site, without_side
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.finding import say_markers
from ikns.calibration.judge.static import refuse_moving
from ikns.calibration.observed import with_unshown_held
from ikns.calibration.size_fit import SizeFit, fit_sizes, size_factors
from ikns.calibration.static_trial import static_posture
from ikns.calibration.turning_skin import (
    turning_labels,
    with_firm_hands,
    with_free_turn,
)
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.recording.recording import Recording

#: How far markers of a cluster are put from where they were the first time, per axis,
#: m: as `oxford24` has it, more along a limb.
_CLUSTER_SD = (0.020, 0.040, 0.020)
#: Digits of a written place, m: a tenth of a millimeter.
_DIGITS = 4
#: Words that say that a marker is worn in the static trial only, or not used.
_STATIC, _SKIP = "static", "skip"


@dataclass(frozen=True)
class PlacedLabel:
    """Where a label sits, as a person said."""

    label: str  # without the subject's name
    site: Site
    static_only: bool


@dataclass(frozen=True)
class OwnMarkerSet:
    """A new marker set, and what its static trial says of it."""

    marker_set: MarkerSet
    placed: tuple[PlacedLabel, ...]
    skipped: tuple[str, ...]  # labels of the trial that the set leaves out
    assumed: tuple[str, ...]  # segments whose markers are all measured: see below
    turning: tuple[str, ...]  # labels that turn with the skin of a forearm


def read_answers(answers: Mapping[str, str]) -> tuple[PlacedLabel, ...]:
    """Read where labels sit: the name of a place, ``static`` behind it, or ``skip``.

    >>> read_answers({"RMEPI": "right medial epicondyle static"})[0].static_only
    True
    """
    placed = []
    for label, said in answers.items():
        words = said.split()
        if words == [_SKIP]:
            continue
        static_only = len(words) > 1 and words[-1] == _STATIC
        try:
            where = site(" ".join(words[:-1] if static_only else words))
        except InvalidInput as error:
            raise InvalidInput(f"{label}: {error}") from None
        placed.append(PlacedLabel(_bare(label), where, static_only))
    return tuple(placed)


def own_marker_set(
    generic: Skeleton,
    static: Recording,
    answers: Mapping[str, str],
    *,
    name: str,
    min_duration: float = 1.0,
) -> OwnMarkerSet:
    """Make a marker set from a static trial.

    Markers on landmarks keep the place that the landmark has on the generic body, and
    so fit other people too. With them the body is scaled and its posture found; where
    the other markers then are on their segments is measured. Joints that the set does
    not show are held. A cluster on a forearm turns freely about its axis where another
    on the hand shows how far that is turned: skin follows pronation in part only.

    Parameters
    ----------
    generic : Skeleton
        The generic adult, or the body of the person from stature, mass and sex.
    static : Recording
        The person standing still, every marker in sight.
    answers : mapping
        Place by label (:func:`read_answers`); other labels are left out.
    name : str
        Of the set.
    min_duration : float
        Shortest static trial to accept, s.

    Returns
    -------
    OwnMarkerSet
        A segment is `assumed` when none of its markers is a landmark: then its posture
        in the static trial, which nothing shows, is taken to be that of hanging arms,
        and its angles are counted from there.

    Raises
    ------
    NotEnoughData
        When the trial is too short or the person moves in it.
    MarkerMismatch
        When the trial does not show a label, or no marker is on a landmark.
    InvalidInput
        When a place is unknown, or two labels are on one landmark.
    """
    placed = read_answers(answers)
    _check(placed, static)
    roughly = MarkerSet(
        name,
        tuple(p.site.marker(p.label, static_only=p.static_only) for p in placed),
    )
    # The others help to find the body, too: a trunk with a single landmark would turn.
    roughly = with_unshown_held(generic, roughly.all_tracked())
    reference, target, _ = static_posture(
        generic, static, marker_set=roughly, min_duration=min_duration
    )
    refuse_moving(static, roughly)
    fit = fit_sizes(reference, target)
    measured = _measured(reference, fit, target, placed)
    known = zip(roughly.markers, placed, strict=True)
    landmarks = [m for m, p in known if p.site.position is not None]
    by_label = {m.label: m for m in (*landmarks, *measured)}
    worn = MarkerSet(
        name,
        tuple(replace(by_label[p.label], static_only=p.static_only) for p in placed),
        source=f"made by ikns markers new from {static.source}",
    )
    worn = with_unshown_held(generic, worn)
    turning = turning_labels(worn)
    return OwnMarkerSet(
        with_firm_hands(with_free_turn(worn, turning), turning),
        placed,
        tuple(label for label in static.labels if _bare(label) not in by_label),
        _assumed(placed),
        turning,
    )


def _bare(label: str) -> str:
    return label.rpartition(":")[2].strip()


def _check(placed: tuple[PlacedLabel, ...], static: Recording) -> None:
    labels = [_bare(label).casefold() for label in static.labels]
    for one in placed:
        columns = [k for k, label in enumerate(labels) if label == one.label.casefold()]
        if len(columns) != 1:
            found = [static.labels[k] for k in columns] or static.labels[:8]
            raise MarkerMismatch(
                f"{static.source}: expected one marker {one.label}, found "
                f"{', '.join(found)}{'' if columns else ' and so on'}."
            )
        if not np.isfinite(static.markers[:, columns[0]]).all(axis=1).any():
            raise MarkerMismatch(
                f"{static.source}: the marker {one.label} is never seen; leave it out, "
                "or take a static trial that shows it."
            )
    known = [one for one in placed if one.site.position is not None]
    for one in known:
        twins = [p.label for p in known if p.site == one.site]
        if len(twins) > 1:
            raise InvalidInput(
                f"expected one marker on {one.site.name}, found {' and '.join(twins)}; "
                "put one of them on the segment, or skip it."
            )
    if len({p.site.link for p in known}) < 2:
        raise MarkerMismatch(
            f"{static.source}: expected landmarks on two segments or more, to find the "
            f"body from, found {', '.join(p.label for p in known) or 'none'}; "
            f"{_where_more(placed, static)}."
        )


def _where_more(placed: tuple[PlacedLabel, ...], static: Recording) -> str:
    """Say what would place more markers."""
    said = {one.label.casefold() for one in placed}
    left = [label for label in static.labels if _bare(label).casefold() not in said]
    if told := side_sentence(left):
        return told
    return "say where more of its markers sit, as in --sites FILE"


def side_sentence(labels: Sequence[str]) -> str:
    """Say which labels name places of an arm, but not of which; empty for none."""
    open_ = without_side(labels)
    if not open_:
        return ""
    one = len(open_) == 1
    return (
        f"{say_markers(open_)} name{'s' * one} {'a place' if one else 'places'} of an "
        "arm, but not which: give --side right or --side left"
    )


def _measured(
    reference: Skeleton, fit: SizeFit, target: Array, placed: tuple[PlacedLabel, ...]
) -> list[Marker]:
    """Markers that are no landmarks, where they sit on the generic body.

    `target` (M, 3) m are all markers' mean positions in the trial, in this order.
    """
    loose = [k for k, one in enumerate(placed) if one.site.position is None]
    if not loose:
        return []
    factors = size_factors(fit.log_sizes)
    person = reference.resized(factors)
    places = []
    for k in loose:
        at_link, rotation = _link_in_world(person, fit.q, placed[k].site.link)
        places.append(rotation.T @ (target[k] - at_link))
    own = (
        Marker(placed[k].label, placed[k].site.link, (0.0, 0.0, 0.0), _CLUSTER_SD)
        for k in loose
    )
    worn = replace(reference.marker_set, markers=tuple(own)).at(np.array(places))
    back = {link: 1 / factor for link, factor in factors.items()}
    on_generic = person.with_markers(worn).resized(back).marker_positions
    return list(worn.at(on_generic.round(_DIGITS)).markers)


def _link_in_world(body: Skeleton, q: Array, link: str) -> tuple[Array, Array]:
    """Origin (3,) m and axes (3, 3) of a link in the world."""
    probe = tuple(
        Marker(f"{axis}", link, (x, y, z), (1.0, 1.0, 1.0))
        for axis, (x, y, z) in enumerate(np.vstack([np.zeros(3), np.eye(3)]).tolist())
    )
    corners = body.with_markers(MarkerSet("frame", probe)).markers_in_world(q)
    return corners[0], (corners[1:] - corners[0]).T


def _assumed(placed: tuple[PlacedLabel, ...]) -> tuple[str, ...]:
    links = dict.fromkeys(one.site.link for one in placed)
    return tuple(
        link
        for link in links
        if all(p.site.position is None for p in placed if p.site.link == link)
    )
