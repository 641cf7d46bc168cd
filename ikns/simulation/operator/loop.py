"""Operator and controlled element in a closed loop, sample by sample."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.simulation.operator.model import Operator


class ControlledElement(Protocol):
    """What an operator controls: position of the limb in, control signal out."""

    def step(self, limb: float) -> float:
        """Take the limb's next position, 0 to 1; return the c that is seen then."""
        ...


class Delay:
    """A device that returns the limb's position after a delay: a simulated stick."""

    def __init__(self, seconds: float, *, rate: float) -> None:
        if not 0 <= seconds < math.inf:
            raise InvalidInput(f"expected a delay of at least 0 s, found {seconds:g}.")
        self._past: deque[float] = deque(maxlen=round(seconds * rate) + 1)

    def step(self, limb: float) -> float:
        """Return the position one delay ago; at first, the first one."""
        self._past.append(limb)
        return self._past[0]


class TrackingTrace(NamedTuple):
    """Signals of simulated tracking (T,): s, and 0 to 1; c as seen, not clipped."""

    time: Array
    target: Array
    limb: Array
    c: Array


def track(
    operator: Operator,
    target: Callable[[ArrayLike], Array],
    element: ControlledElement,
    *,
    start: float,
    end: float,
) -> TrackingTrace:
    """Simulate an operator that follows a curve in a closed loop.

    The new operator sets the rate. `target` is a curve of 0 to 1 as a function of times
    (s), also ahead of the current time; `element` a :class:`Delay`, or an
    :class:`ikns.simulation.operator.ArmLoop` for the whole chain of body, cameras and
    map.
    """
    n = round((end - start) * operator.rate) + 1
    if n < 2:
        raise InvalidInput(
            f"expected an end after the start, found {start:g} to {end:g}."
        )
    time = start + np.arange(n) / operator.rate
    ahead = target(time + operator.preview).tolist()
    limb = [operator.limb]
    c = [element.step(limb[0])]
    for k in range(1, n):
        limb.append(operator.step(ahead[k - 1], c[-1]))
        c.append(element.step(limb[-1]))
    return TrackingTrace(time, target(time), np.array(limb), np.array(c))
