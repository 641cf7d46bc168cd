"""How many frames were rejected, by reason."""

from __future__ import annotations

import re

#: Amounts in the sentences of :mod:`ikns.motion.marker_ik.rejection`.
_AMOUNT = re.compile(r"(\d+) mm")
_PLACE = "# mm"


def kind_of(reason: str) -> str:
    """Return a reason without its amount, so that alike ones are the same.

    >>> kind_of("RFIN is 215 mm from where any posture would put it")
    'RFIN is # mm from where any posture would put it'
    """
    return _AMOUNT.sub(_PLACE, reason)


class RejectionCount:
    """Counts rejected frames by reason, and keeps the largest amount of each.

    Examples
    --------
    >>> count = RejectionCount()
    >>> for reason in ("the right hand is not in sight", *["RFIN is 90 mm away"] * 2):
    ...     count.add(reason)
    >>> count.table()
    {'RFIN is up to 90 mm away': 2, 'the right hand is not in sight': 1}
    """

    def __init__(self) -> None:
        self._frames: dict[str, int] = {}
        self._largest: dict[str, int] = {}

    def add(self, reason: str) -> None:
        """Count a frame that was rejected for a reason."""
        kind = kind_of(reason)
        self._frames[kind] = self._frames.get(kind, 0) + 1
        amount = _AMOUNT.search(reason)
        if amount:
            self._largest[kind] = max(self._largest.get(kind, 0), int(amount[1]))

    def table(self) -> dict[str, int]:
        """Return the number of frames by reason, the most frequent first."""
        ordered = sorted(self._frames, key=lambda kind: -self._frames[kind])
        return {
            kind.replace(_PLACE, f"up to {self._largest.get(kind)} mm"): self._frames[
                kind
            ]
            for kind in ordered
        }
