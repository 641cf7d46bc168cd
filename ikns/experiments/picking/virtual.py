"""Simulated picks of virtual participants, with contact physics."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import chain_joints
from ikns.errors import InvalidInput
from ikns.experiments.picking.objects import PickObject, load_objects
from ikns.experiments.picking.schedule import PickStep
from ikns.live.control.settings import ControlSettings
from ikns.simulation.grasp import (
    CarriedArm,
    ElbowInput,
    Grasp,
    Person,
    PickResult,
    RingInput,
    Route,
    Solid,
    arch_length,
    draw_habits,
    grip_height,
    hand_route,
    pick,
)
from ikns.simulation.grasp.route import DOWN, EXTRA_RANGE, LIFT
from ikns.simulation.movement import Unsteadiness, hand_drift, reach_seconds
from ikns.simulation.operator import Operator, Participant

#: Conditions that a virtual participant can do.
VIRTUAL_CONDITIONS = ("ikns", "ring")
#: Height of the lowest grip above the table, m; higher grips raise the route.
_LOWEST_GRIP = 0.045


def virtual_pick_step(
    participant: Participant,
    step: PickStep,
    *,
    practised: int,
    rate: float = 100.0,
    latency: float = 0.05,
    **more: Any,
) -> dict[str, Any]:
    """Simulate one step of a schedule; return it as a row of a visit.

    The row depends on participant, step and settings alone, not on what was simulated
    before.

    Parameters
    ----------
    participant : Participant
    step : PickStep
        Training or trial.
    practised : int
        Earlier picks in this condition, training included.
    rate : float
        Frames per second.
    latency : float
        Of the system, s.
    **more
        Passed to :func:`virtual_pick`.

    Returns
    -------
    dict
        The columns of a picking attempt and, in SI units: `why`; `peak_grip_N`, the
        finger's largest force on the object; `slip_m`, displacement of the object in
        the hand while carried; `c_drift`, largest change of c due to the movement to
        the goal with the elbow held as at contact (signed; 0 for a ring); `hold_share`,
        share of the carrying in which the finger touched the object; `contact_c`,
        flexion at contact; `c_margin`, smallest command beyond that while carrying. NaN
        where there was none.
    """
    picked, drift = virtual_pick(
        participant, step, practised=practised, rate=rate, latency=latency, **more
    )
    carried = picked.carried
    force = picked.trace[:, 3]
    held = picked.in_hand[carried]
    commands = picked.trace[carried, 1]
    contact = float(picked.trace[np.argmax(carried), 2]) if len(held) else math.nan
    return {
        "key": step.key,
        "kind": step.kind,
        "condition": step.condition,
        "object": step.object,
        "repeat": step.repeat,
        "outcome": picked.outcome,
        "reason": "",
        "practised": practised,
        "time": picked.time,
        "limit": step.limit,
        "comment": "",
        "why": picked.why,
        "peak_grip_N": float(force.max()),
        "slip_m": _largest_displacement(held),
        "c_drift": drift,
        "hold_share": float(np.mean(force[carried] > 0)) if len(held) else math.nan,
        "contact_c": contact,
        "c_margin": float(np.min(commands) - contact) if len(held) else math.nan,
    }


def virtual_pick(
    participant: Participant,
    step: PickStep,
    *,
    practised: int,
    rate: float = 100.0,
    latency: float = 0.05,
    settings: ControlSettings | None = None,
    unsteadiness: Unsteadiness | None = None,
    feedback: Literal["finger", "signal"] = "finger",
    squeeze: float | None = None,
    crosstalk: float = 0.0,
    objects: dict[str, PickObject] | None = None,
    **model: Any,
) -> tuple[PickResult, float]:
    """Simulate one pick and place.

    With "ikns" the signal passes through the whole chain: intended command -> limb ->
    elbow along the Jacobian's self-motion at the moving hand -> markers with noise,
    skin and gaps -> IK -> map -> controller -> finger. With "ring" it is a button.

    Parameters
    ----------
    participant : Participant
    step : PickStep
    practised : int
    rate, latency : float
        See :func:`virtual_pick_step`.
    settings : ControlSettings, optional
        Of the controller.
    unsteadiness : Unsteadiness, optional
        Deviation of the hand from its route.
    feedback : {"finger", "signal"}
        What the person sees, see :class:`ikns.simulation.grasp.ElbowInput`.
    squeeze : float, optional
        Replaces the person's own, see :class:`ikns.simulation.grasp.Habits`.
    crosstalk : float
        Crosstalk added to that of the map: how far c falls on the way to the goal.
    objects : dict of str to PickObject, optional
        Default: :func:`ikns.experiments.picking.load_objects`.
    **model
        Passed to :class:`ikns.simulation.grasp.Grasp`.

    Returns
    -------
    picked : PickResult
    drift : float
        Change of c due to the movement alone; NaN when nothing was carried.
    """
    if step.condition not in VIRTUAL_CONDITIONS or step.kind == "rest":
        raise InvalidInput(
            f"expected a trial with {' or '.join(VIRTUAL_CONDITIONS)} for a virtual "
            f"participant, found a {step.kind} with '{step.condition}'."
        )
    known = load_objects() if objects is None else objects
    if step.object not in known:
        raise InvalidInput(
            f"expected an object of {', '.join(known)}, found '{step.object}'."
        )
    thing = known[step.object]
    solid = Solid(thing.shape, thing.size_m, thing.mass_kg)
    person_seed = np.random.SeedSequence([participant.seed, participant.number, 2])
    habits = draw_habits(person_seed)
    name = f"{participant.number}/{step.key}".encode()
    seeds = np.random.SeedSequence([participant.seed, *name]).generate_state(
        3, np.uint64
    )
    noise, body, shake = (int(word) for word in seeds)
    height = round(grip_height(solid) - _LOWEST_GRIP, 6)
    route = _route(_ByIdentity(participant), height)
    n = round(step.limit * rate) + 1
    steady = Unsteadiness() if unsteadiness is None else unsteadiness
    drift = hand_drift(n, rate=rate, seed=shake, unsteadiness=steady)
    span = arch_length(float(np.linalg.norm(route.goal - route.start)), LIFT)
    person = Person(
        habits if squeeze is None else habits.with_squeeze(squeeze),
        down=reach_seconds(DOWN),
        across=reach_seconds(span),
    )
    drive: ElbowInput | RingInput
    if step.condition == "ikns":
        ability = participant.abilities["ikns"].practised(practised)
        limits = (-EXTRA_RANGE, 1 + EXTRA_RANGE)
        operator = Operator(ability, rate=rate, seed=noise, start=0.0, limits=limits)
        arm = CarriedArm(
            participant,
            route,
            drift,
            rate=rate,
            seed=body,
            latency=latency,
            settings=settings,
        )
        drive = ElbowInput(operator, arm, feedback=feedback, crosstalk=crosstalk)
    else:
        drive = RingInput(reaction=habits.reaction, latency=latency, rate=rate)
    side = participant.protocol.side
    picked = pick(
        Grasp(solid, rate=rate, side=side, **model),
        person,
        drive,
        _way(route),
        drift=np.hstack([_in_world(drift[:, :3]), _in_world(drift[:, 3:])]),
        limit=step.limit,
    )
    if step.condition == "ring":
        return picked, 0.0
    if not picked.carried.any():
        return picked, math.nan
    contact = float(picked.trace[np.argmax(picked.carried), 2])
    return picked, _crosstalk(participant, route, contact)


class _ByIdentity:
    """A hashable participant that equals only itself, as participants hold arrays."""

    def __init__(self, participant: Participant) -> None:
        self.participant = participant

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByIdentity) and self.participant is other.participant

    def __hash__(self) -> int:
        return id(self.participant)


@lru_cache(maxsize=8)
def _route(key: _ByIdentity, height: float) -> Route:
    return hand_route(key.participant, height=height)


def _way(route: Route) -> Callable[[float], tuple[Array, float]]:
    """Return shift and turn of the hand by its position on the route."""

    @lru_cache(maxsize=1)  # it stays where it is in most frames
    def way(s: float) -> tuple[Array, float]:
        return _in_world(route.hand(s) - route.start), route.turn(s)

    return way


def _in_world(v: Array) -> Array:
    """Convert thorax axes (forward, up, right) to the world (forward, left, up)."""
    return np.stack([v[..., 0], -v[..., 2], v[..., 1]], axis=-1)


def _crosstalk(participant: Participant, route: Route, contact: float) -> float:
    """Return the largest change of c on the way to the goal, the elbow held, signed.

    The elbow is held where c at the object equals the flexion at contact. c is that of
    the calibrated map at the true postures, without noise or operator.
    """
    subject = participant.subject
    columns = subject.skeleton.columns(chain_joints(subject.chain)) - 6

    def c(places: Array, limbs: Array) -> Array:
        ways = list(zip(places.tolist(), limbs.tolist(), strict=True))
        q = np.array([route.posture(s, limb)[columns] for s, limb in ways])
        x = np.array([route.hand(s) for s, _ in ways])
        return np.ravel(subject.null_space_map.control_signal(q, x))

    limbs = np.linspace(0.0, 1.0, 11)
    limb = float(np.interp(contact, c(np.zeros(11), limbs), limbs))
    along = c(np.linspace(0.0, 1.0, 21), np.full(21, limb))
    change = along - along[0]
    return float(change[np.argmax(np.abs(change))])


def _largest_displacement(path: Array) -> float:
    if not len(path):
        return math.nan
    return float(np.linalg.norm(path - path[0], axis=1).max())
