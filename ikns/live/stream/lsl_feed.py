"""An LSL MoCap stream as a live source."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.errors import StreamError
from ikns.live.stream.frame import Event, Frame
from ikns.live.stream.lsl_layout import read_lsl_layout
from ikns.live.stream.lsl_library import lsl
from ikns.live.stream.lsl_numbers import Numbers
from ikns.live.stream.lsl_search import Wanted, find_stream, find_successor
from ikns.recording.files.lsl_channels import MarkerChannels

#: Longest call into liblsl, s, so that Ctrl-C is handled.
_SLICE = 0.2
#: Seconds of frames kept for a busy reader; the oldest frames beyond that are lost.
_BUFFER = 10
#: After this many seconds without a frame a stream is checked for being alive.
_SILENCE = 5.0
#: Frames are counted for so long where the stream names no rate, s.
_COUNTED = 1.0
#: Seconds it then has to respond over the network.
_ALIVE_TIMEOUT = 2.0


@dataclass(frozen=True, eq=False)
class _Open:
    found: Any
    inlet: Any
    layout: MarkerChannels
    rate: float
    clock_offset: float


class LslFeed:
    """Read one LSL stream, and reconnect to it after a break, to no other.

    Parameters
    ----------
    wanted : Wanted
        The stream; without a name, any MoCap stream.
    unit : str, optional
        Unit of its positions, whatever its description says.
    timeout : float
        Seconds for the stream to answer.
    this_machine : bool
        Search on this machine only.

    Attributes
    ----------
    meters_per_unit : float
        Length of the unit of most positions, m.

    Raises
    ------
    StreamError
        When there is no such stream or more than one, when it is not of type MoCap, has
        no unit, or has no rate and sends no frames that show one.
    """

    speed = 1.0

    def __init__(
        self,
        wanted: Wanted,
        *,
        unit: str | None = None,
        timeout: float = 5.0,
        this_machine: bool = False,
    ) -> None:
        self.name = f"lsl:{wanted.name}"
        self.events: deque[Event] = deque(maxlen=1000)
        self._pylsl = lsl(self.name, this_machine=this_machine)
        self._timeout, self._unit = timeout, unit
        try:
            found = find_stream(self._pylsl, wanted, timeout=timeout)
        except StreamError as error:
            raise StreamError(f"{self.name}: {error}") from None
        opened = self._connect(found)
        self.labels, self._nominal_rate = opened.layout.labels, opened.rate
        self.meters_per_unit = float(np.median(opened.layout.scale))
        self.rate = self._nominal_rate or self._count_rate(opened.inlet)
        self._open: _Open | None = opened
        self._reading: _Open | None = opened
        self._silent_since = time.monotonic()
        self._checking = False
        self._first_offset, self._ahead = opened.clock_offset, 0.0
        self._first = found
        self._changed = threading.Condition()
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
            with self._changed:
                if self._open is None:
                    self._changed.wait(min(left, _SLICE))
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
            # Its machine may have been restarted; times continue in the first clock.
            self._ahead = opened.clock_offset - self._first_offset
        device_time = stamp + self._ahead
        number = self._numbers.next(device_time)
        if self._numbers.uneven and not self._told_uneven:
            self._told_uneven = True
            self._tell("time stamps are uneven, so lost frames cannot be counted.")
        return Frame(number, device_time, received, opened.layout.markers(sample))

    def skip(self) -> None:
        """Forget the frames that came but were not read.

        LSL keeps no time of receipt, so that frames that waited would seem to come now.
        """
        opened = self._open
        if opened is not None:
            opened.inlet.flush()
            self._numbers.bridge()

    def close(self) -> None:
        """Close the stream."""
        with self._changed:
            self._closed = True
            self._open = self._reading = None
            self._changed.notify_all()

    def _tell(self, text: str) -> None:
        self.events.append(Event(time.monotonic(), f"{self.name}: {text}"))

    def _count_rate(self, inlet: Any) -> float:
        """Count frames for a second, for a stream without a nominal rate."""
        stamps: list[float] = []
        give_up = time.monotonic() + self._timeout + _COUNTED
        while time.monotonic() < give_up:
            try:
                sample, stamp = inlet.pull_sample(_SLICE)
            except RuntimeError:
                break
            if sample is not None:
                stamps.append(stamp)
                if stamp - stamps[0] >= _COUNTED:
                    break
        seconds = max(stamps) - min(stamps) if stamps else 0.0
        if not seconds > 0:
            raise StreamError(
                f"{self.name}: expected a nominal rate, or frames to count it, found a "
                f"rate of 0 and {len(stamps)} frames within {self._timeout:g} s."
            )
        rate = (len(stamps) - 1) / seconds
        self._tell(
            f"the stream has no nominal rate; {rate:.1f} frames/s were counted in its "
            f"first {seconds:.1f} s."
        )
        return rate

    def _connect(self, found: Any) -> _Open:
        """Open a stream; frames are buffered from the end of this call on."""
        if found.type().casefold() != "mocap":
            raise StreamError(
                f"{self.name}: expected an LSL stream of type MoCap, found "
                f"{found.type() or 'no type'}."
            )
        rate = float(found.nominal_srate())
        if not (math.isfinite(rate) and rate >= 0):  # 0 stands for irregular
            raise StreamError(
                f"{self.name}: expected a rate of 0 frames/s or more, found {rate:g}."
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
            xml = inlet.info(self._timeout).as_xml()
            layout = read_lsl_layout(xml, self.name, unit=self._unit)
            offset = inlet.time_correction(self._timeout)
            offset += time.monotonic() - self._pylsl.local_clock()
            inlet.open_stream(self._timeout)
        except self._pylsl.util.TimeoutError:
            raise StreamError(
                f"{self.name}: expected the stream to answer within "
                f"{self._timeout:g} s; a firewall may be blocking it."
            ) from None
        except RuntimeError as error:  # the root of pylsl's errors
            raise StreamError(f"{self.name}: cannot be opened ({error}).") from None
        return _Open(found, inlet, layout, rate, offset)

    def _check(self, opened: _Open) -> None:
        """Drop a silent stream unless it responds; a cut cable closes no connection."""
        uid = opened.found.uid()
        answers = self._pylsl.resolve_byprop("uid", uid, 1, 0.97 * _ALIVE_TIMEOUT)
        if not answers and opened is self._open:
            self._lose()
        self._silent_since = time.monotonic()
        self._checking = False

    def _lose(self) -> None:
        with self._changed:
            if self._open is None:  # noticed already, or closed
                return
            self._open = self._reading = None
        self._tell("the stream was interrupted.")
        threading.Thread(target=self._search_again, daemon=True).start()

    def _search_again(self) -> None:
        """Search for the stream until it is back with the same markers."""
        told = ""
        while not self._closed:
            try:
                found = find_successor(self._pylsl, self._first, timeout=1.0)
                if found is None:
                    continue
                opened = self._connect(found)
                if (opened.layout.labels, opened.rate) != (
                    self.labels,
                    self._nominal_rate,
                ):
                    raise StreamError(
                        "came back with different markers or a different rate and is "
                        "not read."
                    )
            except StreamError as error:
                text = str(error).removeprefix(f"{self.name}: ")
                if text != told:
                    told = text
                    self._tell(text)
                time.sleep(_SLICE)
                continue
            with self._changed:
                if not self._closed:
                    self._open = opened
                    self._silent_since = time.monotonic()
                    self._tell(
                        "the stream is back."
                        if found.source_id()
                        else "a stream of the same name and host is back; without a "
                        "source id it may be another."
                    )
                self._changed.notify_all()
            return
