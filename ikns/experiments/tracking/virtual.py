"""Tracking trials of virtual operators: simulated, through the same trial machine."""

from __future__ import annotations

from typing import Any

import numpy as np

from ikns.errors import InvalidInput
from ikns.experiments.tracking.profiles import Profile
from ikns.experiments.tracking.schedule import Step
from ikns.experiments.tracking.trial import ALIGN, TrackingRecord, TrialMachine
from ikns.simulation.operator import CONDITIONS, Delay, Operator, Participant, track
from ikns.simulation.operator.loop import Driven, Steering

__all__ = ["virtual_step", "virtual_trial"]


def virtual_trial(
    operator: Steering, driven: Driven, profile: Profile, *, align: float = ALIGN
) -> TrackingRecord:
    """Let an operator go through one trial.

    Parameters
    ----------
    operator : Operator or Copyist
        Fresh; it sets the rate.
    driven : Driven
        What it drives, fresh too.
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
        driven,
        start=-align,
        end=profile.seconds,
    )
    trial = TrialMachine(profile, align=align)
    trial.start(float(done.time[0]))
    for time, c in zip(done.time.tolist(), done.c.tolist(), strict=True):
        trial.frame(time, c)
    return trial.record


def virtual_step(
    participant: Participant,
    step: Step,
    profile: Profile,
    *,
    practised: int,
    direct: bool = False,
    rate: float = 100.0,
    latency: float = 0.05,
    align: float = ALIGN,
    **arm_loop: Any,
) -> TrackingRecord:
    """Let a participant do one step of a schedule, training or trial.

    With the elbow ("ikns") through the whole chain, with a stick ("gamepad") at once.
    Same participant, step and settings, same record, whatever was done before.

    Parameters
    ----------
    participant : Participant
    step : Step
    profile : Profile
        Of the step.
    practised : int
        Trials done in this condition before, training included.
    direct : bool
        Leave body, cameras and map out: c is where the limb is, for comparison.
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
    driven: Driven
    if step.condition == "ikns" and not direct:
        loop = participant.arm_loop(
            seconds=align + profile.seconds,
            rate=rate,
            seed=body,
            latency=latency,
            **arm_loop,
        )
        driven, start = loop, loop.comfortable
    else:
        driven, start = Delay(latency, rate=rate), 0.5
    operator = Operator(ability, rate=rate, seed=noise, start=start)
    return virtual_trial(operator, driven, profile, align=align)
