"""Faults to inject into a stream: counted, and reproducible with a seed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import chain, pairwise

import numpy as np

from ikns.errors import InvalidInput


@dataclass(frozen=True)
class Faults:
    """Probability of each fault per frame; a frame gets one fault at most.

    Parameters
    ----------
    drop : float
        The frame is not sent.
    late : float
        The frame and all after it are delayed by `late_seconds`.
    repeat : float
        The frame is sent twice.
    swap : float
        The frame is sent after its successor.
    freeze : float
        The frame and those within `freeze_seconds` repeat the markers before them.
    late_seconds, freeze_seconds : float
    """

    drop: float = 0.0
    late: float = 0.0
    repeat: float = 0.0
    swap: float = 0.0
    freeze: float = 0.0
    late_seconds: float = 0.2
    freeze_seconds: float = 0.5

    KINDS = ("drop", "late", "repeat", "swap", "freeze")

    def __post_init__(self) -> None:
        """Check that these are probabilities and times."""
        chances = {kind: getattr(self, kind) for kind in self.KINDS}
        for kind, p in chances.items():
            if not 0 <= p <= 1:
                raise InvalidInput(
                    f"{kind}={p:g}: a probability must be between 0 and 1."
                )
        if sum(chances.values()) > 1:
            given = ", ".join(f"{kind}={p:g}" for kind, p in chances.items() if p)
            raise InvalidInput(
                f"{given}: probabilities must not add up to more than 1."
            )
        for seconds in (self.late_seconds, self.freeze_seconds):
            if not 0 <= seconds < np.inf:
                raise InvalidInput(f"expected seconds of 0 or more, found {seconds:g}.")

    @classmethod
    def parse(cls, text: str) -> Faults:
        """Read faults from text, as on the command line.

        >>> Faults.parse("drop=0.01,late=0.002:0.3")
        Faults(drop=0.01, late=0.002, repeat=0.0, swap=0.0, freeze=0.0, \
late_seconds=0.3, freeze_seconds=0.5)
        """
        known = {field.name for field in fields(cls)}
        faults: dict[str, float] = {}
        for part in filter(None, text.split(",")):
            kind, _, value = part.strip().partition("=")
            chance, _, seconds = value.partition(":")
            if kind not in cls.KINDS or (seconds and f"{kind}_seconds" not in known):
                raise InvalidInput(
                    f"unknown fault '{part}', expected {', '.join(cls.KINDS)} with a "
                    "probability, late and freeze also with seconds, such as "
                    "drop=0.01,late=0.002:0.3."
                )
            try:
                faults[kind] = float(chance)
                if seconds:
                    faults[f"{kind}_seconds"] = float(seconds)
            except ValueError:
                raise InvalidInput(
                    f"expected a number in fault '{part}', such as {kind}=0.01."
                ) from None
        return replace(cls(), **faults)

    def draw(self, rng: np.random.Generator) -> str | None:
        """Draw the fault of a frame; None for none."""
        left = rng.random()
        for kind in self.KINDS:
            left -= getattr(self, kind)
            if left < 0:
                return kind
        return None


@dataclass(frozen=True, slots=True)
class Sent:
    """One frame to send.

    Parameters
    ----------
    frame : int
        Index of the frame that gives number and time.
    content : int
        Index of the frame that gives the markers.
    hold : float
        Delay after it is due, s.
    """

    frame: int
    content: int
    hold: float = 0.0


def inject(
    frames: Iterable[int],
    faults: Faults,
    rate: float,
    rng: np.random.Generator,
    tally: Counter[str],
) -> Iterator[Sent]:
    """Inject faults into a stream of frames.

    The first and the last frame get none, because at the ends a receiver cannot
    distinguish a dropped frame from one that never existed.

    Parameters
    ----------
    frames : iterable of int
        Frame numbers, ascending by one.
    faults : Faults
    rate : float
        Frames per second.
    rng : numpy.random.Generator
    tally : Counter
        Frames affected so far, by kind; pairs for ``swap``. Updated here.

    Yields
    ------
    Sent
        In the order of sending.
    """
    content = -1
    frozen = 0
    skip = False
    for k, following in pairwise(chain(frames, [None])):
        assert k is not None
        if skip:  # sent already, before its predecessor
            skip = False
            continue
        spared = content < 0 or following is None
        kind = None if spared or frozen else faults.draw(rng)
        if kind == "freeze":
            frozen = max(1, round(faults.freeze_seconds * rate))
        if frozen and not spared:
            frozen -= 1
            tally["freeze"] += 1
            yield Sent(k, content)
            continue
        if kind is not None:
            tally[kind] += 1
        if kind == "drop":
            continue
        if kind == "swap":
            assert following is not None
            yield Sent(following, following)
            skip = True
        yield Sent(k, k, faults.late_seconds if kind == "late" else 0.0)
        if kind == "repeat":
            yield Sent(k, k)
        content = k
