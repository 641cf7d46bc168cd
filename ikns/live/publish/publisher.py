"""A bounded queue and a thread between the live loop and whatever publishes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import NamedTuple, Protocol

from ikns.arrays import Array
from ikns.live.control.controller import Decision
from ikns.live.session.channels import STATES

#: Samples that may wait: ten seconds at 100 Hz.
_SAMPLES = 1000
#: Items from which on events are dropped too; they are rare and matter more.
_ITEMS = 2000
#: What is still queued at the end has so long to be published, s.
_LAST = 2.0


class PublishedFrame(NamedTuple):
    """What is published of a frame.

    Parameters
    ----------
    markers : (M, 3) array
        As used, m in the world, in the order of the marker set; NaN = not seen.
    decision : Decision
    """

    markers: Array
    decision: Decision

    @property
    def numbers(self) -> tuple[float, ...]:
        """Every c, every flexion, the index of the state, and the residual in m."""
        solved = self.decision.solved
        state = float(STATES.index(self.decision.state))
        return (
            *solved.c.tolist(),
            *self.decision.flexions,
            state,
            solved.residual,
        )


Item = tuple[float, PublishedFrame | str]


class Sink(Protocol):
    """Where samples and events go; only the publisher's thread calls it."""

    def sample(self, at: float, sample: PublishedFrame) -> None:
        """Publish a frame, received at a time of `time.monotonic`."""

    def event(self, at: float, words: str) -> None:
        """Publish an event."""

    def close(self) -> None:
        """Close what was opened."""


class Publisher:
    """Hears of a live loop (a ``LoopListener``) and publishes it from a thread.

    What does not fit into the queue is dropped and counted. A sink that raises an error
    is not used again; one that blocks for ever costs the loop nothing.

    Parameters
    ----------
    name : str
        Address, for messages.
    sink : Sink
    on_fault : callable, optional
        Called from the thread with a sentence when the sink fails.

    Attributes
    ----------
    sent, dropped : int
        Samples and events that were published, and those that were not.
    fault : str
        Why the sink is not used any more; empty while it is.

    Examples
    --------
    >>> class Printing:
    ...     def sample(self, at, sample):
    ...         print(at, sample.numbers)
    ...     def event(self, at, words):
    ...         print(at, words)
    ...     def close(self):
    ...         print("closed")
    >>> with Publisher("print:", Printing()) as publisher:
    ...     publisher.event(0.5, "trial begins", "T1")
    0.5 trial begins: T1
    closed
    >>> publisher.sent, publisher.dropped
    (1, 0)
    """

    def __init__(
        self,
        name: str,
        sink: Sink,
        *,
        on_fault: Callable[[str], None] | None = None,
    ) -> None:
        self.name = name
        self.sent = self.dropped = 0
        self.fault = ""
        self._sink, self._on_fault = sink, on_fault
        # Its put() takes no lock that the thread could hold.
        self._queue: SimpleQueue[Item | None] = SimpleQueue()
        self._closed = self._in_hand = False
        self._thread = threading.Thread(target=self._run, name="publish", daemon=True)
        self._thread.start()

    @property
    def counts(self) -> dict[str, int | str]:
        """What was sent and dropped so far, and the fault."""
        return {"sent": self.sent, "dropped": self.dropped, "fault": self.fault}

    def decision(self, received: float, decision: Decision, markers: Array) -> None:
        """Queue the result of a frame."""
        self._put((received, PublishedFrame(markers, decision)), _SAMPLES)

    def event(self, at: float, name: str, text: str) -> None:
        """Queue an event."""
        self._put((at, " ".join(f"{name}: {text}".split())), _ITEMS)

    def visit_event(self, name: str, text: str, at: float) -> None:
        """Queue an event of a visit, with its time last."""
        self.event(at, name, text)

    def close(self) -> None:
        """Publish what is queued, within two seconds, and close the sink."""
        if self._closed:
            return
        self._closed = True
        self._queue.put(None)
        self._thread.join(_LAST)
        if self._thread.is_alive():
            self._fail("it blocks")
        self.dropped += self._waiting()

    def __enter__(self) -> Publisher:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def _put(self, item: Item, most: int) -> None:
        if self.fault or self._closed or self._queue.qsize() >= most:
            self.dropped += 1
        else:
            self._queue.put(item)

    def _waiting(self) -> int:
        """Count what was queued and not published, the item in hand included."""
        left = int(self._in_hand)
        while not self._queue.empty():
            left += self._queue.get() is not None
        return left

    def _run(self) -> None:
        try:
            while (item := self._queue.get()) is not None:
                self._in_hand = True
                at, what = item
                if isinstance(what, str):
                    self._sink.event(at, what)
                else:
                    self._sink.sample(at, what)
                self.sent += 1
                self._in_hand = False
            self._sink.close()
        except Exception as error:  # whatever it is, the loop goes on
            self._fail(str(error).rstrip(".") or type(error).__name__)

    def _fail(self, why: str) -> None:
        if not self.fault:
            self.fault = f"{self.name}: no longer published ({why})."
            if self._on_fault:
                self._on_fault(self.fault)
