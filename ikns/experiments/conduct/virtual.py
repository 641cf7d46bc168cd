"""The virtual operator of a visit: typical, practised, and with a gamepad."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ikns.experiments.conduct.inputs import VirtualInput
from ikns.experiments.tracking.profiles import Profile
from ikns.simulation.operator import Delay, Operator, typical

#: Delay between stick and pointer, s.
_DEVICE_DELAY = 0.05
#: Trials that the operator has done before.
_TRIALS_BEFORE = 9


def virtual_input(
    trial: Callable[[], tuple[Profile, float] | None],
    *,
    rate: float,
    seed: int | Sequence[int],
) -> VirtualInput:
    """Return a simulated operator that plays a visit's trials in real time.

    Parameters
    ----------
    trial : callable
        As :class:`ikns.experiments.conduct.VirtualInput` takes it.
    rate : float
        Samples per second, Hz.
    seed : int or sequence of int
        Of the operator's noise.

    Examples
    --------
    >>> resting = virtual_input(lambda: None, rate=100.0, seed=0)
    >>> len(resting.take(10.0)), len(resting.take(10.105))
    (1, 10)
    """
    ability = typical("gamepad").practised(_TRIALS_BEFORE)
    operator = Operator(ability, rate=rate, seed=np.random.default_rng(seed))
    return VirtualInput(operator, Delay(_DEVICE_DELAY, rate=rate), trial)
