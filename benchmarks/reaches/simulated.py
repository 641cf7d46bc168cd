"""What a virtual subject does after the calibration: natural reaches, and tracking.

The person knows a swivel of the elbow for every c: from one end of the self-motion that
they explored to the other. What they mean is therefore known without any map, and the
postures come from the Jacobian's self-motion alone.
"""

from dataclasses import dataclass

import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.simulation import (
    Protocol,
    Unsteadiness,
    simulate_protocol,
    virtual_subject,
)
from ikns.simulation.arm import GIRDLE_FOLLOW, ArmKinematics, girdle, self_motion
from ikns.simulation.habitual_places import (
    habitual_somewhere,
    natural_swivel,
    reach_by_joints,
)
from ikns.simulation.movement import (
    MovementPlan,
    execute_plan,
    explore,
    join,
    reach,
    reach_samples,
)
from ikns.simulation.places import Place, comfortable_posture
from ikns.simulation.trial import Trial, place_in_room, record_trial
from ikns.simulation.wander import minimum_jerk

RATE = 50.0
CHAIN = "right_arm"
#: Least room for the elbow at a place, rad: that of the simulated protocol.
_LEAST = np.radians(40.0)


@dataclass(frozen=True)
class Session:
    """What the cameras and the calibrated body made of one exercise.

    Parameters
    ----------
    motion : Motion
        Measured.
    meant : (T,) array
        What the person meant c to be.
    held : (T,) boolean array
        Whether the hand was held.
    swivel : (T,) array
        True elbow swivel, rad.
    """

    motion: Motion
    meant: np.ndarray
    held: np.ndarray
    swivel: np.ndarray

    def reaches(self) -> list[tuple[int, int]]:
        """Last sample of the rest before and first of the rest after each reach."""
        ends = np.flatnonzero(np.diff((~self.held).astype(int)))
        return [(int(a), int(b + 1)) for a, b in ends.reshape(-1, 2)]


@dataclass(frozen=True)
class Person:
    """A calibrated virtual subject and its exercises.

    Parameters
    ----------
    subject : Subject
        As calibrated, with the motion of the calibration.
    natural, raised, tracking : Session
        Reaches in natural postures (nothing is meant); reaches with c meant to stay at
        0.8; c meant to follow a curve while holding and while reaching.
    room : float
        Elbow swivel from c = 0 to c = 1, on average, rad.
    """

    subject: Subject
    natural: Session
    raised: Session
    tracking: Session
    room: float


def simulate(seed: int, *, quick: bool) -> Person:
    """Calibrate a virtual subject and let it reach and track."""
    person = virtual_subject(seed)
    run = simulate_protocol(person, seed=seed, free_seconds=0.1, rate=RATE, quick=quick)
    adult = person.adult
    subject = calibrate(
        run.static.recording,
        [run.points.recording],
        generic=Skeleton.from_anthropometry(adult.stature_m, adult.mass_kg, adult.sex),
        chain=CHAIN,
    )
    rng = np.random.default_rng([seed, 4])
    arm = ArmKinematics(person.skeleton, "right")
    places = _places(run, arm, 5 if quick else 12, rng)
    n = 4 if quick else 17
    order = [places[i] for i in _wandering(len(places), n, rng)]
    seconds = 12.0 if quick else 120.0
    curve = _curve(seconds, rng)
    stay = 3.0
    visits = [places[i] for i in _wandering(len(places), int(seconds / stay), rng)]
    exercises = {
        "natural": _naturally(run, arm, n, rng),
        "raised": _go(order, [0.8] * n, hold=1.3),
        "tracking": _go(visits, curve, hold=stay),
    }
    return Person(
        subject=subject,
        room=float(np.mean([np.ptp(p.motion.swivel) for p in places])),
        **{
            name: _carried_out(run, arm, subject, plan, meant, rng)
            for name, (plan, meant) in exercises.items()
        },
    )


def _places(
    run: Protocol, arm: ArmKinematics, n: int, rng: np.random.Generator
) -> list[Place]:
    """Find new places within the box, held as this person held the points."""
    rows = [np.flatnonzero(run.points.point == k) for k in range(len(run.places))]
    sitting, rest, wrist = _sitting(run, arm)
    half = np.mean([np.ptp(run.points.swivel[r]) for r in rows]) / 2
    places: list[Place] = []
    while len(places) < n:
        position = rng.uniform(run.places.min(axis=0), run.places.max(axis=0))
        turned = wrist + rng.normal(0.0, np.radians([8.0, 4.0, 3.0]))
        try:
            swivel = natural_swivel(
                arm,
                sitting,
                position,
                wrist=turned,
                habits=run.habits,
                girdle_rest=rest,
            ) + rng.normal(0.0, run.habits.rest)
            posture = comfortable_posture(
                arm, sitting, position, swivel=swivel, wrist=turned, girdle_rest=rest
            )
            body = arm.put(sitting, posture)
            motion = self_motion(arm, body, lowest=swivel - half, highest=swivel + half)
        except InvalidInput:  # out of reach
            continue
        if np.ptp(motion.swivel) >= _LEAST:
            places.append(Place(posture, *arm.hand(body), arm.swivel(body), motion))
    return places


def _sitting(run: Protocol, arm: ArmKinematics) -> tuple[np.ndarray, ...]:
    """Joint angles (18,), clavicle at rest (2,) and wrist (3,) of this person, rad."""
    truth, point = run.points.truth, run.points.point
    first = [np.flatnonzero(point == k)[0] for k in range(len(run.places))]
    postures = truth.angles[first][:, arm.columns]
    rest = [p[:2] - girdle(p, np.zeros(2), follow=GIRDLE_FOLLOW) for p in postures]
    return (
        truth.angles[first].mean(axis=0),
        np.mean(rest, axis=0),
        postures[:, 6:].mean(axis=0),
    )


def _naturally(
    run: Protocol, arm: ArmKinematics, n: int, rng: np.random.Generator
) -> tuple[MovementPlan, np.ndarray]:
    """Reach from place to place, hands turned as real ones are, meaning nothing."""
    sitting, rest, _ = _sitting(run, arm)
    places = [
        habitual_somewhere(arm, sitting, habits=run.habits, girdle_rest=rest, rng=rng)
        for _ in range(n)
    ]
    parts = []
    for i, place in enumerate(places):
        if i:
            before = places[i - 1]
            m = reach_samples(before, place, rate=RATE)
            parts.append(reach_by_joints(arm, sitting, before, place, n=m))
        parts.append(explore(place, seconds=1.3, rate=RATE, rng=rng, index=i))
    plan = join(parts)
    return plan, np.zeros(len(plan.point))


def _wandering(n: int, steps: int, rng: np.random.Generator) -> list[int]:
    """Numbers below `n`, none twice in a row."""
    ways = np.r_[rng.integers(n), rng.integers(1, n, steps - 1)]
    return [int(i) for i in np.cumsum(ways) % n]


def _curve(seconds: float, rng: np.random.Generator) -> np.ndarray:
    """Pseudo-random curve in 0.05 to 0.95: four sines of 0.05 to 0.25 Hz."""
    time = np.arange(2 * round(seconds * RATE)) / RATE
    hertz, phase = rng.uniform(0.05, 0.25, 4), rng.uniform(0, 2 * np.pi, 4)
    wave = np.sin(2 * np.pi * np.outer(time, hertz) + phase).sum(axis=1)
    return 0.05 + 0.9 * (wave - wave.min()) / np.ptp(wave)


def _at(place: Place, c: np.ndarray) -> np.ndarray:
    """Postures that mean these c, (..., 9)."""
    low, high = place.motion.swivel[[0, -1]]
    return place.motion.at(low + np.asarray(c) * (high - low))


def _go(
    places: list[Place], meant: np.ndarray | list[float], *, hold: float
) -> tuple[MovementPlan, np.ndarray]:
    """Visit places one after the other and mean c there: one value each, or a curve."""
    curve = meant if isinstance(meant, np.ndarray) else None
    parts, told, done = [], [], 0
    for i, place in enumerate(places):
        for n in ([reach_samples(places[i - 1], place, rate=RATE)] if i else []) + [
            round(hold * RATE)
        ]:
            reaching = bool(i) and len(parts) % 2 == 1
            share = minimum_jerk(n) if reaching else np.ones(n)
            before = places[i - 1] if reaching else place
            if curve is not None:
                start = end = c = curve[done : done + n]
            else:
                start, end = meant[i - 1] if reaching else meant[i], meant[i]
                c = start + share * (end - start)
            way = reach(before, place, n=n)
            still = ~np.full(n, reaching)
            parts.append(
                MovementPlan(
                    (1 - share[:, None]) * _at(before, start)
                    + share[:, None] * _at(place, end),
                    way.position if reaching else np.tile(place.position, (n, 1)),
                    way.rotation if reaching else np.tile(place.rotation, (n, 1, 1)),
                    np.where(still, i, -1),
                )
            )
            told.append(np.broadcast_to(c, n))
            done += n
    return join(parts), np.concatenate(told)


def _carried_out(
    run: Protocol,
    arm: ArmKinematics,
    subject: Subject,
    plan: MovementPlan,
    meant: np.ndarray,
    rng: np.random.Generator,
) -> Session:
    n = len(plan.point)
    sitting = run.points.truth.angles[0]
    angles = execute_plan(
        arm,
        np.tile(sitting, (n, 1)),
        plan,
        unsteadiness=Unsteadiness(),
        rate=RATE,
        rng=rng,
    )
    q = place_in_room(
        angles,
        height=1.0,
        heading=0.0,
        sway=(2e-3, np.radians(0.3)),
        rate=RATE,
        rng=rng,
    )
    trial: Trial = record_trial(
        [arm],
        q,
        name="reaches",
        point=plan.point,
        with_static_only=False,
        noise=1e-3,
        skin=None,
        occluded=0.03,
        rate=RATE,
        rng=rng,
    )
    motion = MarkerIK(subject.skeleton).track(trial.recording, chain=CHAIN)
    return Session(motion, meant, plan.point >= 0, trial.swivel)
