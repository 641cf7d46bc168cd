"""One virtual subject for tests of everything above a map: short trials at 50 Hz."""

from functools import cache
from pathlib import Path

import numpy as np

from ikns.body.chains import chain_joints
from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.files import write_c3d
from ikns.recording.recording import Recording
from ikns.simulation import (
    Protocol,
    VirtualSubject,
    simulate_protocol,
    virtual_subject,
)

#: Nothing above a map needs a natural posture, and drawing one takes a second: the
#: people of these tests hold one posture everywhere.
TAME = {"habits": None}


@cache
def protocol() -> Protocol:
    """Ten points for 1.5 s each, 1 mm of marker noise, 3 % occluded."""
    return simulate_protocol(
        virtual_subject(1),
        seed=1,
        static_seconds=1.2,
        free_seconds=1.0,
        point_seconds=1.5,
        rate=50,
        **TAME,
    )


@cache
def two_handed() -> Protocol:
    """Both hands hold a box at ten points, each elbow moves in its own rhythm."""
    return simulate_protocol(
        virtual_subject(2),
        seed=2,
        side="both",
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=2.0,
        rate=50,
        **TAME,
    )


@cache
def subject() -> Subject:
    """The person as calibrated from the recordings."""
    return calibrate(protocol().static.recording, [protocol().points.recording])


def on_another_day(person: VirtualSubject) -> Protocol:
    """Six seconds of ordinary movement, and three places to judge by."""
    return simulate_protocol(
        person,
        seed=8,
        n_points=3,
        static_seconds=1.2,
        free_seconds=6.0,
        point_seconds=2.0,
        rate=50,
        occluded=0.0,
    )


@cache
def another_day() -> Protocol:
    """The person of `protocol` on another day."""
    return on_another_day(protocol().subject)


@cache
def known_by_movement() -> Subject:
    """The person as calibrated with the ordinary movement of another day."""
    return calibrate(
        protocol().static.recording,
        [protocol().points.recording],
        natural=[another_day().free.recording],
    )


@cache
def two_freedoms() -> Subject:
    """The person with a second output, forearm pronation, in a map by hand.

    Half a radian to either side of where the forearm was at each place: there noise of
    a millimeter leaves c_2 certain.
    """
    one, joint = subject(), chain_joints("right_arm").index("right_forearm_pronation")
    learned = one.null_space_map
    middle = learned.cluster_means_[:, joint]
    turn = np.tile(np.eye(7)[joint], (len(middle), 1))
    made = NullSpaceMap.from_arrays(
        learned.centers_,
        np.stack([learned.directions_[:, 0], turn], axis=1),
        np.column_stack([learned.lower_[:, 0], middle - 0.5]),
        np.column_stack([learned.upper_[:, 0], middle + 0.5]),
    )
    return Subject(one.skeleton, made, one.chain, one.report)


def write(folder: Path, name: str, recording: Recording) -> Path:
    """Write a recording into a folder as C3D."""
    path = folder / f"{name}.c3d"
    write_c3d(path, recording)
    return path


def cut(recording: Recording, start: int, stop: int) -> Recording:
    """Frames from `start` to before `stop`."""
    rows = slice(start, stop)
    return Recording(
        recording.time[rows] - recording.time[start],
        recording.markers[rows],
        recording.labels,
        recording.source,
    )
