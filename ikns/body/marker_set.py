"""Which marker is on which segment: a TOML file next to the URDF.

Positions are in the link's frame (X forward, Y up, Z right in the zero pose), in
millimeters in the file and meters here, for the generic body.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.model_file import urdf_folder
from ikns.errors import FileError, MarkerMismatch, unreadable

#: Added to a label by a reader when a file gives it to several markers.
_NUMBER = re.compile(r" #\d+$")

_FORMAT = 1
#: How far the farthest marker of a set is from its segment's origin, mm: more than the
#: skin's thickness, less than a body.
_FARTHEST = (2.0, 1500.0)


@dataclass(frozen=True)
class Marker:
    """One marker.

    The deviation of its placement along each axis is small on a bony landmark, large
    for a technical marker; one number in the file is used for all three. Its weight in
    inverse kinematics relative to the others is less where soft tissue moves under it.
    Markers with a free turn, all of a link together, sit on skin that follows the
    link's joint in part only (forearm and pronation).
    """

    label: str
    link: str  # the URDF link that carries it
    position: tuple[float, float, float]  # nominal, in the link's frame, m
    placement_sd: tuple[float, float, float]  # standard deviation, m
    static_only: bool = False  # used in the static trial only
    aliases: tuple[str, ...] = ()  # other labels of the same marker
    weight: float = 1.0
    free_turn: bool = False  # turns about its link's joint by an angle of its own


@dataclass(frozen=True)
class MarkerSet:
    """Markers of a body, and the joints that they do not observe.

    Parameters
    ----------
    name : str
        Short name.
    markers : tuple of Marker
        In the order of every marker axis of a skeleton.
    held : tuple of str
        Joints that these markers do not determine.
    source : str
        Where the layout is described.

    Examples
    --------
    >>> worn = MarkerSet.load("oxford24").without_static()
    >>> worn.columns(["ADL001:RSHO", "C7"])[:1], len(worn.markers)
    (array([1]), 22)
    """

    name: str
    markers: tuple[Marker, ...]
    held: tuple[str, ...] = ()
    source: str = ""

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the sets that come with the package."""
        return tuple(sorted(p.stem for p in (urdf_folder() / "markers").glob("*.toml")))

    @classmethod
    def load(cls, name_or_path: str | Path) -> MarkerSet:
        """Read a marker set by its name (``oxford24``) or from a TOML file."""
        path = Path(name_or_path)
        if path.suffix != ".toml":
            path = urdf_folder() / "markers" / f"{name_or_path}.toml"
            if not path.is_file():
                raise FileError(
                    f"there is no marker set '{name_or_path}'; known are "
                    f"{', '.join(cls.names())}, or the path of a .toml file."
                )
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise unreadable(path, error, "a marker set") from None
        if "format" not in table:
            raise FileError(f"{path}: the line `format = {_FORMAT}` is missing.")
        if table["format"] != _FORMAT:
            raise FileError(
                f"{path}: expected marker-set format {_FORMAT}, "
                f"found {table['format']}."
            )
        try:
            markers = tuple(_read_marker(k, v) for k, v in table["markers"].items())
            held = tuple(table.get("held", ()))
            loaded = cls(table["name"], markers, held, table.get("source", ""))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise FileError(
                f"{path}: every marker needs link, position_mm (3 numbers) and "
                f"placement_sd_mm; found a fault at {error}."
            ) from None
        farthest = 1000 * max((max(map(abs, m.position)) for m in markers), default=0)
        if not (farthest == 0 or _FARTHEST[0] < farthest < _FARTHEST[1]):
            raise FileError(
                f"{path}: expected positions on a body in mm, found none farther than "
                f"{farthest:.3g} mm from its segment: position_mm may be in another "
                "unit, such as meters."
            )
        return loaded

    def toml(self) -> str:
        """Return the text of a TOML file that :meth:`load` reads back."""
        import tomli_w

        table = {
            "format": _FORMAT,
            "name": self.name,
            "source": self.source,
            "held": list(self.held),
            "markers": {m.label: _write_marker(m) for m in self.markers},
        }
        return tomli_w.dumps(table)

    def write(self, path: str | Path) -> None:
        """Write the set as a TOML file that :meth:`load` reads back."""
        Path(path).write_text(self.toml(), encoding="utf-8")

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the markers, in order."""
        return tuple(marker.label for marker in self.markers)

    def columns(self, labels: Sequence[str]) -> Indices:
        """Find each marker among a recording's labels, (M,); -1 where it is missing.

        A subject prefix is ignored (``ADL001:RSHO1`` is ``RSHO1``), as is case, and an
        alias counts as the label. ``RSHO #1`` and ``RSHO #2`` are markers that a file
        names alike.

        Raises
        ------
        MarkerMismatch
            When two labels could be the same marker.
        """
        places: dict[str, list[int]] = {}
        for column, label in enumerate(labels):
            for name in label_keys([label]):
                places.setdefault(name, []).append(column)
        found = np.full(len(self.markers), -1, dtype=np.int64)
        for i, marker in enumerate(self.markers):
            names = [marker.label, *marker.aliases]
            matches = [c for n in names for c in places.get(n.casefold(), [])]
            if len(matches) > 1:
                raise MarkerMismatch(
                    _several(marker.label, [labels[c] for c in matches])
                )
            if matches:
                found[i] = matches[0]
        return found

    def pick(self, labels: Sequence[str], markers: Array) -> Array:
        """Sort a recording's markers into this set's order.

        Parameters
        ----------
        labels : sequence of str
            Labels of the recording.
        markers : (..., len(labels), 3) array
            Positions.

        Returns
        -------
        (..., M, 3) array
            Positions of this set's markers; NaN where the recording has none.
        """
        columns = self.columns(labels)
        picked = np.full((*markers.shape[:-2], len(columns), 3), np.nan)
        picked[..., columns >= 0, :] = markers[..., columns[columns >= 0], :]
        return picked

    def without_static(self) -> MarkerSet:
        """Return the set without the static-only markers."""
        return self.only(m.label for m in self.markers if not m.static_only)

    def all_tracked(self) -> MarkerSet:
        """Return the set with its static-only markers tracked like the others."""
        markers = tuple(replace(marker, static_only=False) for marker in self.markers)
        return replace(self, markers=markers)

    def only(self, labels: Iterable[str]) -> MarkerSet:
        """Return the set with only these markers, in its own order."""
        kept = set(labels)
        return replace(self, markers=tuple(m for m in self.markers if m.label in kept))

    def at(self, positions: Array) -> MarkerSet:
        """Return the set with markers at these positions, (M, 3) m in their links."""
        moved = tuple(
            replace(marker, position=(float(p[0]), float(p[1]), float(p[2])))
            for marker, p in zip(self.markers, positions, strict=True)
        )
        return replace(self, markers=moved)


def label_keys(labels: Iterable[str]) -> set[str]:
    """Names that labels stand for: without a subject, case and a reader's number.

    >>> sorted(label_keys(["Ann:RSHO", "C7 #2"]))
    ['c7', 'c7 #2', 'rsho']
    """
    keys = {label.rsplit(":", 1)[-1].strip().casefold() for label in labels}
    return keys | {_NUMBER.sub("", key) for key in keys}


def _several(marker: str, labels: Sequence[str]) -> str:
    """Say that a marker matches several labels, and what would settle it."""
    subjects = [label.rpartition(":")[0] for label in labels]
    cure = f"rename the others, as with --rename '{labels[-1]}=OTHER'"
    if len({subject.casefold() for subject in subjects}) == len(labels):
        known = ", ".join(subject for subject in subjects if subject)
        cure = f"choose one subject with --subject-prefix ({known})"
    return f"marker {marker} must match one label, found {', '.join(labels)}; {cure}."


def _read_marker(label: str, table: Mapping[str, Any]) -> Marker:
    x, y, z = (float(value) / 1000 for value in table["position_mm"])
    spread = table["placement_sd_mm"]
    sx, sy, sz = (
        float(value) / 1000
        for value in (spread if isinstance(spread, list) else 3 * [spread])
    )
    return Marker(
        label,
        str(table["link"]),
        (x, y, z),
        (sx, sy, sz),
        bool(table.get("static_only", False)),
        tuple(table.get("aliases", ())),
        float(table.get("weight", 1.0)),
        bool(table.get("free_turn", False)),
    )


def _in_mm(meters: float) -> float:
    """Return millimeters as people write them: 82.2, not 82.19999999999999."""
    plain = round(1000 * meters, 9)
    return plain if plain / 1000 == meters else 1000 * meters


def _write_marker(marker: Marker) -> dict[str, object]:
    table: dict[str, object] = {
        "link": marker.link,
        "position_mm": [_in_mm(value) for value in marker.position],
        "placement_sd_mm": [_in_mm(value) for value in marker.placement_sd],
    }
    if marker.static_only:
        table["static_only"] = True
    if marker.aliases:
        table["aliases"] = list(marker.aliases)
    if marker.weight != 1:
        table["weight"] = marker.weight
    if marker.free_turn:
        table["free_turn"] = True
    return table
