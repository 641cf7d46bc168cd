"""An operator and what it drives, in a closed loop, sample by sample."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.errors import InvalidInput

__all__ = ["Delay", "Driven", "Steering", "Tracked", "track"]

Array = NDArray[np.float64]


class Steering(Protocol):
    """What an operator is: it looks ahead and at the pointer, and moves a limb."""

    @property
    def rate(self) -> float:
        """Samples per second."""
        ...

    @property
    def preview(self) -> float:
        """How far ahead it looks, s."""
        ...

    @property
    def place(self) -> float:
        """Where the limb is at first, 0 to 1."""
        ...

    def step(self, ahead: float, seen: float) -> float:
        """Take what is seen now; give the limb of the next sample."""
        ...


class Driven(Protocol):
    """What an operator drives: where the limb is in, the control signal out."""

    def step(self, limb: float) -> float:
        """Take the limb of the next sample, 0 to 1; give the c seen then."""
        ...


class Delay:
    """A device that shows the limb as it is, some time later: a stick, simulated.

    Parameters
    ----------
    seconds : float
        Rounded to whole samples.
    rate : float
        Samples per second.
    """

    def __init__(self, seconds: float, *, rate: float) -> None:
        if not 0 <= seconds < math.inf:
            raise InvalidInput(f"expected a delay of at least 0 s, found {seconds:g}.")
        self._later = round(seconds * rate)
        self._past: deque[float] = deque(maxlen=self._later + 1)

    def step(self, limb: float) -> float:
        """Return the limb of some samples ago; before, where it was at first."""
        self._past.append(limb)
        return self._past[0]


class Tracked(NamedTuple):
    """What came of it; simulated.

    Parameters
    ----------
    time : (T,) array
        s.
    target, limb, c : (T,) array
        0 to 1; c as seen, not cut off.
    """

    time: Array
    target: Array
    limb: Array
    c: Array


def track(
    operator: Steering,
    target: Callable[[ArrayLike], Array],
    driven: Driven,
    *,
    start: float,
    end: float,
) -> Tracked:
    """Let an operator follow a curve with something, by what it sees.

    Parameters
    ----------
    operator : Operator or Copyist
        Fresh; it sets the rate.
    target : callable
        Curve of 0 to 1 at times (s); it is looked at ahead of time.
    driven : Driven
        A :class:`Delay`, or an :class:`ikns.simulation.operator.ArmLoop` for the whole
        chain of body, cameras and map.
    start, end : float
        s.

    Returns
    -------
    Tracked
    """
    n = round((end - start) * operator.rate) + 1
    if n < 2:
        raise InvalidInput(
            f"expected an end after the start, found {start:g} to {end:g}."
        )
    time = start + np.arange(n) / operator.rate
    ahead = target(time + operator.preview)
    limb, c = np.empty(n), np.empty(n)
    limb[0] = operator.place
    c[0] = driven.step(limb[0])
    for k in range(1, n):
        limb[k] = operator.step(float(ahead[k - 1]), float(c[k - 1]))
        c[k] = driven.step(limb[k])
    return Tracked(time, target(time), limb, c)
