"""The calibration protocol of the paper with a virtual subject.

Five seconds standing still; then seated, one minute of free exploration; then ten
points of a box, five seconds each, with the hand held and the elbow moving freely, and
reaches in between. Everything is simulated, and labeled so.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.chains import SIDES
from ikns.simulation.arm import GIRDLE_FOLLOW, ArmKinematics
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.exercise import explore_freely, explore_points
from ikns.simulation.movement import Unsteadiness
from ikns.simulation.posture_habits import PostureHabits, draw_posture_habits
from ikns.simulation.protocol_body import draw_protocol_body
from ikns.simulation.subject import VirtualSubject
from ikns.simulation.trial import Trial, record_trial


@dataclass(frozen=True)
class Protocol:
    """The trials of a virtual subject.

    Parameters
    ----------
    side : {"right", "left", "both"}
        The exploring arm.
    static, free, points : Trial
        Standing still; free exploration; the points with the reaches between them.
    places : (P, 3) array
        Intended position of the hand, or of the middle between both hands, at each
        point, thorax frame, m.
    settings : dict
        All settings of the simulation.
    skin : SoftTissue, optional
        Soft tissue of this person, if it moves.
    habits : PostureHabits, optional
        Natural posture of this person; None for one posture everywhere.
    """

    subject: VirtualSubject
    side: str
    static: Trial
    free: Trial
    points: Trial
    places: Array
    settings: dict[str, object]
    skin: SoftTissue | None = None
    habits: PostureHabits | None = None

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
    hand_turn: float = 0.0,
    habits: PostureHabits | Literal["drawn"] | None = "drawn",
    rate: float = 100.0,
    quick: bool = False,
) -> Protocol:
    """Simulate the calibration protocol with a virtual subject.

    Parameters
    ----------
    subject : VirtualSubject
        From :func:`virtual_subject`.
    seed : int
        The same seed and settings give the same recordings. The motion does not depend
        on the settings of markers, so artifacts can be compared on one motion.
    side : {"right", "left", "both"}
        The arm that explores while the other rests; or both, as if holding an object
        between the hands, each elbow with its own rhythm.
    n_points : int
        Points of the box, at most 10.
    static_seconds, free_seconds, point_seconds : float
        Duration of the static trial, of free exploration, and at each point.
    marker_noise : float
        Camera noise, m, standard deviation per axis.
    soft_tissue : float
        Root mean square displacement of the markers over the bones, m.
    occluded : float
        Share of marker frames that the cameras miss.
    unsteadiness : Unsteadiness, optional
        How steadily the hand is held.
    girdle_rhythm : float
        How far the clavicle follows the upper arm while the hand is held: 0 keeps it
        still at each point, 1 moves it as much as between points.
    hand_turn : float
        A second degree of freedom: the person also turns the hand about its long axis
        at each point, by this angle to either side, rad. 0.35 (20 deg) is comfortable.
    habits : PostureHabits, "drawn" or None
        How the elbow moves with the hand when the person intends nothing; drawn from
        real people's by default. None is a person who holds nearly the same posture
        everywhere, and the hand within 2 cm of the points.
    rate : float
        Frames per second.
    quick : bool
        A shorter protocol: at most 5 s of free exploration and 3 s per point.

    Raises
    ------
    InvalidInput
        When a setting is out of its range, or the person cannot reach a point.

    Examples
    --------
    >>> from ikns import simulate_protocol, virtual_subject
    >>> run = simulate_protocol(virtual_subject(1), seed=1, n_points=1, quick=True)
    >>> run.points.recording.source, len(run.static.recording.labels)
    ('simulated points trial', 24)
    """
    if quick:
        free_seconds, point_seconds = min(free_seconds, 5.0), min(point_seconds, 3.0)
    unsteadiness = unsteadiness or Unsteadiness()
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
        "hand_turn": hand_turn,
        "habits": habits is not None,
        "rate": rate,
    }
    sides = SIDES if side == "both" else (side,)
    arms = [ArmKinematics(subject.skeleton, name) for name in sides]
    # A stream for each use, so that changing one thing leaves the others as they are.
    of_person, of_static, of_free, of_points, of_skin, of_cameras, of_habits = (
        np.random.default_rng(seed).spawn(7)
    )
    if habits == "drawn":
        habits = draw_posture_habits(of_habits)
    person = draw_protocol_body(
        subject,
        arms,
        n_points=n_points,
        girdle_follow=girdle_rhythm * GIRDLE_FOLLOW,
        habits=habits,
        rng=of_person,
    )
    free = explore_freely(
        arms,
        person.sitting,
        seconds=free_seconds,
        rate=rate,
        girdle_rest=person.girdle_rest,
        habits=habits,
        rng=of_free,
    )
    points = explore_points(
        person.places,
        seconds=point_seconds,
        rate=rate,
        rng=of_points,
        hand_turn=hand_turn,
    )
    n_static = max(2, round(static_seconds * rate))
    q = {
        "static": person.standing_still(n_static, rate, of_static),
        "free": person.seated(free, unsteadiness, rate, of_free),
        "points": person.seated(points, unsteadiness, rate, of_points),
    }
    skin = _skin(subject, soft_tissue, q, rng=of_skin)
    point = [np.full(n_static, -1), free[0].point, points[0].point]
    cameras = {"noise": marker_noise, "occluded": occluded, "rate": rate}
    trials = _recorded(arms, q, point, skin, cameras, of_cameras)
    return Protocol(
        subject=subject,
        side=side,
        places=np.mean(person.positions, axis=0),
        settings=settings,
        skin=skin,
        habits=habits,
        **trials,
    )


def _skin(
    subject: VirtualSubject,
    soft_tissue: float,
    q: dict[str, Array],
    *,
    rng: np.random.Generator,
) -> SoftTissue | None:
    """Skin that moves with the posture by so much, m; None for markers on bone."""
    if not soft_tissue > 0:
        return None
    joints = {
        name: rows[:, -len(subject.skeleton.joint_names) :] for name, rows in q.items()
    }
    return SoftTissue(
        subject.skeleton,
        soft_tissue,
        reference=joints["static"].mean(axis=0),
        angles=joints["points"],
        rng=rng,
    )


def _recorded(
    arms: list[ArmKinematics],
    q: dict[str, Array],
    point: list[NDArray[np.int64]],
    skin: SoftTissue | None,
    cameras: dict[str, float],
    rng: np.random.Generator,
) -> dict[str, Trial]:
    """Return what the cameras see of each trial, in a stream of its own."""
    streams = rng.spawn(len(q))
    return {
        name: record_trial(
            arms,
            q[name],
            name=name,
            point=at,
            with_static_only=name == "static",
            skin=skin,
            rng=stream,
            **cameras,
        )
        for name, at, stream in zip(q, point, streams, strict=True)
    }
