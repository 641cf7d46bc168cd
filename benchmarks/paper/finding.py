"""One claim of the paper, examined again."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["Finding"]


@dataclass(frozen=True)
class Finding:
    """One claim of the paper and what its printed numbers say about it.

    Parameters
    ----------
    claim : str
        As printed, in our words.
    implies : str
        What the printed numbers imply.
    verdict : str
        ``agrees``, ``contradicts itself``, ``takes for granted``, ``not shown``, or
        ``incomplete``.
    values : dict
        The computed numbers by name.
    """

    claim: str
    implies: str
    verdict: str
    values: dict[str, float] = field(repr=False)

    def sentence(self) -> str:
        """Return the result as a sentence."""
        return f"{self.claim}: {self.verdict}, for {self.implies}."
