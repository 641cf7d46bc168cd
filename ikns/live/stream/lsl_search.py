"""Find one LSL stream, and refuse to choose among several.

A search ends a stated time after the first answer (:data:`SETTLE`), so that a second
stream of the same name is seen too. Which of them answers first is chance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple
from urllib.parse import quote

from ikns.errors import StreamError

#: How long more streams may answer after the first, s. liblsl asks again after 0.5 s,
#: so that each stream is asked twice.
SETTLE = 1.0
#: Query for streams of type MoCap in any case; XPath 1.0 has no lower-case().
ANY_MOCAP = "translate(type,'MOCAP','mocap')='mocap'"
#: More streams than this are not listed; liblsl's own limit.
_MANY = 1024


class Wanted(NamedTuple):
    """What is asked of a stream; None and the empty name admit any.

    Parameters
    ----------
    name, source_id, host : str
    """

    name: str = ""
    source_id: str | None = None
    host: str | None = None

    def fits(self, info: Any) -> bool:
        """Whether a stream has the source id and the host."""
        return self.source_id in (None, info.source_id()) and self.host in (
            None,
            info.hostname(),
        )

    def __str__(self) -> str:
        """Describe it, to follow "expected an LSL stream"."""
        words = [self.name or "of type MoCap"]
        if self.source_id is not None:
            words.append(f"with source id {self.source_id or 'none'}")
        if self.host is not None:
            words.append(f"of host {self.host}")
        return " ".join(words)


def find_stream(pylsl: Any, wanted: Wanted, *, timeout: float) -> Any:
    """Return the description of the only stream that fits.

    Streams of another type count only where none is of type MoCap.

    Raises
    ------
    StreamError
        When there is none within `timeout` seconds, or more than one.
    """
    predicate = "name=" + quoted(wanted.name) if wanted.name else ANY_MOCAP
    found = _resolve(pylsl, predicate, timeout, enough=wanted.fits)
    fit = [info for info in found if wanted.fits(info)]
    fit = [info for info in fit if _is_mocap(info)] or fit
    if not fit:
        there = found or pylsl.resolve_streams(min(timeout, 1.0))
        listed = ", ".join(sorted(map(describe_stream, there))) or "no stream at all"
        raise StreamError(
            f"expected an LSL stream {wanted} to answer within {timeout:g} s, found "
            f"{listed}."
        )
    if len(fit) > 1:
        listed = " and ".join(sorted(map(describe_stream, fit)))
        raise StreamError(
            f"expected one LSL stream {wanted}, found {len(fit)}: {listed}; "
            f"{_how_to_choose(fit, wanted)}."
        )
    return fit[0]


def find_successor(pylsl: Any, lost: Any, *, timeout: float) -> Any | None:
    """Return the only stream with the name, source id and host of one that broke off.

    Returns
    -------
    stream description or None
        None when no stream of that name answers within `timeout` seconds.

    Raises
    ------
    StreamError
        When there is more than one, or only another stream of that name.
    """
    found = _resolve(pylsl, "name=" + quoted(lost.name()), timeout)
    found = [info for info in found if _is_mocap(info)]
    origin = Wanted(lost.name(), lost.source_id(), lost.hostname())
    fit = [info for info in found if origin.fits(info)]
    if len(fit) == 1 or not found:
        return fit[0] if fit else None
    listed = " and ".join(sorted(map(describe_stream, fit or found)))
    raise StreamError(
        f"expected one LSL stream {origin} to come back, found {listed}; none is read."
    )


def _is_mocap(info: Any) -> bool:
    return bool(info.type().casefold() == "mocap")


def _resolve(
    pylsl: Any,
    predicate: str,
    timeout: float,
    *,
    enough: Callable[[Any], bool] = lambda info: True,
) -> list[Any]:
    """Return all streams that answer until `SETTLE` after the first.

    Parameters
    ----------
    pylsl : module
    predicate : str
        Query in XPath 1.0.
    timeout : float
        For the first answer, s.
    enough : callable
        Whether a stream counts as an answer; the search for one goes on until then.
    """
    # liblsl searches in waves 0.5 or 1.25 s apart; a timeout that coincides with one
    # is missed, and the call then takes 5 s longer.
    found = list(pylsl.resolve_bypred(predicate, 1, 0.97 * timeout))
    if not found:
        return []
    while True:
        later = pylsl.resolve_bypred(predicate, _MANY, 0.97 * SETTLE)
        # A stream that ended meanwhile does not answer again.
        found = list({info.uid(): info for info in later or found}.values())
        timeout -= SETTLE
        if timeout <= 0 or any(map(enough, found)):
            return found


def describe_stream(info: Any) -> str:
    """Describe a stream so that it can be recognized."""
    return (
        f"{info.name()} ({info.type() or 'no type'}, host {info.hostname()}, source id "
        f"{info.source_id() or 'none'}, uid {info.uid()})"
    )


def _how_to_choose(found: list[Any], wanted: Wanted) -> str:
    """Say how an address chooses one of several streams."""
    names = [info.name() for info in found]
    if len(set(names)) == len(found):
        return f"choose one by its name, as in lsl:{names[0]}"
    given = ""
    if wanted.source_id is not None:
        given = f"&source_id={quote(wanted.source_id, safe=':')}"
    for option, values in (
        ("source_id", [info.source_id() for info in found]),
        ("host", [info.hostname() for info in found]),
    ):
        if len(set(values)) > 1:
            example = quote(next(filter(None, values)), safe=":")
            return f"choose one, as in lsl:{names[0]}?{option}={example}{given}"
    return "no option of the address tells them apart, so end all but one"


def quoted(text: str) -> str:
    """Quote for XPath 1.0, which has no escapes.

    >>> print(quoted("it's"))
    "it's"
    """
    mark = '"' if "'" in text else "'"
    if mark in text:
        raise StreamError(f"expected a name without one of the quotes, found {text}.")
    return f"{mark}{text}{mark}"
