"""Places on the body where markers sit, with the labels that they usually have.

A table, ``sites.toml`` beside the URDF; what ``ikns markers new`` asks for.
"""

from __future__ import annotations

import difflib
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from ikns.body.marker_set import Marker, label_keys
from ikns.body.model_file import urdf_folder
from ikns.errors import InvalidInput

#: Link of a side by the table's short name.
_SIDED = ("clavicle", "upper_arm", "forearm", "hand")
#: So many markers of a segment show how it lies.
_CLUSTER = 3
#: Letter that stands for a side before or behind a label: ``RELB``, ``r_lelbow``,
#: ``ELB_R``.
_LETTERS = {"r": "right", "l": "left"}


@dataclass(frozen=True)
class Site:
    """A place on the body.

    Without a position it is anywhere on the segment, and measured; `roughly` is where
    to look first.
    """

    name: str
    about: str
    link: str
    position: tuple[float, float, float] | None  # in the link's frame, m
    placement_sd: tuple[float, float, float] | None  # m
    labels: tuple[str, ...]  # usual ones, without a letter for the side
    side: str  # "right", "left" or ""
    labels_beside: tuple[str, ...] = ()  # usual ones if a marker is on the next
    beside: str = ""  # name of another place
    roughly: tuple[float, float, float] = (0.0, 0.0, 0.0)  # in the link's frame, m
    roughly_sd: float = 0.1  # m

    def marker(self, label: str, *, static_only: bool) -> Marker:
        """Return a marker here, or roughly here."""
        place, spread = self.position, self.placement_sd
        if place is None or spread is None:
            sd = self.roughly_sd
            place, spread = self.roughly, (sd, sd, sd)
        return Marker(label, self.link, place, spread, static_only)


@cache
def sites() -> Mapping[str, Site]:
    """All places by name, those of the sides as ``right_...`` and ``left_...``."""
    path = urdf_folder() / "sites.toml"
    table = tomllib.loads(path.read_text(encoding="utf-8"))["sites"]
    found = {}
    for name, row in table.items():
        for side in ("right", "left") if row.get("side") else ("",):
            site = _site(f"{side}_{name}" if side else name, row, side)
            found[site.name] = site
    return found


def _site(name: str, row: Mapping[str, Any], side: str) -> Site:
    link = str(row["link"])
    position = spread = None
    if "position_mm" in row:
        position = _place(row["position_mm"], side)
        sd = row["placement_sd_mm"]
        sx, sy, sz = (
            float(value) / 1000 for value in (sd if isinstance(sd, list) else 3 * [sd])
        )
        spread = (sx, sy, sz)
    return Site(
        name,
        f"{side} {row['about']}".strip(),
        f"{side}_{link}" if side and link in _SIDED else link,
        position,
        spread,
        tuple(row["labels"]),
        side,
        tuple(row.get("labels_beside", ())),
        row.get("beside", ""),
        _place(row.get("roughly_mm", (0, 0, 0)), side),
        float(row.get("roughly_sd_mm", 100)) / 1000,
    )


def _place(millimeters: Iterable[float], side: str) -> tuple[float, float, float]:
    """Place in a link's frame, m; the table has the right side's."""
    x, y, z = (float(value) / 1000 for value in millimeters)
    return x, y, 0.0 - z if side == "left" else z


def site(name: str) -> Site:
    """Return a place by its name; an unknown one names those that are alike."""
    key = re.sub(r"[\s-]+", "_", name.strip()).casefold()
    known = sites()
    if key not in known:
        alike = difflib.get_close_matches(key, known, n=3, cutoff=0.4)
        raise InvalidInput(
            f"there is no place '{name.strip()}' on the body, but "
            f"{', '.join(alike or list(known)[:3])} and others; see "
            "`ikns markers sites`."
        )
    return known[key]


def usual_site(
    label: str,
    answered: Mapping[str, str] | None = None,
    others: Iterable[str] = (),
    *,
    side: str | None = None,
) -> Site | None:
    """Return where a marker of this label usually sits; None where that is open.

    `answered` are places by label: what was said of the same label on the other side
    comes first. `others` are labels worn with it: the sternum's is at the lower end of
    the bone where another one is at the upper end, else anywhere on it. `side` is that
    of labels that name none, as where one arm alone wears markers.

    >>> usual_site("Anna:RELB").name, usual_site("LUAR3").name, usual_site("XYZ")
    ('right_lateral_epicondyle', 'left_upper_arm', None)
    >>> usual_site("LKNOB", {"RKNOB": "right_knuckle_3"}).name
    'left_knuckle_3'
    >>> usual_site("STRN").name, usual_site("STRN", others=["CLAV"]).name
    ('sternum', 'xiphoid')
    >>> usual_site("EPICl"), usual_site("EPICl", side="left").name
    (None, 'left_lateral_epicondyle')
    """
    bare = label.rpartition(":")[2].strip()
    if twin := _mirrored(bare, answered or {}):
        return twin
    middle = [
        replace(s, labels=s.labels + s.labels_beside)
        if s.beside and _is_worn(sites()[s.beside], answered or {}, others)
        else s
        for s in sites().values()
        if not s.side
    ]
    if found := _named(bare, middle):
        return found
    readings = _readings(bare) + ([(side, bare)] if side else [])
    for own_side, rest in readings:
        own = [s for s in sites().values() if s.side == own_side]
        if found := _named(rest, own):
            return found
    return None


def without_side(labels: Sequence[str]) -> list[str]:
    """Return labels that name a place on an arm, but not on which.

    >>> without_side(["RELB", "EPICl", "XYZ", "T10"])
    ['EPICl']
    """
    return [
        label
        for label in labels
        if usual_site(label, others=labels) is None
        and usual_site(label, others=labels, side="right") is not None
    ]


def guess_sites(
    labels: Sequence[str], moving: Sequence[str] = (), *, side: str | None = None
) -> dict[str, str]:
    """Take each label for what it usually means; labels of no known place are left out.

    Parameters
    ----------
    labels : sequence of str
        Of a static trial.
    moving : sequence of str
        Of a movement, if there is one: markers that it lacks are static only. Without
        one, landmarks of a forearm that carries three markers elsewhere are: they are
        put on to calibrate such a cluster.
    side : {"right", "left"}, optional
        That of labels that name none.

    Returns
    -------
    dict
        Place by label, ``static`` behind it where it is static only.

    Examples
    --------
    >>> guess_sites(["RSPR", "RELB", "XYZ"], moving=["RELB"])
    {'RSPR': 'right_radial_styloid static', 'RELB': 'right_lateral_epicondyle'}
    """
    answers: dict[str, str] = {}
    for label in labels:
        if found := usual_site(label, answers, labels, side=side):
            answers[label] = found.name
    worn = label_keys(moving)
    places = {label: site(name) for label, name in answers.items()}
    loose = Counter(p.link for p in places.values() if p.position is None)
    for label, place in places.items():
        if (
            not label_keys([label]) & worn
            if worn
            else place.position
            and place.link.endswith("_forearm")
            and loose[place.link] >= _CLUSTER
        ):
            answers[label] += " static"
    return answers


def _is_worn(place: Site, answered: Mapping[str, str], others: Iterable[str]) -> bool:
    """Whether a marker is on a place, as was said or as its label says."""
    said = {name.partition(" ")[0] for name in answered.values()}
    usual = {name.casefold() for name in place.labels}
    bare = {other.rpartition(":")[2].strip().casefold() for other in others}
    return place.name in said or bool(usual & bare)


def _named(label: str, among: Iterable[Site]) -> Site | None:
    """Find the place of this label; with a number behind it, one of a cluster."""
    stem = label.rstrip("0123456789").rstrip("_.- ")
    for place in among:
        known = {name.casefold() for name in place.labels}
        if label.casefold() in known and (place.position or stem == label):
            return place
    for place in among:
        known = {name.casefold() for name in place.labels}
        if place.position is None and stem.casefold() in known:
            return place
    return None


def _readings(label: str) -> list[tuple[str, str]]:
    """Side and rest of a label, as it may be read."""
    found = []
    for pattern in (
        r"(?P<side>[rl])[_. ]?(?P<rest>.+)",
        r"(?P<rest>.+)[_.](?P<side>[rl])",
    ):
        if match := re.fullmatch(pattern, label, re.IGNORECASE):
            found.append((_LETTERS[match["side"].casefold()], match["rest"]))
    return found


def _mirrored(label: str, answered: Mapping[str, str]) -> Site | None:
    """Mirror what was said of this label on the other side."""
    said = {
        k.rpartition(":")[2].casefold(): name.partition(" ")[0]
        for k, name in answered.items()
    }
    swap = {"r": "l", "l": "r"}
    key = label.casefold()
    for twin in (swap.get(key[:1], "") + key[1:], key[:-1] + swap.get(key[-1:], "")):
        name = said.get(twin, "")
        side, _, rest = name.partition("_")
        other = {"right": "left", "left": "right"}.get(side)
        if len(twin) == len(key) and twin != key:
            if found := sites().get(f"{other}_{rest}"):
                return found
    return None
