"""Faults to inject between a computer and a servo."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ikns.errors import InvalidInput

#: Kinds of faults, and what each one does with its value, if it takes one.
FAULTS: dict[str, str] = {
    "silence": "nothing passes, in either direction",
    "mute": "the servo obeys but does not respond",
    "delay": "responses come VALUE seconds late (0.05)",
    "crc": "responses have a wrong checksum",
    "id": "responses carry the id VALUE (one more)",
    "alert": "an electrical shock switches the motor off until a reboot",
    "overheat": "the motor is hotter than allowed and switches off",
    "power": "the supply fails for a moment; the servo starts again",
    "unplug": "the adapter is unplugged in the middle of a response",
}
_VALUES = {"delay": 0.05, "id": math.nan}
#: Kinds that happen at an instant and have no duration.
MOMENTARY = ("alert", "overheat", "power")


@dataclass(frozen=True)
class Fault:
    """A fault and its time.

    Parameters
    ----------
    kind : str
        One of :data:`FAULTS`.
    start : float
        Seconds after the start of the emulator.
    duration : float
        Seconds; infinite: until the end.
    value : float
        NaN for kinds without a value.
    """

    kind: str
    start: float = 0.0
    duration: float = math.inf
    value: float = math.nan

    def active(self, now: float) -> bool:
        """Whether it is active at a time, s after the start."""
        return self.start <= now < self.start + self.duration


def parse_fault(text: str) -> Fault:
    """Read a fault from ``KIND[=VALUE]@START[+DURATION]``, seconds.

    Raises
    ------
    InvalidInput
        When it is not of this form or no such kind exists.

    Examples
    --------
    >>> parse_fault("delay=0.2@5+1.5")
    Fault(kind='delay', start=5.0, duration=1.5, value=0.2)
    """
    number = r"\d+(?:\.\d+)?"
    form = rf"(\w+)(?:=({number}))?@({number})(?:\+({number}))?"
    match = re.fullmatch(form, text.strip())
    if match is None or match[1] not in FAULTS:
        raise InvalidInput(
            f"the fault '{text}' is not KIND[=VALUE]@START[+DURATION] in seconds with "
            f"KIND one of {', '.join(FAULTS)}."
        )
    kind, value, start, duration = match.groups()
    if value is not None and kind not in _VALUES:
        raise InvalidInput(f"the fault '{kind}' takes no value, but '{text}' has one.")
    return Fault(
        kind,
        float(start),
        float(duration) if duration else math.inf,
        _VALUES.get(kind, math.nan) if value is None else float(value),
    )
