"""Play a recording into an LSL outlet, on time and optionally with faults."""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np

from ikns.errors import InvalidInput
from ikns.live.stream.delays import Delays
from ikns.live.stream.faults import Faults, inject
from ikns.live.stream.lsl_outlet import LslOutlet
from ikns.live.stream.replay import frame_times, wait_until
from ikns.recording.recording import Recording

#: Seconds between the last frame and the end of the stream; frames that a listener has
#: not read when a stream ends are lost in LSL.
_LINGER = 0.5


@dataclass
class Broadcast:
    """What was sent.

    Parameters
    ----------
    frames : int
        Frames sent, repeated ones included.
    seconds : float
        From the first to the last.
    faults : Counter
        Frames affected, by kind; pairs for ``swap``.
    lateness : Delays
        How late the frames were sent, except those delayed on purpose.
    """

    frames: int
    seconds: float
    faults: Counter[str]
    lateness: Delays


def broadcast(
    recording: Recording,
    outlet: LslOutlet,
    *,
    speed: float = 1.0,
    loop: bool = False,
    faults: Faults | None = None,
    seed: int = 0,
    stop: threading.Event | None = None,
) -> Broadcast:
    """Send a recording frame by frame, on absolute deadlines.

    Parameters
    ----------
    recording : Recording
    outlet : LslOutlet
        With the recording's labels, and its rate times `speed`.
    speed : float
        Above 0.
    loop : bool
        Start over at the end, until `stop` is set or the process is interrupted.
    faults : Faults, optional
    seed : int
        Seed of the faults.
    stop : threading.Event, optional
        Ends the broadcast once it is set.

    Returns
    -------
    Broadcast
        Also after KeyboardInterrupt, which ends it.

    Raises
    ------
    InvalidInput
        When the speed is not above 0, or the recording has no rate.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise InvalidInput(f"expected a speed above 0, found {speed:g}.")
    rate, loop_seconds = frame_times(recording)
    n = len(recording.time)
    offsets = recording.time - recording.time[0]
    sent = Broadcast(0, 0.0, Counter(), Delays())
    start = time.monotonic()
    held_until = -math.inf
    schedule = inject(
        itertools.count() if loop else range(n),
        faults or Faults(),
        rate * speed,
        np.random.default_rng(seed),
        sent.faults,
    )
    try:
        for item in schedule:
            if stop is not None and stop.is_set():
                break
            loops, row = divmod(item.frame, n)
            due = start + (float(offsets[row]) + loops * loop_seconds) / speed
            if item.hold:
                held_until = due + item.hold
            now = wait_until(max(due, held_until))
            outlet.push(recording.markers[item.content % n], due)
            sent.frames += 1
            if due >= held_until:
                sent.lateness.add(now - due)
        wait_until(time.monotonic() + _LINGER)
    except KeyboardInterrupt:
        pass
    sent.seconds = time.monotonic() - start
    return sent
