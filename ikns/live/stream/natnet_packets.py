"""What a NatNet server says: its version, its markers' names, and their positions."""

from __future__ import annotations

import math
import struct
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.errors import StreamError

#: Message numbers of the protocol (NatNetTypes.h of OptiTrack's SDK).
CONNECT, SERVER_INFO, REQUEST, RESPONSE = 0, 1, 2, 3
REQUEST_MODELS, MODELS, FRAME, KEEP_ALIVE = 4, 5, 7, 10
#: Major versions that are read; Motive 2 speaks 3, Motive 3 speaks 4.
_MAJOR = (3, 4)
#: Marker set that has the markers of all others once more.
_ALL = "all"
_SHOW = "create a marker set or skeleton in Motive, and turn on Labeled Markers and "
_SHOW += "Marker Sets in its streaming settings"


def message(number: int, text: str = "") -> bytes:
    """Return a message to a server."""
    content = text.encode() + b"\0"
    return struct.pack("<HH", number, len(content)) + content


def split_message(packet: bytes) -> tuple[int, bytes]:
    r"""Return the number and the content of a message; -1 for what is none.

    >>> split_message(message(REQUEST, "FrameRate"))
    (2, b'FrameRate\x00')
    >>> split_message(b"noise")
    (-1, b'')
    """
    if len(packet) < 4:
        return -1, b""
    number, size = struct.unpack_from("<HH", packet)
    content = packet[4:]
    return (number, content) if len(content) == size else (-1, b"")


class ServerFacts:
    """What a server says of itself.

    Parameters
    ----------
    natnet : module
    content : bytes
    source : str
        Address, for messages.

    Attributes
    ----------
    version : natnet.Version
        Of the protocol.
    ticks : float
        Of the server's fine clock per second; NaN if it does not say.
    group : str
        Multicast group that frames are sent to; empty if it sends to each client.
    data_port : int

    Raises
    ------
    StreamError
        When the version of the protocol cannot be read.
    """

    def __init__(self, natnet: Any, content: bytes, source: str) -> None:
        try:
            info = natnet.ServerInfo.read_from_buffer(_buffer(natnet, content), None)
        except (struct.error, UnicodeDecodeError):
            raise StreamError(
                f"{source}: expected a NatNet server, found an invalid answer "
                f"of {len(content)} bytes."
            ) from None
        self.version = info.nat_net_protocol_version
        if self.version.major not in _MAJOR:
            raise StreamError(
                f"{source}: expected NatNet 3 or 4, found version {self.version} of "
                f"{info.application_name or 'a server'}; use Motive 2 or 3."
            )
        self.ticks, self.data_port, self.group = math.nan, 0, ""
        # Clock frequency, data port, multicast or not, its group; the library stops
        # before these.
        with_connection = struct.Struct("<QHB4B")
        if len(content) >= 264 + with_connection.size:
            ticks, port, shared, *group = with_connection.unpack_from(content, 264)
            self.ticks, self.data_port = float(ticks) or math.nan, port
            self.group = ".".join(map(str, group)) if shared else ""


class Models:
    """The labeled markers that a server describes.

    Marker sets with the name of a rigid body are left out, and so is the one of all
    markers. With several sets left, labels have the set's name before them.

    Parameters
    ----------
    natnet : module
    content : bytes
    version : natnet.Version
    source : str

    Attributes
    ----------
    labels : tuple of str

    Raises
    ------
    StreamError
        When the description cannot be read, or has no labeled markers.
    """

    def __init__(self, natnet: Any, content: bytes, version: Any, source: str) -> None:
        self._natnet, self._version = natnet, version
        try:
            found = natnet.DataDescriptions.read_from_buffer(
                _buffer(natnet, content), version
            )
        except (struct.error, UnicodeDecodeError, natnet.NatNetProtocolError):
            raise StreamError(
                f"{source}: the server's list of models cannot be read as NatNet "
                f"{version}."
            ) from None
        bodies = {body.name for body in found.rigid_bodies}
        sets = [
            (each.name, each.marker_names)
            for each in found.marker_sets
            if each.name != _ALL and each.name not in bodies and each.marker_names
        ]
        if not sets:
            what = (
                f"rigid bodies only ({', '.join(sorted(map(str, bodies)))})"
                if bodies
                else "unlabeled markers only"
            )
            raise StreamError(
                f"{source}: expected labeled markers, found {what}; {_SHOW}."
            )
        alone = len(sets) == 1
        self._sets = dict(sets)
        self.labels = tuple(
            marker if alone else f"{name}:{marker}"
            for name, markers in sets
            for marker in markers
        )

    def frame(self, content: bytes) -> tuple[Any, NDArray[np.float64]]:
        """Read a frame.

        A marker that Motive fills in from a model was not measured and is NaN, as is
        one that is occluded.

        Returns
        -------
        frame : natnet.DataFrame
        markers : (M, 3) array
            m in Motive's world frame.

        Raises
        ------
        ValueError
            When it is damaged, or has other markers than were described.
        """
        natnet = self._natnet
        try:
            frame = natnet.DataFrame.read_from_buffer(
                _buffer(natnet, content), self._version
            )
        except (struct.error, UnicodeDecodeError) as error:
            raise ValueError(str(error)) from None
        present = {each.model_name: each.marker_pos_list for each in frame.marker_sets}
        rows: list[tuple[float, ...]] = []
        for name, markers in self._sets.items():
            positions = present.get(name, ())
            if len(positions) != len(markers):
                raise ValueError(
                    f"expected {len(markers)} markers of {name}, found {len(positions)}"
                )
            rows += positions
        markers_in_world = np.array(rows, dtype=np.float64)
        not_measured = {
            marker.pos
            for marker in frame.labeled_markers
            if marker.occluded or marker.model_solved
        }
        if not_measured:
            markers_in_world[[row in not_measured for row in rows]] = np.nan
        return frame, markers_in_world


def _buffer(natnet: Any, content: bytes) -> Any:
    return _bounded(natnet.packet_buffer.PacketBuffer)(content)


@cache
def _bounded(buffer: Any) -> Any:
    """Return the library's buffer, which here ends where the packet ends.

    It reads texts beyond it, as many as a damaged count says.
    """

    class Bounded(buffer):
        def read_string(
            self, max_length: int | None = None, static_length: bool = False
        ) -> str:
            if self.pointer >= len(self.data):
                raise struct.error("it ends inside a text")
            return str(super().read_string(max_length, static_length))

        def read_float32_array(self, count: int) -> tuple[float, ...]:
            if self.pointer + 4 * count > len(self.data):
                raise struct.error("it ends inside numbers")
            return tuple(super().read_float32_array(count))

    return Bounded
