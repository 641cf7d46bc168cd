"""Which channels of an LSL stream are the coordinates of markers.

The convention is the MoCap metadata of XDF (https://github.com/sccn/xdf/wiki), as
written by the vendors' LSL apps: channels of type PositionX, PositionY and PositionZ
that name their marker and their unit. Channels that name an object are rigid bodies.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.errors import InvalidInput
from ikns.recording.files.conversion import METERS


@dataclass(frozen=True, eq=False)
class MarkerChannels:
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

    def markers(self, samples: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the markers of samples (..., channels), (..., M, 3) meters."""
        return samples[..., self.columns] * self.scale


def marker_channels(
    channels: Iterable[Mapping[str, str]],
    *,
    unit: str | None = None,
    unit_remedy: str = "",
) -> MarkerChannels:
    """Find the markers among described channels.

    Parameters
    ----------
    channels : iterable of mapping
        Label, type, marker, object and unit of every channel; what is not said is
        missing or empty.
    unit : str, optional
        Unit of all positions, whatever the description says.
    unit_remedy : str
        What would settle an unknown unit, for the message.

    Raises
    ------
    InvalidInput
        When there are no markers, or one lacks a coordinate or a unit that is known.
    """
    places: dict[str, dict[str, tuple[int, float]]] = {}
    types = []
    for column, channel in enumerate(channels):
        kind = channel.get("type", "").strip()
        types.append(kind or "none")
        axis = kind.casefold().removeprefix("position")
        if axis not in ("x", "y", "z") or channel.get("object", "").strip():
            continue
        label = channel.get("label", "").strip()
        marker = channel.get("marker", "").strip()
        marker = marker or label.removesuffix(f"_{axis}").removesuffix(f"_{kind[-1]}")
        said = unit or channel.get("unit", "").strip()
        if said.casefold() not in METERS:
            raise InvalidInput(
                f"expected a unit of mm, cm or m for channel {label or column + 1}, "
                f"found {said or 'none'}{unit_remedy}."
            )
        axes = places.setdefault(marker, {})
        if axis in axes:
            raise InvalidInput(
                f"expected one {kind} channel for marker {marker}, found two."
            )
        axes[axis] = column, METERS[said.casefold()]
    if not places:
        found = ", ".join(sorted(set(types))) or "no description of channels"
        raise InvalidInput(
            f"expected channels of type PositionX, PositionY and PositionZ with marker "
            f"names, found {found}."
        )
    for marker, axes in places.items():
        if len(axes) < 3:
            raise InvalidInput(
                f"expected PositionX, PositionY and PositionZ of marker {marker}, "
                f"found only {', '.join(sorted(axes))}."
            )
    table = np.array([[axes[axis] for axis in "xyz"] for axes in places.values()])
    return MarkerChannels(tuple(places), table[..., 0].astype(np.int64), table[..., 1])
