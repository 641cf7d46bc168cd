"""Open a publisher by its address."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple
from urllib.parse import parse_qsl

from ikns.errors import InvalidInput
from ikns.live.publish.lsl import LslSink
from ikns.live.publish.publisher import Publisher

_KNOWN = "lsl:NAME"


class PublishAddress(NamedTuple):
    """What an address says.

    Parameters
    ----------
    name : str
        Of the LSL streams.
    everywhere : bool
        Whether other machines can read them.
    """

    name: str
    everywhere: bool


def check_publish(address: str) -> PublishAddress:
    """Check an address; nothing is opened.

    Raises
    ------
    InvalidInput
        When it is wrong.

    Examples
    --------
    >>> check_publish("lsl:c?scope=network")
    PublishAddress(name='c', everywhere=True)
    """
    scheme, colon, rest = address.partition(":")
    name, _, query = rest.partition("?")
    if scheme != "lsl" or not (colon and name.strip() and name.isprintable()):
        raise InvalidInput(f"unknown publishing target {address!r}, expected {_KNOWN}.")
    options = dict(parse_qsl(query, keep_blank_values=True))
    scope = options.pop("scope", "machine")
    if options:
        raise InvalidInput(
            f"{address}: unknown option '{next(iter(options))}', expected scope."
        )
    if scope not in ("machine", "network"):
        raise InvalidInput(
            f"{address}: expected scope=machine or network, found scope={scope}."
        )
    return PublishAddress(name, scope == "network")


def open_publisher(
    address: str,
    *,
    rate: float,
    n_dof: int = 1,
    simulated: bool = False,
    on_fault: Callable[[str], None] | None = None,
) -> Publisher:
    """Open a publisher of what the live loop decides.

    Parameters
    ----------
    address : str
        ``lsl:NAME``: two LSL streams, NAME with c, flexion, state and residual of each
        frame, and NAME-events with events of safety and trials. They are for this
        machine only without ``?scope=network``.
    rate : float
        Frames per second, for the description; 0 where it is not known.
    n_dof : int
        Number of control signals; 0: no frames will come, so there is no first stream.
    simulated : bool
        Whether the person is.
    on_fault : callable, optional
        Called from another thread with a sentence when nothing is published any more.

    Raises
    ------
    InvalidInput
        When the address is wrong.
    StreamError
        When there is a stream of that name already, or pylsl is not installed.
    """
    name, everywhere = check_publish(address)
    sink = LslSink(
        name, rate=rate, n_dof=n_dof, everywhere=everywhere, simulated=simulated
    )
    return Publisher(address, sink, on_fault=on_fault)
