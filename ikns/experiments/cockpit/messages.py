"""Messages of a page: JSON objects of a few known entries, everything else refused."""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple, NoReturn

#: Longest name of a command or a condition, and longest reason or comment, characters.
_MAX_NAME, _MAX_TEXT = 32, 500
#: Largest integer that a page can count to.
_MAX_NUMBER = 2**53 - 1
#: Largest control signal, up or down. Pages send 0 to 1.
_MAX_C = 1e3


class Message(NamedTuple):
    """A message of a page.

    Parameters
    ----------
    n : int
        Number of the state that the page has shown; 0 for none.
    command : str
        Empty for none.
    text : str
        Reason or comment.
    condition : str
        Condition of the control signal; empty without one.
    c : float or None
        Control signal; NaN where the page has none, None where it sends none.
    device : str
        What the signal is read from, in words; empty for none.
    """

    n: int = 0
    command: str = ""
    text: str = ""
    condition: str = ""
    c: float | None = None
    device: str = ""


def read_message(sent: str | bytes) -> Message:
    """Read a message of a page.

    Raises
    ------
    ValueError
        When it is not what a page sends.

    Examples
    --------
    >>> read_message('{"n": 7, "condition": "mouse", "c": 0.5}')
    Message(n=7, command='', text='', condition='mouse', c=0.5, device='')
    >>> read_message('{"n": 1e999}')
    Traceback (most recent call last):
    ValueError: expected a whole number n, found inf
    """
    try:
        told = json.loads(sent, parse_constant=_refuse_constant)
    except RecursionError:
        raise ValueError("expected a flat JSON object") from None
    if not isinstance(told, dict) or not told.keys() <= set(Message._fields):
        raise ValueError(f"expected an object of {', '.join(Message._fields)}")
    n = told.get("n", 0)
    if type(n) is not int or not 0 <= n <= _MAX_NUMBER:
        raise ValueError(f"expected a whole number n, found {n!r}")
    return Message(
        n,
        _text(told, "command", _MAX_NAME),
        _text(told, "text", _MAX_TEXT),
        _text(told, "condition", _MAX_NAME),
        _signal(told["c"]) if "c" in told else None,
        _text(told, "device", _MAX_TEXT),
    )


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"expected a number, found {name}")


def _text(told: dict[str, Any], name: str, longest: int) -> str:
    text = told.get(name, "")
    if not isinstance(text, str) or len(text) > longest:
        raise ValueError(f"expected {name} of up to {longest} characters")
    text.encode()  # half of a surrogate pair is no text: no file can hold it
    return text


def _signal(c: Any) -> float:
    if c is None:
        return math.nan
    if type(c) not in (int, float) or not abs(c) <= _MAX_C:
        raise ValueError(f"expected a number c, found {c!r:.40}")
    return float(c)
