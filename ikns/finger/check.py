"""Conformance test for any implementation of a finger."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from ikns.finger.errors import FingerError
from ikns.finger.laws import LAWS, Bench, LawBroken
from ikns.finger.state import Finger


@dataclass(frozen=True)
class FingerReport:
    """Which laws a finger keeps and which it breaks.

    Parameters
    ----------
    kept : tuple of str
    broken : dict of str
        What happened instead, by law.
    """

    kept: tuple[str, ...]
    broken: dict[str, str]


def check_finger(
    make_finger: Callable[[], Finger],
    *,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    strict: bool = True,
) -> FingerReport:
    """Test that a finger does what :class:`Finger` promises.

    The finger moves: keep its path clear, and do not wear it.

    Parameters
    ----------
    make_finger : callable
        Returns a new finger, not connected; called for every law.
    clock, sleep : callable
        The finger's time, where it is simulated.
    strict : bool
        Whether to raise an error at the end when a law is violated.

    Returns
    -------
    FingerReport

    Raises
    ------
    FingerError
        When laws are violated; the message names all of them.

    Examples
    --------
    >>> from ikns.finger import SimulatedFinger
    >>> now = 0.0
    >>> def sleep(duration):
    ...     global now
    ...     now += duration
    >>> def make():
    ...     return SimulatedFinger(clock=lambda: now)
    >>> len(check_finger(make, clock=lambda: now, sleep=sleep).kept)
    13
    """
    bench = Bench(make_finger, clock, sleep)
    kept: list[str] = []
    broken: dict[str, str] = {}
    for law, test in LAWS.items():
        try:
            test(bench)
        except Exception as error:
            what = str(error).rstrip(".") or repr(error)
            broken[law] = what if isinstance(error, LawBroken) else f"raised {what}"
        else:
            kept.append(law)
    if strict and broken:
        raise FingerError(
            "the finger violates a law: "
            + "; ".join(f"{law} ({what})" for law, what in broken.items())
            + "."
        )
    return FingerReport(tuple(kept), broken)
