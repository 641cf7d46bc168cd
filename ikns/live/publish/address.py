"""Open a publisher by its address."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple
from urllib.parse import parse_qsl

from ikns.errors import InvalidInput, naming
from ikns.finger.ros2.address import OPTIONS, RosAddress, ros_address
from ikns.live.publish.lsl import LslSink
from ikns.live.publish.publisher import Publisher
from ikns.live.publish.ros import RosSink

_KNOWN = "lsl:NAME or ros2:NAMESPACE"
_OPTIONS = {"lsl": ("scope",), "ros2": OPTIONS}


class PublishAddress(NamedTuple):
    """What an address of LSL streams says.

    Parameters
    ----------
    name : str
        Of the LSL streams.
    everywhere : bool
        Whether other machines can read them.
    """

    name: str
    everywhere: bool


def check_publish(address: str) -> PublishAddress | RosAddress:
    """Check an address; nothing is opened.

    Raises
    ------
    InvalidInput
        When it is wrong.

    Examples
    --------
    >>> check_publish("lsl:c?scope=network")
    PublishAddress(name='c', everywhere=True)
    >>> check_publish("ros2:/arm?domain=0")
    RosAddress(name='/arm', host='127.0.0.1', port=7447, domain=0)
    """
    scheme, colon, rest = address.partition(":")
    name, _, query = rest.partition("?")
    if scheme not in _OPTIONS or not (colon and name.strip() and name.isprintable()):
        raise InvalidInput(f"unknown publishing target {address!r}, expected {_KNOWN}.")
    options = dict(parse_qsl(query, keep_blank_values=True))
    for option in options:
        if option not in _OPTIONS[scheme]:
            raise InvalidInput(
                f"{address}: unknown option '{option}', expected "
                f"{' or '.join(_OPTIONS[scheme])}."
            )
    if scheme == "ros2":
        with naming(address):
            return ros_address(name, options)
    scope = options.get("scope", "machine")
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
    joints: Mapping[str, int] | None = None,
    simulated: bool = False,
    on_fault: Callable[[str], None] | None = None,
) -> Publisher:
    """Open a publisher of what the live loop decides.

    Parameters
    ----------
    address : str
        ``lsl:NAME``: two LSL streams, NAME with c, flexion, state and residual of each
        frame, and NAME-events with events of safety and trials. They are for this
        machine only without ``?scope=network``. ``ros2:NAMESPACE``: ROS 2 topics, see
        :class:`ikns.live.publish.ros.RosSink`, by way of a router on this machine or at
        ``?router=HOST:PORT``.
    rate : float
        Frames per second, for the description; 0 where it is not known.
    n_dof : int
        Number of control signals; 0: no frames will come, so there is no first stream.
    joints : mapping, optional
        Joints to publish, with their places in q; for ROS 2.
    simulated : bool
        Whether the person is.
    on_fault : callable, optional
        Called from another thread with a sentence when nothing is published any more.

    Raises
    ------
    InvalidInput
        When the address is wrong.
    StreamError
        When there is a stream of that name already, no router answers, or the library
        is not installed.
    """
    place = check_publish(address)
    if isinstance(place, RosAddress):
        ros = RosSink(place, n_dof=n_dof, joints=joints or {}, simulated=simulated)
        return Publisher(address, ros, on_fault=on_fault)
    sink = LslSink(
        place.name,
        rate=rate,
        n_dof=n_dof,
        everywhere=place.everywhere,
        simulated=simulated,
    )
    return Publisher(address, sink, on_fault=on_fault)
