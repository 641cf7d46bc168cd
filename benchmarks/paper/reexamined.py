"""The paper's own figures, examined again from nothing but what it prints.

No raw data are published, so this derives what the printed numbers imply together,
within their rounding. Everything is computed from `printed.PAPER`.
"""

from __future__ import annotations

from paper.finding import Finding
from paper.picking import examine_participants, examine_picking
from paper.tracking import examine_tracking

__all__ = ["Finding", "paper_reexamined"]


def paper_reexamined() -> tuple[Finding, ...]:
    """All findings, tracking first.

    Examples
    --------
    >>> findings = paper_reexamined()
    >>> findings[0].verdict
    'contradicts itself'
    """
    return (*examine_tracking(), *examine_participants(), *examine_picking())
