"""The whole line on simulated recordings: gate, variance and radius are varied.

Markers with noise and occlusions, scaling, marker inverse kinematics and the map, as
`ikns.calibrate` does it; then a second recording of the same person elsewhere in the
box, tracked on the same scaled skeleton, against what is true of it.
"""

import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate, elbow_reference
from ikns.errors import NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap, null_space_samples, still_mask
from ikns.simulation import Trial, Unsteadiness, simulate_protocol
from ikns.simulation.exercise import explore_points
from ikns.simulation.movement import execute_plan
from ikns.simulation.places import Place
from ikns.simulation.trial import place_in_room, record_trial
from ikns.simulation.wander import wander
from interpolation.layouts import box_surface
from interpolation.truth import CHAIN, Person, Visit, line_angle

__all__ = ["CONDITIONS", "PAPER", "SWEEPS", "Recorded", "record", "sweep"]

Array = np.ndarray

#: Hands: as steady as the simulation's default; with three times drift and tilt; and
#: held in place, but with an orientation that is let go.
CONDITIONS = {
    "steady": Unsteadiness(),
    "unsteady": Unsteadiness(drift=12e-3, tilt=np.radians(3.6)),
    "turning": Unsteadiness(tilt=np.radians(10.0)),
}
#: The setting of the paper (of the radius it gives none: the rule), then what to try.
PAPER = {"gate": 0.05, "variance": 0.8, "radius": None}
SWEEPS: dict[str, tuple[float | None, ...]] = {
    "gate": (0.02, 0.03, 0.05, 0.075, 0.10, 0.15),
    "variance": (0.60, 0.70, 0.80, 0.90, 0.95, 0.99),
    "radius": (None, 0.01, 0.015, 0.02, 0.03, 0.05, 0.10),
}
#: Still samples that a point needs: half a second, the default of `calibrate`.
_MIN_STILL = 0.5
_NOISE, _OCCLUDED, _NEAR_VERTEX = 1e-3, 0.03, 0.012


@dataclass(frozen=True)
class Recorded:
    """A person's exploration and a second recording, tracked and true.

    Parameters
    ----------
    skeleton : Skeleton
        Scaled from the static trial.
    motion, test_motion : Motion
        Tracked from markers.
    points, tests : Trial
        The truth behind them.
    visits, test_visits : list of (rows, Visit)
        The truth at each place and the frames there.
    """

    skeleton: Skeleton
    motion: Motion
    test_motion: Motion
    points: Trial
    tests: Trial
    visits: list[tuple[Array, Visit]]
    test_visits: list[tuple[Array, Visit]]


def record(
    who: Person, seed: int, hand: Unsteadiness, *, n_tests: int, seconds: float
) -> Recorded:
    """Simulate, scale and track one person.

    Parameters
    ----------
    who : Person
    seed : int
        Of habits, motion and cameras.
    hand : Unsteadiness
    n_tests : int
        Places of the second recording, anywhere in the box.
    seconds : float
        At each place, 5 in the paper.
    """
    rng = np.random.default_rng([seed, 2])
    static = simulate_protocol(
        who.subject, seed=seed, n_points=1, free_seconds=0.1, point_seconds=0.1
    ).static
    # The clavicles that the static trial shows are those of the exploration.
    who = replace(
        who, girdle_rest=static.truth.angles[:, who.arm.columns[:2]].mean(axis=0)
    )
    near = rng.normal(0.0, _NEAR_VERTEX, (10, 3))
    corners = box_surface(who.low, who.high, 10, rng) + near
    inside = rng.uniform(who.low, who.high, (n_tests, 3))
    places = who.places(np.vstack([corners, inside]), rng)
    points = _filmed(who, places[:10], hand, seconds, 100.0, rng)
    tests = _filmed(who, places[10:], hand, seconds, 50.0, rng)
    adult = who.subject.adult
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a hand drifts is known here
        found = calibrate(
            static.recording,
            [points.recording],
            generic=Skeleton.from_anthropometry(
                adult.stature_m, adult.mass_kg, adult.sex
            ),
            chain=CHAIN,
        )
    return Recorded(
        skeleton=found.skeleton,
        motion=found.motions[0],
        test_motion=MarkerIK(found.skeleton).track(tests.recording, chain=CHAIN),
        points=points,
        tests=tests,
        visits=_visits(who, points),
        test_visits=_visits(who, tests),
    )


def sweep(
    recorded: Recorded,
    *,
    gate: float,
    variance: float,
    radius: float | None,
) -> dict[str, float]:
    """Learn with one setting; what it found and how wrong it is."""
    try:
        learned = _fit(recorded, gate, variance, radius)
    except NotEnoughData:
        lost = ("stray", "own", "angle", "c", "c95", "components")
        return {"kept": 0.0, "found": 0.0} | dict.fromkeys(lost, np.nan)
    gated = np.flatnonzero(still_mask(recorded.motion, CHAIN, max_hand_speed=gate))
    at_point = recorded.points.point >= 0
    used = at_point[gated[learned.labels_ >= 0]]
    result = {
        "kept": 100 * float(used.sum() / at_point.sum()),
        "stray": 100 * float(np.mean(~used)),
    }
    middles = np.array([one.center for _, one in recorded.visits])
    apart = cdist(learned.centers_, middles)
    own = line_angle(
        learned.directions_[:, 0],
        np.array([recorded.visits[k][1].direction for k in apart.argmin(axis=1)]),
    )
    x = recorded.test_motion.task_position(CHAIN)
    c = learned.control_signal(recorded.test_motion.chain_angles(CHAIN), x)
    angle, error = [], []
    for rows, one in recorded.test_visits:
        seen = np.isfinite(c[rows])
        if seen.any():
            z = learned.directions(x[rows][seen].mean(axis=0))[0]
            angle.append(line_angle(z, one.direction))
            off = c[rows][seen] - one.signal[seen]
            error.append(100 * np.sqrt(np.mean(off**2)))
    return result | {
        "found": float(len(np.unique(apart.argmin(axis=1)))),
        "own": float(np.degrees(np.median(own))),
        "angle": float(np.degrees(np.median(angle))),
        "c": float(np.median(error)),
        "c95": float(np.percentile(error, 95)),
        "components": float(learned.n_components_.mean()),
    }


def _fit(
    recorded: Recorded, gate: float, variance: float, radius: float | None
) -> NullSpaceMap:
    """Learn as `calibrate` does."""
    motion = recorded.motion
    x, q = null_space_samples(motion, CHAIN, max_hand_speed=gate)
    middle = motion.angles[still_mask(motion, CHAIN, max_hand_speed=gate)].mean(axis=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of points left out: they are counted
        return NullSpaceMap(
            10,
            variance=variance,
            radius=radius,
            reference=elbow_reference(recorded.skeleton, middle, CHAIN),
            min_samples=round(_MIN_STILL / (motion.time[1] - motion.time[0])),
        ).fit(x, q)


def _filmed(
    who: Person,
    places: list[Place],
    hand: Unsteadiness,
    seconds: float,
    rate: float,
    rng: np.random.Generator,
) -> Trial:
    """Film the person at one place after the other."""
    (plan,) = explore_points([places], seconds=seconds, rate=rate, rng=rng)
    n = len(plan.point)
    angles = who.body + wander(
        rng, n, len(who.body), sd=np.radians(0.3), cutoff=0.3, rate=rate
    )
    angles = execute_plan(who.arm, angles, plan, unsteadiness=hand, rate=rate, rng=rng)
    q = place_in_room(
        angles,
        height=0.6 * who.subject.adult.stature_m,
        heading=float(rng.uniform(-np.pi, np.pi)),
        sway=(2e-3, np.radians(0.3)),
        rate=rate,
        rng=rng,
    )
    return record_trial(
        [who.arm],
        q,
        name="points",
        point=plan.point,
        with_static_only=False,
        noise=_NOISE,
        skin=None,
        occluded=_OCCLUDED,
        rate=rate,
        rng=rng,
    )


def _visits(who: Person, trial: Trial) -> list[tuple[Array, Visit]]:
    rows = [np.flatnonzero(trial.point == k) for k in range(int(trial.point.max()) + 1)]
    return [(at, who.visited(trial.truth.q[at])) for at in rows]
