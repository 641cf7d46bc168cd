"""What one injected fault led to, and many of them in a row of a table."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from statistics import median

__all__ = ["LONGEST_STALL", "Outcome", "Summary", "summarize"]


@dataclass(frozen=True)
class Outcome:
    """One injection.

    Parameters
    ----------
    fault : str
    expected, ended : str
        State that the loop should end in, and did.
    seconds : dict of str to float
        Reaction times by what was waited for.
    promised : dict of str to float
        What they must not exceed.
    violated : int
        Commands beyond a limit.
    session : str
        What is wrong with the session; empty if nothing.
    remarks : tuple of str
        Whatever else is not as it should be.
    held : bool
        Whether the finger held on the way.
    stall : float
        How much longer than it should the machine once kept the loop from running, s.
    """

    fault: str
    expected: str
    ended: str
    seconds: dict[str, float]
    promised: dict[str, float]
    violated: int
    session: str
    remarks: tuple[str, ...] = ()
    held: bool = False
    stall: float = 0.0


#: Longer stalls of the machine are faults of their own, and spoil the timing of others.
LONGEST_STALL = 0.03


@dataclass
class Summary:
    """All injections of a fault.

    States and times are of the `timed` ones, in which the machine let the loop run;
    limits and sessions are of all.
    """

    fault: str
    expected: str
    injected: int
    timed: int
    as_expected: int
    held: int
    #: (median, longest, promised), s, by what was waited for.
    seconds: dict[str, tuple[float, float, float]]
    #: How often that was longer than promised.
    overran: dict[str, int]
    violated: int
    sessions: int
    remarks: dict[str, int] = field(default_factory=dict)


def summarize(outcomes: list[Outcome]) -> list[Summary]:
    """One summary a fault, in the order of their first outcome."""
    by: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        by.setdefault(outcome.fault, []).append(outcome)
    found = []
    for fault, everyone in by.items():
        group = [one for one in everyone if one.stall <= LONGEST_STALL]
        names = dict.fromkeys(name for one in group for name in one.promised)
        seconds, overran = {}, {}
        for name in names:
            took = [one.seconds.get(name, float("inf")) for one in group]
            promised = max(one.promised.get(name, 0.0) for one in group)
            seconds[name] = (median(took), max(took), promised)
            overran[name] = sum(
                one.seconds.get(name, float("inf")) > one.promised.get(name, 0.0)
                for one in group
            )
        remarks = Counter(text for one in group for text in one.remarks)
        remarks.update(one.session for one in everyone if one.session)
        found.append(
            Summary(
                fault,
                everyone[0].expected,
                len(everyone),
                len(group),
                sum(one.ended == one.expected for one in group),
                sum(one.held for one in group),
                seconds,
                overran,
                sum(one.violated for one in everyone),
                sum(not one.session for one in everyone),
                dict(remarks),
            )
        )
    return found
