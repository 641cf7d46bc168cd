"""Virtual people who visit places, and what is true there. Everything is simulated.

A visit is the pieces of `ikns.simulation`: a comfortable posture with the person's
habits, its self-motion from the Jacobian, the elbow going to and fro for five seconds.
The unsteady hand is added by the Jacobian's pseudoinverse: drift and tremor are a
centimeter at most. What is learned at a place comes from the joint angles alone, as
NullSpaceMap learns it; what is true there comes from the true body's Jacobian at the
visited postures. No interpolation has a part in either.
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ikns.calibration import elbow_reference
from ikns.errors import InvalidInput
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map.alignment import align
from ikns.numerics.subspace import mean_null_direction, principal_components
from ikns.simulation import Unsteadiness, VirtualSubject, virtual_subject
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.movement import (
    MovementPlan,
    execute_plan,
    explore,
    reach,
    reach_samples,
)
from ikns.simulation.places import (
    BOX_HIGH,
    BOX_LOW,
    Place,
    comfortable_posture,
    explored_places,
)
from ikns.simulation.wander import tremor, wander
from interpolation.schemes import Known

__all__ = [
    "CHAIN",
    "Person",
    "Visit",
    "learned",
    "learned_alone",
    "line_angle",
    "person",
]

Array = np.ndarray

CHAIN = "right_arm"
#: A hand that does just what was planned.
_STILL = Unsteadiness(0.0, 0.0, 0.3, 0.0, 0.0)
#: Samples per second: above what tremor needs.
_RATE = 50.0
#: Clavicle at rest, rad, standard deviation: protraction and elevation, as in
#: `ikns.simulation.protocol`.
_GIRDLE_SD = np.radians([3.0, 2.0])
#: Of the person's habits, as in `ikns.simulation.places`: swivel, and wrist.
_SWIVEL, _WRIST_SD = np.radians([38.0, 8.0]), np.radians([20.0, 8.0, 5.0])
#: By how much of its sides the box grows, each way, for reaches that leave it.
_BEYOND = 0.2


@dataclass(frozen=True)
class Visit:
    """Five seconds of self-motion with the hand held somewhere.

    Parameters
    ----------
    x : (K, 3) array
        Hand in the thorax frame, m.
    q : (K, 7) array
        Joint vectors of the chain, rad.
    direction : (7,) array
        Null space of the true Jacobian averaged over the visited postures; the elbow
        rises along it.
    lower, upper : float
        Ends of ``direction @ q``, rad.
    """

    x: Array
    q: Array
    direction: Array
    lower: float
    upper: float

    @property
    def center(self) -> Array:
        """Mean hand position, (3,) m."""
        return self.x.mean(axis=0)

    @property
    def signal(self) -> Array:
        """True control signal, (K,)."""
        return (self.q @ self.direction - self.lower) / (self.upper - self.lower)


@dataclass(frozen=True)
class Person:
    """A virtual subject who will visit places with one arm.

    Parameters
    ----------
    subject : VirtualSubject
        The true body.
    arm : ArmKinematics
    girdle_rest : (2,) array
        Clavicle angles with the arm hanging, rad.
    low, high : (3,) array
        The box that the hand works in, thorax frame, m.
    """

    subject: VirtualSubject
    arm: ArmKinematics
    girdle_rest: Array
    low: Array
    high: Array

    @property
    def body(self) -> Array:
        """Joint angles of all that does not move, (18,)."""
        return np.zeros(len(self.arm.skeleton.joint_names))

    def places(
        self, positions: Array, rng: np.random.Generator, *, varied: bool = True
    ) -> list[Place]:
        """Return places with self-motions at hand positions (N, 3).

        With habits that vary from place to place; or with the same habits everywhere,
        and then without positions that leave the elbow no room.
        """
        settings = {"girdle_rest": self.girdle_rest, "girdle_follow": 0.0}
        if varied:
            return explored_places(self.arm, self.body, positions, rng=rng, **settings)
        seed, found = int(rng.integers(2**32)), []
        for position in positions:
            habits = np.random.default_rng(seed)
            with contextlib.suppress(InvalidInput):
                found += explored_places(
                    self.arm, self.body, position[None], rng=habits, **settings
                )
        return found

    def visits(
        self,
        places: Sequence[Place],
        rng: np.random.Generator,
        *,
        unsteadiness: Unsteadiness = Unsteadiness(),  # noqa: B008 (frozen)
    ) -> list[Visit]:
        """Spend five seconds at each place."""
        return [self._visit(place, rng, unsteadiness) for place in places]

    def _visit(
        self, place: Place, rng: np.random.Generator, hand: Unsteadiness
    ) -> Visit:
        plan = explore(place, seconds=5.0, rate=_RATE, rng=rng, index=0)
        q = self.put(plan.postures)
        J = self.arm.skeleton.chain_jacobian(q, CHAIN)
        sway, shake = (
            np.repeat([shift, tilt], 3)
            for shift, tilt in (
                (hand.drift, hand.tilt),
                (hand.tremor, hand.tremor_tilt),
            )
        )
        off = sway * wander(rng, len(q), 6, sd=1.0, cutoff=hand.drift_hz, rate=_RATE)
        off += shake * tremor(rng, len(q), 6, sd=1.0, rate=_RATE)
        weights = np.linalg.solve(J @ np.swapaxes(J, 1, 2), off[..., None])
        q[:, self.arm.columns[2:]] += (np.swapaxes(J, 1, 2) @ weights)[..., 0]
        return self.visited(q)

    def visited(self, q: Array) -> Visit:
        """Return the truth about some postures (K, 18) or configurations (K, 25)."""
        skeleton = self.arm.skeleton
        direction = mean_null_direction(skeleton.chain_jacobian(q, CHAIN))[0][0]
        chain = q[:, self.columns(q)]
        along = chain @ direction
        if np.corrcoef(along, skeleton.swivel(q)[:, 0])[0, 1] < 0:
            direction, along = -direction, -along
        x = skeleton.hands_in_thorax(q)[0][:, 0]
        return Visit(x, chain, direction, float(along.min()), float(along.max()))

    def columns(self, q: Array) -> Array:
        """Columns of the chain in joint angles or configurations."""
        extra = q.shape[-1] - len(self.arm.skeleton.joint_names)
        return np.array(self.arm.columns[2:]) + extra

    def put(self, postures: Array) -> Array:
        """Joint angles of the body with the arm in postures (K, 9), (K, 18)."""
        q = np.repeat(self.body[None], len(postures), axis=0)
        q[:, self.arm.columns] = postures
        return q

    def reference(self, visits: Sequence[Visit]) -> Array:
        """Return what should rise with c: the elbow, as `calibrate` does it, (1, 7)."""
        middle = self.body
        middle[self.arm.columns[2:]] = np.mean(
            [visit.q.mean(axis=0) for visit in visits], axis=0
        )
        return elbow_reference(self.arm.skeleton, middle, CHAIN)

    def reaches(
        self, n: int, rng: np.random.Generator, *, rate: float = 100.0
    ) -> list[tuple[Array, Array]]:
        """Return reaches between places in and around the box, as (x, q) each.

        The ends lie anywhere in a box larger by a fifth on each side.
        """
        ends: list[Place] = []
        margin = _BEYOND * (self.high - self.low)
        while len(ends) <= n:
            try:
                posture = comfortable_posture(
                    self.arm,
                    self.body,
                    rng.uniform(self.low - margin, self.high + margin),
                    swivel=rng.normal(*_SWIVEL),
                    wrist=rng.normal(0.0, _WRIST_SD),
                    girdle_rest=self.girdle_rest,
                )
            except InvalidInput:
                continue  # out of reach
            body = self.arm.put(self.body, posture)
            ends.append(Place(posture, *self.arm.hand(body), self.arm.swivel(body)))
        found = []
        for start, end in zip(ends[:-1], ends[1:], strict=True):
            plan = reach(start, end, n=reach_samples(start, end, rate=rate))
            try:
                q = self._carried_out(plan, rate, rng)
            except InvalidInput:
                continue  # the straight way leads out of reach
            x = self.arm.skeleton.hands_in_thorax(q)[0][:, 0]
            found.append((x, q[:, self.arm.columns[2:]]))
        return found

    def _carried_out(
        self, plan: MovementPlan, rate: float, rng: np.random.Generator
    ) -> Array:
        angles = np.repeat(self.body[None], len(plan.point), axis=0)
        return execute_plan(
            self.arm, angles, plan, unsteadiness=_STILL, rate=rate, rng=rng
        )


def person(seed: int) -> Person:
    """Draw a person; same seed, same person."""
    subject = virtual_subject(seed)
    arm = ArmKinematics(subject.skeleton, "right")
    rest = np.random.default_rng([seed, 1]).normal(0.0, _GIRDLE_SD)
    lengths = subject.skeleton.segment_lengths
    reached = sum(lengths[f"right_{part}"] for part in ("upper_arm", "forearm", "hand"))
    shoulder = arm.shoulder(np.zeros(len(subject.skeleton.joint_names)))
    return Person(
        subject, arm, rest, shoulder + reached * BOX_LOW, shoulder + reached * BOX_HIGH
    )


def learned(
    visits: Sequence[Visit], reference: Array, *, variance: float = 0.8
) -> Known:
    """Return what NullSpaceMap learns from visits, each a cluster of its own.

    Parameters
    ----------
    visits : sequence of P Visit
    reference : (1, 7) array
        See :meth:`Person.reference`.
    variance : float
        Part of the variance that the components summed to Z explain.
    """
    parts = [principal_components(visit.q) for visit in visits]
    counts = [1 + int(np.sum(np.cumsum(ratio) < variance)) for _, ratio in parts]
    centers = np.array([visit.center for visit in visits])
    directions, _ = align(
        [rows[:k] for (rows, _), k in zip(parts, counts, strict=True)],
        [ratio[:k] for (_, ratio), k in zip(parts, counts, strict=True)],
        n_dof=1,
        edges=NaturalNeighborInterpolator(centers).edges,
        root=0,
        reference=reference,
    )
    along = [v.q @ z[0] for v, z in zip(visits, directions, strict=True)]
    return Known(
        directions=directions,
        lower=np.array([[a.min()] for a in along]),
        upper=np.array([[a.max()] for a in along]),
        centers=centers,
        postures=np.array([visit.q.mean(axis=0) for visit in visits]),
    )


def learned_alone(visit: Visit, reference: Array) -> Known:
    """Return what one visit shows by itself."""
    z = principal_components(visit.q)[0][:1]
    z = z * np.where(z @ reference[0] < 0, -1.0, 1.0)
    along = visit.q @ z[0]
    return Known(
        directions=z[None],
        lower=np.array([[along.min()]]),
        upper=np.array([[along.max()]]),
        centers=visit.center[None],
        postures=visit.q.mean(axis=0)[None],
    )


def line_angle(a: Array, b: Array) -> Array:
    """Angles between lines (..., n), rad, whatever their signs and lengths."""
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    away = np.linalg.norm(a - b, axis=-1)
    toward = np.linalg.norm(a + b, axis=-1)
    # Exact for small angles, unlike the arc cosine (Kahan).
    return 2 * np.arctan2(np.minimum(away, toward), np.maximum(away, toward))
