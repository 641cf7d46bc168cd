"""Virtual participants of a study: drawn, and calibrated with its parameters."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.experiments.study.design import Parameters
from ikns.nullspace.interpolation import NaturalNeighborInterpolator
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.map.interpolator import NearestPoint
from ikns.recording.recording import Recording
from ikns.simulation.operator import Participant, draw_participant
from ikns.simulation.protocol import Protocol

__all__ = ["recalibrated", "study_participant"]

#: Parameters of the calibration, which do not change the recordings.
_OF_CALIBRATION = ("max_hand_speed", "layout", "outside")


def study_participant(number: int, *, seed: int, parameters: Parameters) -> Participant:
    """Draw a participant and calibrate it with the parameters.

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
    if any(getattr(parameters, k) != getattr(usual, k) for k in _OF_CALIBRATION):
        subject = _calibrated(person.protocol, parameters)
        person = dataclasses.replace(person, subject=subject)
    if parameters.interpolation != "natural":
        learned = _with_interpolation(
            person.subject.null_space_map,
            parameters.interpolation,
            outside=parameters.outside,
        )
        subject = dataclasses.replace(person.subject, null_space_map=learned)
        person = dataclasses.replace(person, subject=subject)
    return person


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


def _with_interpolation(
    learned: NullSpaceMap, method: str, *, outside: str
) -> NullSpaceMap:
    """Return the map with another interpolation between its points."""
    changed = copy.copy(learned)
    changed.interpolator_ = (
        NearestPoint(learned.centers_)
        if method == "nearest"
        else NaturalNeighborInterpolator(
            learned.centers_,
            outside=outside,  # type: ignore[arg-type]
            method=method,  # type: ignore[arg-type]
        )
    )
    return changed
