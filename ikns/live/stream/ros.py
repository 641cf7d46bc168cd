"""A ROS 2 topic of motion capture markers as a live source, over zenoh.

The messages are those of MOCAP4ROS2's drivers. Tried on loopback with a node written
from their definition, not with a driver.
"""

from __future__ import annotations

import math
import threading
import time

import numpy as np

from ikns.errors import StreamError
from ikns.finger.ros2.address import RosAddress
from ikns.finger.ros2.definitions import type_hash
from ikns.finger.ros2.node import RosNode
from ikns.live.stream.client_feed import ClientFeed
from ikns.live.stream.client_thread import ClientThread
from ikns.live.stream.frame import Frame
from ikns.live.stream.ros_markers import MARKERS, MarkersReader, RosMarkers

#: The message has neither a list of names nor a rate; so many frames show them.
_FIRST = 20
#: Without an answer for so long, the router is taken to be gone, s.
_SILENCE = 2.0
#: Frames of another publisher are read once those of the first are missing for so long,
#: s: longer than it takes until a finger is in its safe state.
_GONE = 1.0
_LOOK = 0.1  # time between looks at the router, s


class RosFeed(ClientFeed):
    """Read the named markers of a topic; go on after a break.

    A hidden marker is at zero (as Vicon's driver has it), NaN, or not in the message.

    Parameters
    ----------
    address : RosAddress
        Topic, router and domain.
    timeout : float
        Seconds for the router to answer and for the first frames to come.
    rate : float, optional
        Frames per second; by default that of the first stamps.

    Attributes
    ----------
    device : dict
        ``overruns``: frames lost because they were not read.

    Raises
    ------
    StreamError
        When no router answers, or no one publishes markers on the topic, or none that
        have names, or with stamps that do not advance.
    """

    def __init__(
        self, address: RosAddress, *, timeout: float = 5.0, rate: float | None = None
    ) -> None:
        name = f"ros2:{address.name}"
        self._address, self._rate = address, rate
        super().__init__(ClientThread(name, "the router", address.router, timeout))
        self._reader = MarkersReader()
        self._first: list[RosMarkers] = []
        self._senders: dict[bytes, None] = {}  # of the first frames
        self._sender, self._heard, self._ahead, self._number = b"", -math.inf, 0, 0
        self._enough = threading.Event()
        self._since = 0
        self._columns: dict[tuple[str, ...], np.typing.NDArray[np.int64]] = {}
        self._start(self._serve, timeout=2 * timeout + 10)

    def _serve(self) -> None:
        node = RosNode(self._address, needed_by=self.name)
        try:
            node.subscribe(self._address.name, MARKERS, self._take)
            if not self._enough.wait(self._client.timeout):
                raise self._nothing(node)
            self._begin(node)
            self._client.set_connected()
            self._watch(node)
        finally:
            node.close()

    def _watch(self, node: RosNode) -> None:
        """Tell when the router goes away and when it is back."""
        there = True
        while not self._client.closed:
            time.sleep(_LOOK)
            now = node.silence() < _SILENCE and node.connected
            if there and not now:
                self._client.add_event(f"{self.name}: the router went away.")
            elif now and not there:
                self._client.add_event(f"{self.name}: the router is back.")
            there = now

    def _take(self, data: bytes, received: float, sender: bytes) -> None:
        """Take a message, in zenoh's thread."""
        try:
            found = self._reader.read(data)
        except ValueError as error:
            self._client.add_event(f"{self.name}: a frame is not read: {error}.")
            return
        if self._client.connected:
            if self._is_ours(sender, found.number, received):
                self._client.inbox.put(self._frame(found, received))
        elif len(self._first) < _FIRST:
            self._first.append(found)
            self._senders[sender] = None
            if len(self._first) == _FIRST:
                self._enough.set()

    def _is_ours(self, sender: bytes, number: int, received: float) -> bool:
        """Whether a frame is of the publisher that is read: one, never two at a time.

        One that does not say who it is cannot be told from another.
        """
        if sender != self._sender and sender and self._sender:
            if received - self._heard < _GONE:
                self._client.add_event(
                    f"{self.name}: frames of another publisher also arrive and are "
                    "ignored."
                )
                return False
            self._client.add_event(
                f"{self.name}: another publisher is read, as frames of the first "
                "stopped."
            )
            self._ahead = self._number + 1 - number  # it counts in its own way
        self._sender = sender or self._sender
        self._heard, self._number = received, number + self._ahead
        return True

    def _begin(self, node: RosNode) -> None:
        """Take publisher, names and rate from the first frames."""
        if len(self._senders) > 1:
            topic = node.publishers(self._address.name)
            nodes = sorted(each.node for each in topic if each.type == MARKERS)
            raise StreamError(
                f"{self.name}: expected one publisher on this topic, found frames of "
                f"{len(self._senders)} (nodes {' and '.join(nodes)}); stop all but "
                "one, or give them topics of their own."
            )
        self._sender, self._heard = next(iter(self._senders)), time.monotonic()
        names: dict[str, None] = {}
        for found in self._first:
            named = [name for name in found.names if name]
            twice = sorted({name for name in named if named.count(name) > 1})
            if twice:
                raise StreamError(
                    f"{self.name}: expected a name for each marker, found two markers "
                    f"named {twice[0]}, perhaps of two people; stream one of them."
                )
            names |= dict.fromkeys(named)
        if not names and any(found.names for found in self._first):
            raise StreamError(
                f"{self.name}: expected markers with names, found "
                f"{max(len(found.names) for found in self._first)} that have an index "
                "only; label them in the capture program, and use a driver that "
                "passes names on (for OptiTrack, natnet:HOST reads them)."
            )
        self._since = self._first[0].stamp[0]
        rate = self._rate
        if rate is None:
            steps = np.diff([self._time(found) for found in self._first])
            step = float(np.median(steps))
            if not step > 0:
                raise StreamError(
                    f"{self.name}: expected stamps that advance from frame to frame, "
                    "found equal ones; let the driver fill header.stamp."
                )
            rate = round(1 / step, 3)
        self._client.set_stream(
            tuple(names), rate, if_unlabeled="wait until markers are in sight"
        )

    def _time(self, found: RosMarkers) -> float:
        seconds, rest = found.stamp
        return seconds - self._since + 1e-9 * rest

    def _frame(self, found: RosMarkers, received: float) -> Frame:
        columns = self._columns.get(found.names)
        if columns is None:
            columns = self._columns[found.names] = self._places(found.names)
        markers = np.full((len(self._client.labels), 3), math.nan)
        known = columns >= 0
        markers[columns[known]] = found.markers[known]
        return Frame(self._number, self._time(found), received, markers)

    def _places(self, names: tuple[str, ...]) -> np.typing.NDArray[np.int64]:
        """Return where markers of a message belong among the labels; -1: nowhere."""
        self._columns.clear()  # one or two lists of names, not one for each gap
        labels = self._client.labels
        new = [name for name in names if name and name not in labels]
        if new:
            self._client.add_event(
                f"{self.name}: marker {new[0]} was not among the first frames and is "
                "not read."
            )
        # Which of two markers of one name is meant cannot be known.
        return np.array(
            [
                labels.index(n) if n in labels and names.count(n) == 1 else -1
                for n in names
            ],
            dtype=np.int64,
        )

    def _nothing(self, node: RosNode) -> StreamError:
        """Say why no frames came, by what the graph knows."""
        topic = self._address.name
        wanted = f"{self.name}: expected a publisher of {MARKERS}"
        some = [f"{len(self._first)} frames"] if self._first else []
        there = node.publishers(topic)
        if some or any(each.type == MARKERS for each in there):
            hashes = {each.hash for each in there if each.type == MARKERS}
            if hashes and type_hash(MARKERS) not in hashes and not some:
                return StreamError(
                    f"{wanted} as mocap4r2_msgs defines it, found one with another "
                    "definition; use the released package."
                )
            found = some[0] if some else "none"
            return StreamError(
                f"{self.name}: expected {_FIRST} frames within "
                f"{self._client.timeout:g} s, found {found}; start the capture, and "
                "activate the driver's node."
            )
        if there:
            return StreamError(f"{wanted} on this topic, found one of {there[0].type}.")
        others = {each.topic for each in node.publishers() if each.type == MARKERS}
        return StreamError(
            f"{wanted} on this topic in domain {self._address.domain}, found none"
            + (f" but on {', '.join(sorted(others))}" if others else "")
            + "; start the driver, or name another topic or ?domain=NUMBER."
        )
