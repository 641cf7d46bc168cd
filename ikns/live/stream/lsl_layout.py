"""Find the marker channels of an LSL stream.

The convention is the MoCap metadata of XDF (https://github.com/sccn/xdf/wiki), as
written by the vendors' LSL apps: channels of type PositionX, PositionY and PositionZ
that name their marker and their unit. Channels that name an object are rigid bodies.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ikns.errors import StreamError
from ikns.recording.files.conversion import METERS


@dataclass(frozen=True, eq=False)
class LslLayout:
    """Channels of each marker's coordinates.

    Parameters
    ----------
    labels : tuple of M str
    columns : (M, 3) integer array
        Channel of each coordinate.
    scale : (M, 3) array
        Meters per unit of the channel.
    """

    labels: tuple[str, ...]
    columns: NDArray[np.int64]
    scale: NDArray[np.float64]

    def markers(self, sample: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the markers of one sample, (M, 3) meters."""
        return sample[self.columns] * self.scale


def channel_fields(labels: Iterable[str]) -> Iterator[dict[str, str]]:
    """Describe three channels for each marker."""
    for label in labels:
        for axis in "XYZ":
            yield {
                "label": f"{label}_{axis}",
                "marker": label,
                "type": f"Position{axis}",
                "unit": "meters",
            }


def read_lsl_layout(xml: str, source: str, *, unit: str | None = None) -> LslLayout:
    """Read a stream's description.

    Parameters
    ----------
    xml : str
        The full stream info, as ``StreamInfo.as_xml`` writes it.
    source : str
        Address of the stream, for messages.
    unit : str, optional
        Unit of all positions, whatever the description says.

    Raises
    ------
    StreamError
        When there are no markers, or one lacks a coordinate or a unit that is known.
    """
    places: dict[str, dict[str, tuple[int, float]]] = {}
    types = []
    for column, channel in enumerate(ElementTree.fromstring(xml).iter("channel")):
        kind = channel.findtext("type", "").strip()
        types.append(kind or "none")
        axis = kind.casefold().removeprefix("position")
        if axis not in ("x", "y", "z") or channel.findtext("object", "").strip():
            continue
        label = channel.findtext("label", "").strip()
        marker = channel.findtext("marker", "").strip()
        marker = marker or label.removesuffix(f"_{axis}").removesuffix(f"_{kind[-1]}")
        said = unit or channel.findtext("unit", "").strip()
        if said.casefold() not in METERS:
            raise StreamError(
                f"{source}: expected a unit of mm, cm or m for channel "
                f"{label or column + 1}, found {said or 'none'}; say which it is with "
                f"the option unit, as in {source}?unit=mm."
            )
        axes = places.setdefault(marker, {})
        if axis in axes:
            raise StreamError(
                f"{source}: expected one {kind} channel for marker {marker}, found two."
            )
        axes[axis] = column, METERS[said.casefold()]
    if not places:
        found = ", ".join(sorted(set(types))) or "no description of channels"
        raise StreamError(
            f"{source}: expected channels of type PositionX, PositionY and PositionZ "
            f"with marker names, found {found}."
        )
    for marker, axes in places.items():
        if len(axes) < 3:
            raise StreamError(
                f"{source}: expected PositionX, PositionY and PositionZ of marker "
                f"{marker}, found only {', '.join(sorted(axes))}."
            )
    table = np.array([[axes[axis] for axis in "xyz"] for axes in places.values()])
    return LslLayout(tuple(places), table[..., 0].astype(np.int64), table[..., 1])
