"""What a judge finds in a recording: a fault, where it is, and what would be right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from ikns.arrays import Mask

#: From what must not be used, over what spoils a part, to what is good to know.
Severity = Literal["refuse", "warn", "note"]
_ORDER: tuple[Severity, ...] = ("refuse", "warn", "note")


@dataclass(frozen=True)
class Finding:
    """One fault of a recording.

    Parameters
    ----------
    kind : str
        One word for a machine, such as "exchanged".
    severity : {"refuse", "warn", "note"}
        Whether the recording must not be used, can be used with care, or is as it
        should be.
    where : str
        The recording.
    found, right : str
        Parts of a sentence, as in "expected RIGHT, found FOUND".
    markers : tuple of str
        Markers to look at, the worst first.
    frames : str
        Which frames, counted from 1; empty for all.
    """

    kind: str
    severity: Severity
    where: str
    found: str
    right: str
    markers: tuple[str, ...] = ()
    frames: str = ""

    @property
    def sentence(self) -> str:
        """All of it, for an error or a warning."""
        return f"{self.where}: {self.reason}"

    @property
    def reason(self) -> str:
        """The same where it is clear which recording is meant."""
        when = f" in frames {self.frames}" if self.frames else ""
        return f"{self.found}{when}; {self.right}."

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return asdict(self)


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """Sort by severity; equal ones stay in order."""
    return sorted(findings, key=lambda finding: _ORDER.index(finding.severity))


def refused(findings: Iterable[Finding]) -> list[Finding]:
    """Return those that forbid the use of a recording."""
    return [finding for finding in findings if finding.severity == "refuse"]


def refusal(faults: Sequence[Finding]) -> str:
    """Say the first of what forbids the use of recordings, and how much there is.

    >>> short = Finding("short", "refuse", "a.c3d", "it lasts 1 s", "record 3 s")
    >>> refusal([short])
    'a.c3d: it lasts 1 s; record 3 s.'
    >>> refusal([short, short])
    '2 problems; first: a.c3d: it lasts 1 s; record 3 s.'
    """
    count = f"{len(faults)} problems; first: " if len(faults) > 1 else ""
    return count + faults[0].sentence


def say_frames(mask: Mask, *, most: int = 3) -> str:
    """Say where a mask (T,) is true, counted from 1.

    >>> say_frames(np.array([0, 1, 1, 1, 0, 1], dtype=bool))
    '2-4, 6'
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    runs = list(zip(edges[::2] + 1, edges[1::2], strict=True))
    words = [f"{a}-{b}" if b > a else f"{a}" for a, b in runs[:most]]
    left = sum(int(b - a + 1) for a, b in runs[most:])
    return ", ".join(words) + (f" and {left} more" if left else "")


def say_markers(labels: Sequence[str], *, most: int = 4) -> str:
    """Name markers, at most so many.

    >>> say_markers(["C7", "T10"]), say_markers("ABCDEF")
    ('C7 and T10', 'A, B, C, D and 2 more')
    """
    if len(labels) > most:
        return f"{', '.join(labels[:most])} and {len(labels) - most} more"
    return " and ".join([*([", ".join(labels[:-1])] if labels[1:] else []), labels[-1]])
