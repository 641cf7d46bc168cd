"""The calibration protocol of the paper, carried out by a virtual subject.

Five seconds standing still; then seated, one minute of free exploration; then the hand
at ten points of a box, five seconds each, with the elbow moving freely while the hand
is held, and reaches in between. All of it is simulated and says so.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.simulation.arm import Arm
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.exercise import roam, visit
from ikns.simulation.movement import Plan, Unsteadiness, carry_out
from ikns.simulation.places import GIRDLE_FOLLOW, box_points, explored_places
from ikns.simulation.subject import VirtualSubject
from ikns.simulation.trial import Trial, film, place_in_room
from ikns.simulation.wander import wander

__all__ = ["Protocol", "simulate_protocol"]

Array = NDArray[np.float64]

#: Height of the jugular notch over the floor, share of stature, standing and on a chair
#: (assumptions; no result depends on them).
_STANDING, _SEATED = 0.81, 0.60
#: Sway of the trunk, m and rad per axis: seated it is small, as the protocol asks not
#: to move the torso (assumptions).
_SWAY_SEATED, _SWAY_STANDING = (2e-3, np.radians(0.3)), (5e-3, np.radians(0.5))
#: Slow wandering of joints that are meant to be still, rad (assumption).
_STILL = np.radians(0.3)
#: Arms a little off the body and a little bent, for the static trial; hand in the lap.
#: In the order of the chain ``*_arm_clavicle``, rad.
_STATIC = np.radians([0.0, 0.0, 17.0, 8.0, 0.0, 20.0, 0.0, 0.0, 0.0])
_RESTING = np.radians([0.0, 0.0, 8.0, 22.0, -25.0, 75.0, 20.0, 0.0, 0.0])
#: How the static posture differs from person to person, rad (assumption).
_STATIC_SD = np.radians(2.0)


@dataclass(frozen=True)
class Protocol:
    """All trials of a virtual subject.

    Parameters
    ----------
    subject : VirtualSubject
        Who.
    side : {"right", "left", "both"}
        What explored.
    static, free, points : Trial
        Standing still; free exploration; the points with the reaches between them.
    places : (P, 3) array
        Where the hand, or the middle of both, was meant to be at each point, thorax
        frame, m.
    settings : dict
        Every setting, for the record.
    skin : SoftTissue, optional
        How this person's skin moves, where it does.
    """

    subject: VirtualSubject
    side: str
    static: Trial
    free: Trial
    points: Trial
    places: Array
    settings: dict[str, object]
    skin: SoftTissue | None = None

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Static, free exploration, points."""
        return (self.static, self.free, self.points)


def simulate_protocol(
    subject: VirtualSubject,
    *,
    seed: int,
    side: str = "right",
    n_points: int = 10,
    static_seconds: float = 5.0,
    free_seconds: float = 60.0,
    point_seconds: float = 5.0,
    marker_noise: float = 1e-3,
    soft_tissue: float = 0.0,
    occluded: float = 0.03,
    unsteadiness: Unsteadiness | None = None,
    girdle_rhythm: float = 0.0,
    rate: float = 100.0,
    quick: bool = False,
) -> Protocol:
    """Let a virtual subject go through the protocol.

    Parameters
    ----------
    subject : VirtualSubject
        From :func:`virtual_subject`.
    seed : int
        Same seed and settings, same recordings. The motion does not depend on the
        settings of markers, so two kinds of artifacts can be compared on one motion.
    side : {"right", "left", "both"}
        The arm that explores while the other rests; or both, as if holding an object
        between the hands, each elbow with a rhythm of its own.
    n_points : int
        Points of the box, at most 10.
    static_seconds, free_seconds, point_seconds : float
        Length of the static trial, of the free exploration, of the stay at each point.
    marker_noise : float
        Camera noise, m, standard deviation per axis.
    soft_tissue : float
        Root mean square displacement of the markers over the bones, m.
    occluded : float
        Share of marker frames that the cameras miss.
    unsteadiness : Unsteadiness, optional
        How still the hand is held.
    girdle_rhythm : float
        How much of its way the clavicle follows the upper arm while the hand is held:
        0 keeps it still at each point, 1 moves it as between points.
    rate : float
        Frames per second.
    quick : bool
        A shorter protocol: at most 5 s of free exploration and 3 s a point.

    Returns
    -------
    Protocol

    Raises
    ------
    InvalidInput
        When a setting is out of its range, or the person cannot reach a point.

    Examples
    --------
    >>> from ikns.simulation.subject import virtual_subject
    >>> run = simulate_protocol(virtual_subject(1), seed=1, n_points=1, quick=True)
    >>> run.points.recording.rate.__round__(), run.points.recording.source
    (100, 'simulated points trial')
    """
    if quick:
        free_seconds, point_seconds = min(free_seconds, 5.0), min(point_seconds, 3.0)
    unsteadiness = Unsteadiness() if unsteadiness is None else unsteadiness
    settings: dict[str, object] = {
        "seed": seed,
        "side": side,
        "n_points": n_points,
        "static_seconds": static_seconds,
        "free_seconds": free_seconds,
        "point_seconds": point_seconds,
        "marker_noise": marker_noise,
        "soft_tissue": soft_tissue,
        "occluded": occluded,
        "unsteadiness": asdict(unsteadiness),
        "girdle_rhythm": girdle_rhythm,
        "rate": rate,
    }
    sides = SIDES if side == "both" else (side,)
    arms = [Arm(subject.skeleton, name) for name in sides]
    # A stream for each use, so that changing one thing leaves the others as they are.
    of_person, of_static, of_free, of_points, of_skin, of_cameras = (
        np.random.default_rng(seed).spawn(6)
    )
    girdle_rest = of_person.normal(0.0, np.radians([3.0, 2.0]))
    heading = of_person.uniform(-np.pi, np.pi)
    sitting = _pose(subject.skeleton, _RESTING)
    standing = _pose(subject.skeleton, _STATIC)
    standing += of_person.normal(0.0, _STATIC_SD, len(standing))
    for arm in arms:
        standing[arm.columns[:2]] = girdle_rest
    positions = box_points(arms, sitting, n=n_points, rng=of_person)
    places = [
        explored_places(
            arm,
            sitting,
            position,
            rng=of_person,
            girdle_rest=girdle_rest,
            girdle_follow=girdle_rhythm * GIRDLE_FOLLOW,
        )
        for arm, position in zip(arms, positions, strict=True)
    ]

    def seated(plans: list[Plan], rng: np.random.Generator) -> Array:
        angles = _still(sitting, len(plans[0].point), rate, rng)
        for arm, plan in zip(arms, plans, strict=True):
            angles = carry_out(
                arm, angles, plan, unsteadiness=unsteadiness, rate=rate, rng=rng
            )
        return place_in_room(
            angles,
            height=_SEATED * subject.adult.stature_m,
            heading=heading,
            sway=_SWAY_SEATED,
            rate=rate,
            rng=rng,
        )

    n_static = max(2, round(static_seconds * rate))
    free = roam(
        arms,
        sitting,
        seconds=free_seconds,
        rate=rate,
        girdle_rest=girdle_rest,
        rng=of_free,
    )
    points = visit(places, seconds=point_seconds, rate=rate, rng=of_points)
    q = {
        "static": place_in_room(
            _still(standing, n_static, rate, of_static),
            height=_STANDING * subject.adult.stature_m,
            heading=heading,
            sway=_SWAY_STANDING,
            rate=rate,
            rng=of_static,
        ),
        "free": seated(free, of_free),
        "points": seated(points, of_points),
    }
    point = {
        "static": np.full(n_static, -1),
        "free": free[0].point,
        "points": points[0].point,
    }
    skin = None
    if soft_tissue > 0:
        skin = SoftTissue(
            subject.skeleton,
            soft_tissue,
            reference=q["static"][:, -len(standing) :].mean(axis=0),
            angles=q["points"][:, -len(standing) :],
            rng=of_skin,
        )
    trials = {
        name: film(
            arms,
            q[name],
            name=name,
            point=point[name],
            with_static_only=name == "static",
            noise=marker_noise,
            skin=skin,
            occluded=occluded,
            rate=rate,
            rng=rng,
        )
        for name, rng in zip(q, of_cameras.spawn(3), strict=True)
    }
    return Protocol(
        subject=subject,
        side=side,
        places=np.mean(positions, axis=0),
        settings=settings,
        skin=skin,
        **trials,
    )


def _pose(skeleton: Skeleton, posture: Array) -> Array:
    """Joint angles with both arms in the same posture, (18,)."""
    angles = np.zeros(len(skeleton.joint_names))
    for side in SIDES:
        angles = Arm(skeleton, side).put(angles, posture)
    return angles


def _still(angles: Array, n: int, rate: float, rng: np.random.Generator) -> Array:
    """Joints that are meant to be still, (n, 18)."""
    return angles + wander(rng, n, len(angles), sd=_STILL, cutoff=0.3, rate=rate)
