"""Virtual participants of a study: drawn, and calibrated with its parameters."""

from __future__ import annotations

import dataclasses

import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.experiments.study.design import Parameters
from ikns.recording.recording import Recording
from ikns.simulation.operator import Participant, draw_participant
from ikns.simulation.protocol import Protocol

#: Parameters that change what is made of the recordings, not the recordings.
_OF_CALIBRATION = ("max_hand_speed", "layout", "outside", "interpolation")


def study_participant(
    number: int, *, seed: int, parameters: Parameters, other_methods: bool = True
) -> Participant:
    """Draw a participant and calibrate it with the parameters.

    Without `other_methods` only the paper's map is learned, which the experiments use.

    The same number and seed give the same body, ability, habits and noise for all
    parameters, with one exception: where the number of points decides whether a person
    can do the protocol, another person may be drawn, and `redrawn` differs.

    Raises
    ------
    InvalidInput
        When no one of 20 persons drawn can do the protocol.
    NotEnoughData
        When the calibration fails.
    """
    person = draw_participant(
        number,
        seed=seed,
        soft_tissue=parameters.soft_tissue,
        latency=parameters.latency,
        n_points=parameters.n_points,
        point_seconds=parameters.point_seconds,
        marker_noise=parameters.marker_noise,
        occluded=parameters.occluded,
        rate=parameters.rate,
        other_methods=other_methods,
    )
    return recalibrated(person, parameters)


def recalibrated(person: Participant, parameters: Parameters) -> Participant:
    """Return the participant with a map learned with other calibration parameters.

    Raises
    ------
    NotEnoughData
        When the calibration fails.
    """
    usual = Parameters()
    if all(getattr(parameters, k) == getattr(usual, k) for k in _OF_CALIBRATION):
        return person
    return dataclasses.replace(person, subject=_calibrated(person.protocol, parameters))


def _calibrated(protocol: Protocol, parameters: Parameters) -> Subject:
    """Calibrate again from the same recordings."""
    adult, points = protocol.subject.adult, parameters.points
    recordings = [protocol.points.recording]
    if len(points) < len(protocol.places):
        recordings = [_at_point(protocol, k) for k in points]
    return calibrate(
        protocol.static.recording,
        recordings,
        generic=Skeleton.from_anthropometry(adult.stature_m, adult.mass_kg, adult.sex),
        chain=f"{protocol.side}_arm",
        n_points=len(points),
        max_hand_speed=parameters.max_hand_speed,
        outside=parameters.outside,  # type: ignore[arg-type]
        interpolation=parameters.interpolation,  # type: ignore[arg-type]
    )


def _at_point(protocol: Protocol, point: int) -> Recording:
    """Cut out the samples at one point."""
    rows = np.flatnonzero(protocol.points.point == point)
    whole = protocol.points.recording
    return Recording(
        whole.time[rows],
        whole.markers[rows],
        whole.labels,
        f"{whole.source}, point {point + 1}",
    )
