"""Virtual participants: a calibrated body, and the abilities of an operator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.errors import InvalidInput
from ikns.simulation.arm import GIRDLE_FOLLOW, ArmKinematics, girdle
from ikns.simulation.habitual_places import natural_swivel
from ikns.simulation.operator.ability import CONDITIONS, Ability, sample_abilities
from ikns.simulation.operator.arm_loop import ArmLoop
from ikns.simulation.places import Place, widest_place
from ikns.simulation.protocol import Protocol, simulate_protocol
from ikns.simulation.subject import virtual_subject

#: Largest number of persons drawn until one can do the protocol.
_TRIES = 20


@dataclass(frozen=True)
class Participant:
    """A simulated person, calibrated and ready for experiments.

    Parameters
    ----------
    number, seed : int
        In the cohort, from 0; of the cohort.
    abilities : dict of str to Ability
        By condition; before practice.
    protocol : Protocol
        The recorded calibration, with the true body.
    subject : Subject
        The calibrated person.
    angles : (18,) array
        Joint angles of the rest of the body.
    place : Place
        Where the hand is held while tracking.
    redrawn : int
        Number of persons drawn before, who could not reach the points of the protocol.
    """

    number: int
    seed: int
    abilities: dict[str, Ability]
    protocol: Protocol
    subject: Subject
    angles: Array
    place: Place
    redrawn: int = 0

    def arm_loop(
        self, *, seconds: float, rate: float, seed: Any, **more: Any
    ) -> ArmLoop:
        """Return arm, cameras and map of this person, for a duration in seconds.

        `more` is passed to :class:`ArmLoop`; by default noise and gaps are those of the
        calibration.
        """
        for key in ("marker_noise", "occluded"):
            more.setdefault(key, self.protocol.settings[key])
        arm = ArmKinematics(self.protocol.subject.skeleton, self.protocol.side)
        return ArmLoop(
            arm,
            self.angles,
            self.place,
            self.subject,
            frames=round(seconds * rate) + 1,
            rate=rate,
            seed=np.random.default_rng(seed),
            skin=self.protocol.skin,
            **more,
        )


def draw_participant(
    number: int,
    *,
    seed: int,
    soft_tissue: float = 3e-3,
    latency: float = 0.05,
    other_methods: bool = True,
    **protocol: Any,
) -> Participant:
    """Draw a person, simulate the protocol, and calibrate.

    Anthropometry is sampled from ANSUR II, ability from ``parameters.toml``. A person
    who cannot reach the points of the protocol is replaced by another one; the same
    number and seed of the cohort give the same person.

    Parameters
    ----------
    soft_tissue : float
        Displacement of markers over bones, m, root mean square.
    latency : float
        See :func:`ikns.simulation.operator.sample_abilities`, s.
    other_methods : bool
        See :func:`ikns.calibrate`: experiments use the paper's map alone.
    **protocol
        Passed to :func:`ikns.simulate_protocol`. Free exploration, which calibration
        does not use, is left out by default.

    Raises
    ------
    InvalidInput
        When no one of 20 persons drawn can do the protocol.
    NotEnoughData
        When the calibration fails, as it does with too little time at the points.
    """
    reason: InvalidInput | None = None
    for attempt in range(_TRIES):
        drawn = np.random.SeedSequence([seed, number, attempt]).generate_state(2)
        body_seed, trial_seed = (int(word) for word in drawn)
        try:
            person = virtual_subject(body_seed)
            run = simulate_protocol(
                person,
                seed=trial_seed,
                soft_tissue=soft_tissue,
                **({"free_seconds": 0.1} | protocol),
            )
            angles, place = tracking_place(run)
        except InvalidInput as error:
            reason = error
            continue
        adult = person.adult
        subject = calibrate(
            run.static.recording,
            [run.points.recording],
            generic=Skeleton.from_anthropometry(
                adult.stature_m, adult.mass_kg, adult.sex
            ),
            chain=f"{run.side}_arm",
            n_points=len(run.places),
            other_methods=other_methods,
        )
        abilities = {
            name: sample_abilities(
                number + 1, seed=seed, condition=name, latency=latency
            )[number]
            for name in CONDITIONS
        }
        return Participant(
            number, seed, abilities, run, subject, angles, place, redrawn=attempt
        )
    raise InvalidInput(f"none of {_TRIES} people can do the protocol: {reason}")


def tracking_place(
    protocol: Protocol, position: Array | None = None
) -> tuple[Array, Place]:
    """Find a hand pose to hold, with the habits that the person had in calibration.

    At a position in the thorax frame, by default the middle of the points, of a
    protocol with one exploring arm: joint angles of the rest of the body (18,), and the
    place.
    """
    arm = ArmKinematics(protocol.subject.skeleton, protocol.side)
    truth, point = protocol.points.truth, protocol.points.point
    where = protocol.places.mean(axis=0) if position is None else np.array(position)
    rows = [np.flatnonzero(point == k) for k in range(len(protocol.places))]
    first = np.array([row[0] for row in rows])  # at rest, in the comfortable posture
    angles = truth.angles[first].mean(axis=0)
    postures = truth.angles[first][:, arm.columns]
    rest = np.array(
        [p[:2] - girdle(p, np.zeros(2), follow=GIRDLE_FOLLOW) for p in postures]
    ).mean(axis=0)
    wrist = postures[:, 6:].mean(axis=0)
    if protocol.habits is None:
        swivel = float(protocol.points.swivel[first].mean())
    else:
        swivel = natural_swivel(
            arm, angles, where, wrist=wrist, habits=protocol.habits, girdle_rest=rest
        )
    half = float(np.mean([np.ptp(protocol.points.swivel[row]) for row in rows])) / 2
    place = widest_place(
        arm,
        angles,
        where,
        swivel=swivel,
        wrist=wrist,
        girdle_rest=rest,
        lowest=swivel - half,
        highest=swivel + half,
        remedy="choose another place",
    )
    return angles, place
