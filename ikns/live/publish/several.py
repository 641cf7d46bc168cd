"""Several publishers as one."""

from __future__ import annotations

from collections.abc import Sequence

from ikns.arrays import Array
from ikns.live.control.controller import Decision
from ikns.live.publish.publisher import Publisher


class Publishers:
    """Passes on what a live loop tells to every publisher; none waits for another.

    Parameters
    ----------
    publishers : sequence of Publisher
        Opened, and closed by who opened them.

    Examples
    --------
    >>> Publishers([]).counts
    {'sent': 0, 'dropped': 0, 'fault': ''}
    """

    def __init__(self, publishers: Sequence[Publisher]) -> None:
        self._all = tuple(publishers)

    @property
    def counts(self) -> dict[str, int | str]:
        """What was sent and dropped by all together, and their faults."""
        return {
            "sent": sum(each.sent for each in self._all),
            "dropped": sum(each.dropped for each in self._all),
            "fault": " ".join(each.fault for each in self._all if each.fault),
        }

    def decision(self, received: float, decision: Decision, markers: Array) -> None:
        """Queue the result of a frame."""
        for each in self._all:
            each.decision(received, decision, markers)

    def event(self, at: float, name: str, text: str) -> None:
        """Queue an event."""
        for each in self._all:
            each.event(at, name, text)

    def visit_event(self, name: str, text: str, at: float) -> None:
        """Queue an event of a visit, with its time last."""
        self.event(at, name, text)
