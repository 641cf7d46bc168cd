"""An LSL MoCap stream as a live source."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

from ikns.errors import StreamError
from ikns.live.stream.frame import Event, Frame
from ikns.live.stream.lsl_layout import LslLayout, read_lsl_layout
from ikns.live.stream.lsl_library import lsl
from ikns.live.stream.lsl_numbers import Numbers

__all__ = ["ANY_MOCAP", "LslFeed"]

#: Query for streams of type MoCap in any case; XPath 1.0 has no lower-case().
ANY_MOCAP = "translate(type,'MOCAP','mocap')='mocap'"

#: Longest call into liblsl, s, so that Ctrl-C is handled.
_SLICE = 0.2
#: Seconds of frames kept for a busy reader; the oldest frames beyond that are lost.
_BUFFER = 10
#: After this many seconds without a frame a stream is checked for being alive.
_SILENCE = 5.0
#: Seconds it then has to respond over the network.
_ALIVE_TIMEOUT = 2.0


@dataclass(frozen=True, eq=False)
class _Open:
    inlet: Any
    layout: LslLayout
    rate: float
    clock_offset: float
    search: str
    uid: str


class LslFeed:
    """Read one LSL stream, and reconnect to it after a break.

    Parameters
    ----------
    stream : str
        Name of the stream; empty for any MoCap stream.
    timeout : float
        Seconds for the stream to answer.
    this_machine : bool
        Search on this machine only.

    Raises
    ------
    StreamError
        When there is no such stream, it is not of type MoCap, or it has no rate.
    """

    speed = 1.0

    def __init__(
        self, stream: str, *, timeout: float = 5.0, this_machine: bool = False
    ) -> None:
        self.name = f"lsl:{stream}"
        self.events: deque[Event] = deque(maxlen=1000)
        self._pylsl = lsl(self.name, this_machine=this_machine)
        self._timeout = timeout
        opened = self._connect(self._find(stream))
        self.labels, self.rate = opened.layout.labels, opened.rate
        self._open: _Open | None = opened
        self._reading: _Open | None = opened
        self._silent_since = time.monotonic()
        self._checking = False
        self._first_offset, self._ahead = opened.clock_offset, 0.0
        self._search = opened.search
        self._found = threading.Condition()
        self._closed = False
        self._numbers = Numbers(self.rate)
        self._told_uneven = False

    @property
    def device(self) -> dict[str, float]:
        """``clock_offset``: seconds to add to device times for `time.monotonic`."""
        return {"clock_offset": self._first_offset}

    @property
    def ended(self) -> bool:
        """Whether it was closed; an interrupted stream may come back."""
        return self._closed

    def poll(self, timeout: float) -> Frame | None:
        """Return the next frame, None after `timeout` seconds."""
        give_up = time.monotonic() + timeout
        while True:
            left = max(0.0, give_up - time.monotonic())
            with self._found:
                if self._open is None:
                    self._found.wait(min(left, _SLICE))
                opened = self._open
            if opened is not None:
                try:
                    sample, stamp = opened.inlet.pull_sample(min(left, _SLICE))
                    received = time.monotonic()
                except RuntimeError:  # LostError, or any other error of liblsl
                    self._lose()
                    continue
                if sample is not None:
                    self._silent_since = received
                    return self._frame(opened, sample, stamp, received)
                if received - self._silent_since > _SILENCE and not self._checking:
                    self._checking = True
                    threading.Thread(
                        target=self._check, args=(opened,), daemon=True
                    ).start()
            if self._closed or time.monotonic() >= give_up:
                return None

    def _frame(
        self, opened: _Open, sample: Any, stamp: float, received: float
    ) -> Frame:
        if opened is not self._reading:  # reconnected since the last frame
            self._reading = opened
            self._numbers.bridge()
            # It may come from another machine; times continue in the first one's clock.
            self._ahead = opened.clock_offset - self._first_offset
        device_time = stamp + self._ahead
        number = self._numbers.next(device_time)
        if self._numbers.uneven and not self._told_uneven:
            self._told_uneven = True
            self._tell("time stamps are uneven, so lost frames cannot be counted.")
        return Frame(number, device_time, received, opened.layout.markers(sample))

    def close(self) -> None:
        """Close the stream."""
        with self._found:
            self._closed = True
            self._open = self._reading = None
            self._found.notify_all()

    def _tell(self, text: str) -> None:
        self.events.append(Event(time.monotonic(), f"{self.name}: {text}"))

    def _find(self, stream: str) -> Any:
        predicate = "name=" + _quoted(stream) if stream else ANY_MOCAP
        found = self._resolve(predicate, self._timeout)
        if found:
            return found[0]
        there = ", ".join(
            sorted(f"{info.name()} ({info.type()})" for info in self._streams())
        )
        raise StreamError(
            f"{self.name}: expected an LSL stream {stream or 'of type MoCap'} to "
            f"answer within {self._timeout:g} s, found {there or 'no stream at all'}."
        )

    def _resolve(self, predicate: str, timeout: float) -> list[Any]:
        # liblsl searches in waves 0.5 or 1.25 s apart; a timeout that coincides with
        # one is missed, and the call then takes 5 s longer.
        return list(self._pylsl.resolve_bypred(predicate, 1, 0.97 * timeout))

    def _streams(self) -> list[Any]:
        return list(self._pylsl.resolve_streams(min(self._timeout, 1.0)))

    def _connect(self, found: Any) -> _Open:
        """Open a stream; frames are buffered from the end of this call on."""
        if found.type().casefold() != "mocap":
            raise StreamError(
                f"{self.name}: expected an LSL stream of type MoCap, found "
                f"{found.type() or 'no type'}."
            )
        rate = float(found.nominal_srate())
        if not (math.isfinite(rate) and rate > 0):
            raise StreamError(
                f"{self.name}: expected a rate above 0 frames/s, found {rate:g}."
            )
        if found.channel_format() not in (
            self._pylsl.cf_float32,
            self._pylsl.cf_double64,
        ):
            raise StreamError(f"{self.name}: expected channels of float32 or double64.")
        try:
            inlet = self._pylsl.StreamInlet(
                found, max_buflen=_BUFFER, max_chunklen=1, recover=False, as_numpy=True
            )
            layout = read_lsl_layout(inlet.info(self._timeout).as_xml(), self.name)
            offset = inlet.time_correction(self._timeout)
            offset += time.monotonic() - self._pylsl.local_clock()
            inlet.open_stream(self._timeout)
        except self._pylsl.util.TimeoutError:
            raise StreamError(
                f"{self.name}: expected the stream to answer within "
                f"{self._timeout:g} s; a firewall may stand in between."
            ) from None
        except RuntimeError as error:  # the root of pylsl's errors
            raise StreamError(f"{self.name}: cannot be opened ({error}).") from None
        source_id = found.source_id()
        search = "source_id=" if source_id else "name="
        search += _quoted(source_id or found.name())
        return _Open(inlet, layout, rate, offset, search, found.uid())

    def _check(self, opened: _Open) -> None:
        """Drop a silent stream unless it responds; a cut cable closes no connection."""
        answers = self._resolve(f"uid='{opened.uid}'", _ALIVE_TIMEOUT)
        if not answers and opened is self._open:
            self._lose()
        self._silent_since = time.monotonic()
        self._checking = False

    def _lose(self) -> None:
        with self._found:
            if self._open is None:  # noticed already, or closed
                return
            self._open = self._reading = None
        self._tell("the stream broke off.")
        threading.Thread(target=self._search_again, daemon=True).start()

    def _search_again(self) -> None:
        """Search for the stream until it is back with the same markers."""
        told = ""
        while not self._closed:
            for found in self._resolve(self._search, 1.0):
                try:
                    opened = self._connect(found)
                    if (opened.layout.labels, opened.rate) != (self.labels, self.rate):
                        raise StreamError(
                            f"{self.name}: came back with other markers or another "
                            "rate and is not read."
                        )
                except StreamError as error:
                    if str(error) != told:
                        told = str(error)
                        self.events.append(Event(time.monotonic(), told))
                    time.sleep(_SLICE)
                    continue
                with self._found:
                    if not self._closed:
                        self._open = opened
                        self._silent_since = time.monotonic()
                        self._tell("the stream is back.")
                    self._found.notify_all()
                return


def _quoted(text: str) -> str:
    """Quote for XPath 1.0, which has no escapes.

    >>> print(_quoted("it's"))
    "it's"
    """
    mark = '"' if "'" in text else "'"
    if mark in text:
        raise StreamError(f"expected a name without one of the quotes, found {text}.")
    return f"{mark}{text}{mark}"
