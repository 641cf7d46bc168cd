"""A reach that virtual subjects repeat with known spread of elbow and hand."""

from dataclasses import replace

import numpy as np

from ikns.analysis.ucm import (
    VarianceSplit,
    across_trials,
    aligned_angles,
    confidence_interval,
    numerical_task,
    surrogate_test,
    variance_split,
)
from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.simulation import Unsteadiness, simulate_protocol, virtual_subject
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.artifacts import SoftTissue
from ikns.simulation.movement import execute_plan, reach
from ikns.simulation.places import Place, explored_places
from ikns.simulation.trial import place_in_room, record_trial, true_motion

#: Spread of the elbow and of the hand over trials, rad and m per axis.
SWIVEL_SD, HAND_SD, WIDE_HAND_SD = np.radians(8.0), 5e-3, 20e-3
#: Camera noise and soft tissue, m.
NOISE, SKIN = 1e-3, 5e-3
DEG2 = np.degrees(1.0) ** 2
STEADY = "nothing varies but the pace"
APART = "same spread, joints independent"


class Reaches:
    """A simulated person who repeats one reach in several ways."""

    def __init__(self, seed: int, *, n_trials: int, rate: float) -> None:
        self.seed, self.n_trials, self.rate = seed, n_trials, rate
        self.run = simulate_protocol(
            virtual_subject(seed), seed=seed, n_points=4, quick=True, rate=rate
        )
        person = self.run.subject.skeleton
        self.arm = ArmKinematics(person, "right")
        self.measured, _ = scale(Skeleton.load(), self.run.static.recording)
        self.sitting = self.run.points.truth.angles[0]
        self.places = explored_places(
            self.arm,
            self.sitting,
            self.run.places[[0, 3]],
            rng=np.random.default_rng(seed),
            girdle_rest=self.sitting[self.arm.columns[:2]],
            girdle_follow=0.0,
        )

    def moved(self, swivel: np.ndarray, hand: np.ndarray) -> list[np.ndarray]:
        """Joint angles of each trial, (T, 18): elbow and hand off by so much."""
        trials = []
        for i in range(self.n_trials):
            ends = [
                self._off(p, swivel[i], hand[i, j]) for j, p in enumerate(self.places)
            ]
            n = round(self.rate * (0.9 + 0.2 * i / self.n_trials))
            plan = reach(*ends, n=n)
            body = np.repeat(self.sitting[None], n, axis=0)
            still_hand = Unsteadiness(drift=0.0, tilt=0.0, tremor=0.0, tremor_tilt=0.0)
            trials.append(
                execute_plan(
                    self.arm,
                    body,
                    plan,
                    unsteadiness=still_hand,
                    rate=self.rate,
                    rng=np.random.default_rng(0),
                )
            )
        return trials

    def _off(self, place: Place, swivel: float, hand: np.ndarray) -> Place:
        low, high = place.motion.swivel[[0, -1]]
        posture = place.motion.at(np.clip(place.swivel + swivel, low, high))
        return replace(place, posture=posture, position=place.position + hand)

    def filmed(
        self, trials: list[np.ndarray], *, skin: float
    ) -> tuple[list[Motion], list[Motion]]:
        """Truth, and what comes out behind cameras and inverse kinematics."""
        rng = np.random.default_rng(self.seed)
        tissue = None
        if skin:
            tissue = SoftTissue(
                self.arm.skeleton,
                skin,
                reference=self.run.static.truth.angles.mean(axis=0),
                angles=self.run.points.truth.angles,
                rng=rng,
            )
        truth, found = [], []
        for angles in trials:
            # Half a second of rest before and after, as recordings have.
            rest = round(self.rate / 2)
            angles = np.pad(angles, ((rest, rest), (0, 0)), mode="edge")
            q = place_in_room(
                angles,
                height=1.0,
                heading=0.5,
                sway=(2e-3, np.radians(0.3)),
                rate=self.rate,
                rng=rng,
            )
            trial = record_trial(
                [self.arm],
                q,
                name="reach",
                point=np.full(len(q), -1),
                with_static_only=False,
                noise=NOISE,
                skin=tissue,
                occluded=0.0,
                rate=self.rate,
                rng=rng,
            )
            time_s = np.arange(len(q)) / self.rate
            truth.append(true_motion(self.arm.skeleton, time_s, q))
            solver = MarkerIK(self.measured)
            found.append(solver.track(trial.recording, chain="right_arm"))
        return truth, found

    def true_split(self, truth: list[Motion]) -> VarianceSplit:
        """Split of the true angles; the Jacobian comes from differences of the hand."""
        skeleton = self.arm.skeleton
        angles = aligned_angles(truth, "right_arm")
        columns = [
            skeleton.joint_names.index(joint) for joint in chain_joints("right_arm")
        ]
        mean = angles.mean(axis=0)

        def hand(q: np.ndarray) -> np.ndarray:
            # Axes: time, which joint is moved, joint.
            body = np.array(np.broadcast_to(mean[:, None], (*q.shape[:-1], 18)))
            body[..., columns] = q
            return skeleton.hands_in_thorax(body)[0][..., 0, :]

        return variance_split(angles[..., columns], numerical_task(hand))

    def conditions(self) -> dict[str, list[np.ndarray]]:
        """Trials by how they vary."""
        rng = np.random.default_rng(self.seed)
        n = self.n_trials
        swivel = SWIVEL_SD * rng.normal(size=n)
        hand = HAND_SD * rng.normal(size=(n, 2, 3))
        nothing = np.zeros(n), np.zeros((n, 2, 3))
        steady = self.moved(*nothing)
        elbow = self.moved(swivel, hand)
        columns = self.arm.columns[2:]
        spread = np.std([trial[len(trial) // 2, columns] for trial in elbow], axis=0)
        apart = [trial.copy() for trial in steady]
        for trial in apart:
            trial[:, columns] += spread * rng.normal(size=len(columns))
        wide = WIDE_HAND_SD * rng.normal(size=(n, 2, 3))
        return {
            "elbow varies, hand kept": elbow,
            APART: apart,
            "hand varies, elbow kept": self.moved(nothing[0], wide),
            STEADY: steady,
        }


def virtual_person(seed: int, *, n_trials: int, quick: bool) -> list[dict]:
    """One row a condition, all simulated."""
    reaches = Reaches(seed, n_trials=n_trials, rate=50 if quick else 100)
    rows = []
    for name, trials in reaches.conditions().items():
        for skin in (0.0,) if quick else (0.0, SKIN):
            truth, found = reaches.filmed(trials, skin=skin)
            split = across_trials(reaches.measured, found)
            test = surrogate_test(split, n_surrogates=199 if quick else 999, seed=seed)
            interval = confidence_interval(split, overall=True)
            shift = split.delta_vz_corrected[50] - split.delta_vz[50]
            true = reaches.true_split(truth)
            rows.append(
                {
                    "seed": seed,
                    "condition": name,
                    "skin_mm": 1000 * skin,
                    "true_v_ucm_deg2": DEG2 * true.v_ucm.mean(),
                    "true_v_ort_deg2": DEG2 * true.v_ort.mean(),
                    "true_delta_vz": true.delta_vz_corrected.mean(),
                    "v_ucm_deg2": DEG2 * split.v_ucm.mean(),
                    "v_ort_deg2": DEG2 * split.v_ort.mean(),
                    "delta_vz": interval.estimate + shift,
                    "interval": [interval.low + shift, interval.high + shift],
                    "surrogates": test.mean.mean() + shift,
                    "p": test.p_overall,
                }
            )
    return rows
