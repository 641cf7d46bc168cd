"""Find the marker channels of an LSL stream in its description."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree import ElementTree

from ikns.errors import InvalidInput, StreamError
from ikns.recording.files.lsl_channels import MarkerChannels, marker_channels


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


def read_lsl_layout(
    xml: str, source: str, *, unit: str | None = None
) -> MarkerChannels:
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
    described = (
        {field.tag: field.text or "" for field in channel}
        for channel in ElementTree.fromstring(xml).iter("channel")
    )
    try:
        return marker_channels(
            described,
            unit=unit,
            unit_remedy="; say which it is with the option unit, as in "
            f"{source}?unit=mm",
        )
    except InvalidInput as fault:
        raise StreamError(f"{source}: {fault}") from None
