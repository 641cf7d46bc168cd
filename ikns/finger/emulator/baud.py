"""Bit rates of a servo and the values of its baud rate register."""

from __future__ import annotations

from ikns.errors import InvalidInput
from ikns.finger.models import Model

_CODES = (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000)


def baud_rate(model: Model, code: int) -> float:
    """Bits per second of a register value.

    >>> from ikns.finger.models import MODELS
    >>> baud_rate(MODELS["xl430"], 1), baud_rate(MODELS["ax12"], 1)
    (57600, 1000000.0)
    """
    return _CODES[code] if model.protocol == 2 else 2_000_000 / (code + 1)


def baud_code(model: Model, baud: int) -> int:
    """Register value of a bit rate.

    Raises
    ------
    InvalidInput
        When the model does not support this rate.
    """
    if model.protocol == 1:
        if 7843 <= baud <= 1_000_000:
            return round(2_000_000 / baud) - 1
    elif baud in _CODES:
        return _CODES.index(baud)
    known = "7843 to 1000000"
    if model.protocol == 2:
        known = ", ".join(map(str, _CODES))
    raise InvalidInput(f"the {model.name} has no rate {baud}, only {known}.")
