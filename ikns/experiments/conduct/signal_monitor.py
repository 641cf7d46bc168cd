"""The control signal as trials depend on it: is it there, and where is it from."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

#: A trial that needs a control signal begins only if one came within this time, s.
_SIGNAL_TIMEOUT = 1.0


class SignalMonitor:
    """The newest control signal, and the state of its source.

    Parameters
    ----------
    page_conditions : collection of str
        Conditions whose signal comes from the participant's page.

    Attributes
    ----------
    c : float
        Newest signal; NaN without one.
    page_connected : bool
        Whether a participant's page is connected.
    source : mapping
        Status of the source, as it reports it; ``stopped`` says why it no longer moves
        the finger, until it is connected again.
    fault : str
        Why there is no source; empty while there is one.
    moved_finger : bool
        Whether a finger followed the source that is gone.

    Examples
    --------
    >>> signal = SignalMonitor(["mouse"])
    >>> signal.missing("mouse", 0.0)
    ": open the participant's page"
    >>> signal.page_connected = True
    >>> signal.add(0.0, 0.5)
    >>> signal.missing("mouse", 0.5) is None
    True
    """

    def __init__(self, page_conditions: Collection[str]) -> None:
        self.page_conditions = frozenset(page_conditions)
        self.page_connected = False
        self.source: Mapping[str, Any] = {}
        self.fault = ""
        self.moved_finger = False
        self.c = self._received = math.nan

    def add(self, now: float, c: float) -> None:
        """Take the signal at a time; NaN where there is none."""
        self.c = c
        if math.isfinite(c):
            self._received = now

    def clear(self) -> None:
        """Forget the signal."""
        self.c = self._received = math.nan

    def stop_notice(self) -> dict[str, str] | None:
        """Return what has stopped and why, in words; None while nothing has.

        Returns
        -------
        dict or None
            ``title``, ``reason`` and ``remedy``.
        """
        reason = str(self.source.get("stopped") or self.fault).strip().rstrip(".")
        if not reason:
            return None
        finger = bool(self.source.get("finger")) or self.moved_finger
        checked = "the finger and what the reason names" if finger else "its source"
        return {
            "title": "Finger stopped" if finger else "No control signal",
            "reason": f"{reason[0].upper()}{reason[1:]}.",
            "remedy": f"Check {checked}, then press Connect again.",
        }

    def missing(self, condition: str, now: float) -> str | None:
        """Say what to do for a signal, to end a sentence; None if there is one."""
        from_page = condition in self.page_conditions
        page = self.page_connected or not from_page
        if now - self._received <= _SIGNAL_TIMEOUT and page:
            return None
        if not from_page:
            return ": check cameras, markers and cables"
        if not page:
            return ": open the participant's page"
        return (
            ": press a button of the gamepad on the participant's page"
            if condition == "gamepad"
            else ": bring the participant's page to the front"
        )

    def snapshot(self, condition: str) -> dict[str, Any]:
        """Return what pages show of the signal in a condition."""
        return {
            "c": self.c,
            "page_condition": condition in self.page_conditions,
            "page_connected": self.page_connected,
            "source": dict(self.source),
            "stopped": self.stop_notice(),
            "can_connect": self.stop_notice() is not None,
        }
