"""The decisions of the live loop as two LSL streams.

Their nominal rate is LSL's 0 for "irregular": stamps are the times of receipt that the
session has, and readers such as pyxdf replace the stamps of a stream with a rate by a
straight line through them. The frame rate is in the description.
"""

from __future__ import annotations

import socket
import time
from typing import Any

from ikns.errors import StreamError
from ikns.live.publish.publisher import PublishedFrame
from ikns.live.session.channels import STATES
from ikns.live.stream.loopback import only_from_this_machine
from ikns.live.stream.lsl_library import lsl, only_this_machine
from ikns.live.stream.lsl_search import describe_stream, quoted
from ikns.nullspace.signal_names import signal_names

#: What is added to the name for the stream of events.
EVENTS = "-events"
#: How long a stream of the same name has to answer, s; liblsl asks again after 0.5 s.
_SEARCH = 0.97
#: LSL drops what listeners have not received when a stream ends; they get so long, s.
_LINGER = 0.5


class LslSink:
    """Two LSL streams: NAME (a sample a frame) and NAME-events (type Markers).

    Parameters
    ----------
    name : str
    rate : float
        Frames per second, for the description.
    n_dof : int
        Number of control signals; 0: there is no stream of samples.
    everywhere : bool
        Let other machines find and read the streams.
    simulated : bool
        Whether the person is; stands in the description.

    Raises
    ------
    StreamError
        When another stream has one of the names, or pylsl is not installed.
    """

    def __init__(
        self,
        name: str,
        *,
        rate: float,
        n_dof: int = 1,
        everywhere: bool = False,
        simulated: bool = False,
    ) -> None:
        self._pylsl = lsl(f"publishing to lsl:{name}", this_machine=not everywhere)
        if everywhere and only_this_machine():
            raise StreamError(
                f"lsl:{name}: a source with scope=machine has limited LSL to "
                "this machine; leave out scope there, or here."
            )
        _check_free(self._pylsl, name)
        about = {
            "manufacturer": "ikns",
            "frame_rate": f"{rate:g}",
            "stamps": "time of receipt of the markers, as receive_time of the session",
            "simulated": "yes" if simulated else "no",
        }
        self._samples: Any = None
        if n_dof:
            self._samples = self._open(
                name, "MISC", "double64", _channels(n_dof), about, everywhere=everywhere
            )
        self._events = self._open(
            name + EVENTS,
            "Markers",
            "string",
            [("event", "")],
            about,
            everywhere=everywhere,
        )
        # On some systems LSL's clock differs from time.monotonic.
        self._lsl_ahead = self._pylsl.local_clock() - time.monotonic()

    def sample(self, at: float, sample: PublishedFrame) -> None:
        """Send a sample, stamped with a time of `time.monotonic`."""
        if self._samples is not None:
            self._samples.push_sample(sample.numbers, at + self._lsl_ahead)

    def event(self, at: float, words: str) -> None:
        """Send an event."""
        self._events.push_sample([words], at + self._lsl_ahead)

    def close(self) -> None:
        """Give listeners time for the last samples, and end both streams."""
        if any(
            each and each.have_consumers() for each in (self._samples, self._events)
        ):
            time.sleep(_LINGER)
        self._samples = self._events = None

    def _open(
        self,
        name: str,
        kind: str,
        form: str,
        channels: list[tuple[str, str]],
        about: dict[str, str],
        *,
        everywhere: bool,
    ) -> Any:
        info = self._pylsl.StreamInfo(
            name,
            kind,
            len(channels),
            self._pylsl.IRREGULAR_RATE,
            form,
            f"ikns:{socket.gethostname()}:{name}",
        )
        described = info.desc().append_child("channels")
        for label, unit in channels:
            channel = described.append_child("channel")
            channel.append_child_value("label", label)
            channel.append_child_value("type", kind)
            channel.append_child_value("unit", unit)
        acquisition = info.desc().append_child("acquisition")
        for key, value in about.items():
            acquisition.append_child_value(key, value)
        states = info.desc().append_child("states")
        for number, state in enumerate(STATES):
            node = states.append_child("state")
            node.append_child_value("value", str(number))
            node.append_child_value("name", state)
        if everywhere:
            return self._pylsl.StreamOutlet(info)
        with only_from_this_machine():
            return self._pylsl.StreamOutlet(info)


def _channels(n_dof: int) -> list[tuple[str, str]]:
    """Labels and units, in the order of a sample."""
    names = [*signal_names(n_dof), *signal_names(n_dof, "flexion")]
    return [
        *((name, "normalized") for name in names),
        ("state", "index of states"),
        ("residual", "meters"),
    ]


def _check_free(pylsl: Any, name: str) -> None:
    """Refuse a name that another stream has."""
    names = (name, name + EVENTS)
    predicate = " or ".join(f"name={quoted(each)}" for each in names)
    found = pylsl.resolve_bypred(predicate, 1, _SEARCH)
    if found:
        raise StreamError(
            f"lsl:{name}: expected a name to publish under that no LSL stream has, "
            f"found {describe_stream(found[0])}."
        )
