"""Send markers as a live LSL MoCap stream."""

from __future__ import annotations

import socket
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ikns.errors import InvalidInput
from ikns.live.stream.loopback import only_from_this_machine
from ikns.live.stream.lsl_layout import channel_fields
from ikns.live.stream.lsl_library import lsl


class LslOutlet:
    """An LSL stream of type MoCap with PositionX, PositionY, PositionZ in meters.

    Parameters
    ----------
    labels : sequence of M str
    rate : float
        Frames per second.
    name : str
        Name of the stream. Its source id contains name and machine, so readers find it
        again after a break.
    everywhere : bool
        Let other machines find and read the stream; off by default, as markers are
        personal data.

    Attributes
    ----------
    open_ports : list of int
        Ports that other machines can reach although `everywhere` is off; none on Linux.

    Raises
    ------
    InvalidInput
        When the rate is not above 0 or there are no labels.
    StreamError
        When pylsl is not installed.
    """

    def __init__(
        self,
        labels: Sequence[str],
        rate: float,
        *,
        name: str,
        everywhere: bool = False,
    ) -> None:
        if not (np.isfinite(rate) and rate > 0):
            raise InvalidInput(f"expected a rate above 0 frames/s, found {rate:g}.")
        if not labels:
            raise InvalidInput("expected one marker or more to send, found none.")
        self._pylsl = lsl("an LSL stream", this_machine=not everywhere)
        self.labels, self.rate, self.name = tuple(labels), rate, name
        info = self._pylsl.StreamInfo(
            name,
            "MoCap",
            3 * len(labels),
            rate,
            "double64",
            f"ikns:{socket.gethostname()}:{name}",
        )
        _describe(info.desc(), self.labels)
        self.open_ports: list[int] = []
        self._outlet: Any
        if everywhere:
            self._outlet = self._pylsl.StreamOutlet(info)
        else:
            with only_from_this_machine() as self.open_ports:
                self._outlet = self._pylsl.StreamOutlet(info)
        # On some systems LSL's clock differs from time.monotonic.
        self._lsl_ahead = self._pylsl.local_clock() - time.monotonic()

    @property
    def has_listener(self) -> bool:
        """Whether someone reads the stream now."""
        return bool(self._outlet.have_consumers())

    def wait_for_listener(self, timeout: float) -> bool:
        """Wait until someone reads the stream, `timeout` seconds at most."""
        return bool(self._outlet.wait_for_consumers(timeout))

    def push(self, markers: ArrayLike, at: float | None = None) -> None:
        """Send one frame.

        Parameters
        ----------
        markers : (M, 3) array
            Meters; NaN where a marker was not seen.
        at : float, optional
            When it was recorded, s of `time.monotonic`; now by default.
        """
        sample = np.asarray(markers, dtype=np.float64)
        if sample.shape != (len(self.labels), 3):
            raise InvalidInput(
                f"expected markers ({len(self.labels)}, 3), found {sample.shape}."
            )
        stamp = (time.monotonic() if at is None else at) + self._lsl_ahead
        self._outlet.push_sample(sample.ravel().tolist(), stamp)

    def close(self) -> None:
        """Close the stream; frames not yet read are lost."""
        self._outlet = None

    def __enter__(self) -> LslOutlet:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()


def _describe(desc: Any, labels: Sequence[str]) -> None:
    channels = desc.append_child("channels")
    for fields in channel_fields(labels):
        channel = channels.append_child("channel")
        for key, value in fields.items():
            channel.append_child_value(key, value)
    markers = desc.append_child("setup").append_child("markers")
    for label in labels:
        markers.append_child("marker").append_child_value("label", label)
    acquisition = desc.append_child("acquisition")
    acquisition.append_child_value("manufacturer", "ikns")
    acquisition.append_child_value("model", "recording")
