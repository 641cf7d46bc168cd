"""What someone has to know at once: why the finger does not move, and source events."""

from __future__ import annotations

from collections.abc import Callable

from ikns.live.control.safety import Transition
from ikns.live.stream import Event, Source
from ikns.motion.marker_ik.rejection_count import kind_of

#: A run that is not active says why from this time on, s; as long as it takes until a
#: finger that moved goes to its safe state.
_WHY_AFTER = 0.5
#: Without a frame for so long, that is the reason, s.
_SILENCE = 0.5


class Notices:
    """Decides what to tell, and tells each thing once.

    Parameters
    ----------
    source : Source
        Its events are told.
    tell : callable
        Called with the time since the start (s) and a sentence.

    Attributes
    ----------
    was_active : bool
        Whether the finger ever followed the signal.
    why : str
        Why the last frame is rejected, or that none came; empty if it is valid.
    """

    def __init__(self, source: Source, tell: Callable[[float, str], None]) -> None:
        self._source, self._tell = source, tell
        self._event: Event | None = None
        self._told: set[str] = set()
        self._frame_time = 0.0
        self.was_active = False
        self.why = "no frame arrived"

    def frame(self, now: float, rejection: str) -> None:
        """Take the result of a frame; `rejection` is empty if it is valid."""
        self._frame_time, self.why = now, rejection

    def transition(self, change: Transition) -> None:
        """Take a state transition."""
        if change.after == "active":
            self.was_active = True
        if change.after == "safe":
            self._tell(change.time, f"FINGER STOPPED: {change.reason}.")

    def check(self, now: float) -> None:
        """Tell what is new; call it with every frame and at least every 20 ms."""
        self._take_events(now)
        if self.was_active or now < _WHY_AFTER:
            return
        why = self.why if now - self._frame_time < _SILENCE else "no frame arrived"
        if why and kind_of(why) not in self._told:
            self._told.add(kind_of(why))
            self._tell(now, f"the finger has not moved after {now:.1f} s: {why}.")

    def _take_events(self, now: float) -> None:
        events = self._source.events
        if not events or events[-1] is self._event:
            return
        new: list[Event] = []
        for event in reversed(tuple(events)):
            if event is self._event:
                break
            new.append(event)
        self._event = new[0]
        for event in reversed(new):
            self._tell(now, event.text)
