"""A node in a ROS 2 graph: a zenoh session as client of one router.

It connects to that router only and listens to no port; nothing is sent by multicast.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

from ikns.errors import StreamError
from ikns.finger.ros2.address import RosAddress
from ikns.finger.ros2.cdr import Message, encode
from ikns.finger.ros2.keys import (
    RosEndpoint,
    endpoint_token,
    endpoints_key,
    node_token,
    read_token,
    topic_key,
)

#: How long a router has to answer while connecting, s.
_CONNECT = 3.0
#: How long the graph has to say who publishes or listens, s.
_ASK = 1.0
#: Time between questions whether the router answers, s, and how long each one waits.
_PROBE, _PROBE_ENDS = 0.05, 5.0

#: How long a message may wait for room in the queue before it is dropped, s. zenoh's
#: own 1 ms drops messages on a machine that is merely busy.
_ROOM = 0.02
_QUEUE = "transport/link/tx/queue/congestion_control"
#: What comes with a message, as in rmw_zenoh: number, time, and the identity of who
#: sends with its length before it.
_ABOUT = "<qqB"
_BEFORE_ID = struct.calcsize(_ABOUT)

#: Called with the bytes of a message, the time of its receipt, s of `time.monotonic`,
#: and what identifies its publisher (empty where it does not say), from a thread of
#: zenoh.
Receiver = Callable[[bytes, float, bytes], None]


class RosNode:
    """A connection to the router of a ROS 2 graph.

    When the router goes away it is connected again as soon as it is back. What is sent
    meanwhile is lost.

    Parameters
    ----------
    address : RosAddress
        Router and domain.
    needed_by : str
        What the connection is for, for messages.

    Attributes
    ----------
    address : RosAddress

    Raises
    ------
    StreamError
        When zenoh is not installed, or no router answers.
    """

    def __init__(self, address: RosAddress, *, needed_by: str) -> None:
        self.address, self._needed_by = address, needed_by
        self._zenoh = _load(needed_by)
        self._check_port()
        try:
            self._session = self._zenoh.open(self._configuration())
        except self._zenoh.ZError:
            raise self._no_router("something that is none") from None
        self._id = str(self._session.info.zid())
        self._name = f"ikns_{os.getpid()}_{self._id[:6]}"
        self._declared: list[Any] = []
        self._numbers = 0
        self._token = node_token(address.domain, self._id, self._name)
        self._keep_token(self._token)
        self._asked = -math.inf
        self._waiting = math.inf  # since the first question that has no answer yet

    @property
    def connected(self) -> bool:
        """Whether there is a connection to the router, as far as is known at once."""
        return bool(self._session.info.routers_zid())

    def silence(self) -> float:
        """Ask the router now and then, and say how long it owes an answer, s.

        Call it often. A program that hangs, or a cable that is out, keeps a connection;
        only an answer says more.
        """
        now = time.monotonic()
        if now - self._asked >= _PROBE:
            self._asked = now
            self._waiting = min(self._waiting, now)
            self._ask_router()
        return max(now - self._waiting, 0.0)

    def publisher(
        self, topic: str, type_name: str, *, wait: bool = False
    ) -> RosPublisher:
        """Return what publishes on a topic.

        With `wait` a message waits for room in zenoh's queue, as long as that takes;
        without, 20 ms at most, and is then dropped unseen.
        """
        key = topic_key(self.address.domain, topic, type_name)
        zenoh, control = self._zenoh, self._zenoh.CongestionControl
        publisher = self._session.declare_publisher(
            key,
            congestion_control=control.BLOCK if wait else control.DROP,
            reliability=zenoh.Reliability.RELIABLE,
            express=True,
        )
        self._declared.append(publisher)
        self._announce("MP", topic, type_name)
        return RosPublisher(publisher, topic, type_name)

    def subscribe(self, topic: str, type_name: str, receive: Receiver) -> None:
        """Hear of every message of a topic."""

        def take(sample: Any) -> None:
            received, about = time.monotonic(), sample.attachment
            told = b"" if about is None else about.to_bytes()[_BEFORE_ID:]
            receive(sample.payload.to_bytes(), received, told)

        key = topic_key(self.address.domain, topic, type_name)
        # In zenoh's own thread: another one would keep a program from ending.
        handler = self._zenoh.handlers.Callback(take, indirect=False)
        self._declared.append(self._session.declare_subscriber(key, handler))
        self._announce("MS", topic, type_name)

    def publishers(self, topic: str = "") -> list[RosEndpoint]:
        """Return who publishes on a topic, of whatever type, as the graph says."""
        return self._endpoints("MP", topic)

    def subscribers(self, topic: str = "") -> list[RosEndpoint]:
        """Return who listens to a topic."""
        return self._endpoints("MS", topic)

    def close(self) -> None:
        """Leave the graph; harmless when repeated."""
        for each in reversed(self._declared):
            each.undeclare()
        self._declared = []
        self._session.close()

    def _announce(self, kind: str, topic: str, type_name: str) -> None:
        self._numbers += 1
        domain, own = self.address.domain, self._name
        self._keep_token(
            endpoint_token(domain, self._id, self._numbers, kind, own, topic, type_name)
        )

    def _keep_token(self, key: str) -> None:
        self._declared.append(self._session.liveliness().declare_token(key))

    def _endpoints(self, kind: str, topic: str) -> list[RosEndpoint]:
        key = endpoints_key(self.address.domain, kind, topic)
        found = []
        for reply in self._session.liveliness().get(key, timeout=_ASK):
            if reply.ok is not None:
                found.append(read_token(str(reply.ok.key_expr)))
        return [each for each in found if each and each.node != self._name]

    def _ask_router(self) -> None:
        """Ask it for a token that no one has: only it can say that there is none."""
        asked = time.monotonic()
        failed: list[Any] = []

        def end() -> None:
            if not failed and asked >= self._waiting:
                self._waiting = math.inf

        handler = self._zenoh.handlers.Callback(failed.append, end, indirect=False)
        where = f"{self._token}/none"
        self._session.liveliness().get(where, handler, timeout=_PROBE_ENDS)

    def _configuration(self) -> Any:
        host = self.address.host
        host = f"[{host}]" if ":" in host else host
        configuration = self._zenoh.Config()
        for path, value in {
            "mode": "client",
            "connect/endpoints": [f"tcp/{host}:{self.address.port}"],
            "connect/timeout_ms": 0,  # once; it connects again all the same later
            "listen/endpoints": [],
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            "transport/unicast/open_timeout": round(1000 * _CONNECT),
            f"{_QUEUE}/drop/wait_before_drop": round(1e6 * _ROOM),
        }.items():
            configuration.insert_json5(path, json.dumps(value))
        return configuration

    def _check_port(self) -> None:
        """See that something listens; zenoh itself would not say what is wrong."""
        host, port = self.address.host, self.address.port
        try:
            socket.create_connection((host, port), _CONNECT).close()
        except (OSError, UnicodeError):
            raise self._no_router("no answer") from None

    def _no_router(self, found: str) -> StreamError:
        return StreamError(
            f"{self._needed_by}: expected a zenoh router at {self.address.router}, "
            f"found {found}; start one with 'ros2 run rmw_zenoh_cpp rmw_zenohd' or "
            "'python -m ikns.finger.ros2.router', or name another with "
            "?router=HOST:PORT."
        )


class RosPublisher:
    """Sends messages of one topic; made by :meth:`RosNode.publisher`.

    Parameters
    ----------
    publisher : zenoh.Publisher
    topic, type_name : str

    Attributes
    ----------
    topic : str
    """

    def __init__(self, publisher: Any, topic: str, type_name: str) -> None:
        self.topic = topic
        self._publisher, self._type = publisher, type_name
        self._id = os.urandom(16)
        self._count = 0
        self._lock = threading.Lock()

    @property
    def heard(self) -> bool:
        """Whether somebody listens to this topic and type."""
        return bool(self._publisher.matching_status.matching)

    def put(self, message: Message, *, at: int) -> None:
        """Send a message.

        Parameters
        ----------
        message : mapping
        at : int
            Source time that ROS shows with it, ns since 1970.
        """
        data = encode(self._type, message)
        with self._lock:
            self._count += 1
            about = struct.pack(_ABOUT, self._count, at, len(self._id)) + self._id
            self._publisher.put(data, attachment=about)


def stamp(ns: int) -> dict[str, int]:
    """Return a ``builtin_interfaces/msg/Time`` or ``Duration``.

    Examples
    --------
    >>> stamp(1_500_000_000)
    {'sec': 1, 'nanosec': 500000000}
    """
    seconds, rest = divmod(ns, 1_000_000_000)
    return {"sec": seconds, "nanosec": rest}


def _load(needed_by: str) -> Any:
    try:
        return importlib.import_module("zenoh")
    except (ImportError, OSError) as error:
        why = "" if isinstance(error, ModuleNotFoundError) else f" ({error})"
        raise StreamError(
            f"{needed_by} needs zenoh{why}; pip install 'ikns[ros2]'."
        ) from None
