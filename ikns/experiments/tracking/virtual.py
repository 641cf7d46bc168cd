"""Simulated tracking trials: virtual operators in the same trials as people."""

from __future__ import annotations

from typing import Any

import numpy as np

from ikns.errors import InvalidInput
from ikns.experiments.tracking.profiles import Profile
from ikns.experiments.tracking.schedule import TrackingStep
from ikns.experiments.tracking.trial import ALIGN, TrackingRecord, TrackingTrial
from ikns.simulation.operator import CONDITIONS, Delay, Operator, Participant, track
from ikns.simulation.operator.loop import ControlledElement


def virtual_trial(
    operator: Operator,
    element: ControlledElement,
    profile: Profile,
    *,
    align: float = ALIGN,
) -> TrackingRecord:
    """Simulate one trial.

    Parameters
    ----------
    operator : Operator
        New; it sets the rate.
    element : ControlledElement
        What the operator controls, new as well.
    profile : Profile
    align : float
        Time before the profile begins, s.

    Examples
    --------
    >>> from ikns.experiments.tracking import draw_profile, measure
    >>> from ikns.simulation.operator import typical
    >>> operator = Operator(typical().practised(9), rate=100, seed=0)
    >>> profile = draw_profile("T2", seed=0)
    >>> record = virtual_trial(operator, Delay(0.05, rate=100), profile)
    >>> 2 < measure(record).rmse < 8
    True
    """
    done = track(
        operator,
        lambda time: profile.at(time) / 100,
        element,
        start=-align,
        end=profile.seconds,
    )
    trial = TrackingTrial(profile, align=align)
    trial.start(float(done.time[0]))
    trial.add_samples(done.time.tolist(), done.c.tolist())
    return trial.record


def virtual_step(
    participant: Participant,
    step: TrackingStep,
    profile: Profile,
    *,
    practised: int,
    direct: bool = False,
    rate: float = 100.0,
    latency: float = 0.05,
    align: float = ALIGN,
    **arm_loop: Any,
) -> TrackingRecord:
    """Simulate one step of a schedule, training or trial.

    With the elbow ("ikns") the signal passes through the whole chain of body, cameras
    and map; with a stick ("gamepad") it is direct. The record depends on participant,
    step and settings alone, not on what was simulated before.

    Parameters
    ----------
    participant : Participant
    step : TrackingStep
    profile : Profile
        Of the step.
    practised : int
        Earlier trials in this condition, training included.
    direct : bool
        Leave out body, cameras and map, for comparison: c is the limb's position.
    rate : float
        Frames per second.
    latency : float
        Of the system, s.
    align : float
        Time before the profile begins, s.
    **arm_loop
        Of :class:`ikns.simulation.operator.ArmLoop`.
    """
    if step.condition not in CONDITIONS:
        raise InvalidInput(
            f"expected a condition of {', '.join(CONDITIONS)} for a virtual operator, "
            f"found '{step.condition}'."
        )
    name = f"{participant.number}/{step.key}".encode()
    seeds = np.random.SeedSequence([participant.seed, *name])
    noise, body = (int(word) for word in seeds.generate_state(2, np.uint64))
    ability = participant.abilities[step.condition].practised(practised)
    element: ControlledElement
    if step.condition == "ikns" and not direct:
        loop = participant.arm_loop(
            seconds=align + profile.seconds,
            rate=rate,
            seed=body,
            latency=latency,
            **arm_loop,
        )
        element, start = loop, loop.comfortable
    else:
        element, start = Delay(latency, rate=rate), 0.5
    operator = Operator(ability, rate=rate, seed=noise, start=start)
    return virtual_trial(operator, element, profile, align=align)
