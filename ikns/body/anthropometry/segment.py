"""Mass, center of mass and inertia of the segments of the upper body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ikns.arrays import Array
from ikns.body.anthropometry.lengths import (
    LIMB_SEGMENTS,
    expected_lengths,
    stature_fraction,
)
from ikns.body.anthropometry.measures import checked_measure
from ikns.body.anthropometry.shoulder import shoulder_joints
from ikns.body.anthropometry.tables import normalize_sex, row
from ikns.errors import InvalidInput


@dataclass(frozen=True)
class Segment:
    """A rigid part of the body.

    Parameters
    ----------
    name : str
        Name of the segment; limbs are the same on either side.
    length_m : float
        Distance between the two landmarks along the long axis, meters.
    mass_kg : float
        Kilograms.
    com_m : float
        Distance of the center of mass from the proximal landmark along the long axis,
        meters. Of `trunk_head` it lies that far *below* suprasternale.
    inertia_kg_m2 : tuple of 3 float
        Principal moments about the center of mass: about the front-back axis, the
        segment's own long axis, and the axis across both, kg m^2. For all but the
        clavicle that is X, Y, Z of the thorax axes (forward, up, right) of a person
        who stands with hanging arms and the palms forward; the clavicle's long axis
        points sideways, so its third axis is vertical.
    proximal, distal : str
        Landmarks between which `length_m` runs.
    source : str
        Where the numbers come from.
    """

    name: str
    length_m: float
    mass_kg: float
    com_m: float
    inertia_kg_m2: tuple[float, float, float]
    proximal: str
    distal: str
    source: str


def segments(
    stature: float, mass: float, sex: str, *, lengths: Mapping[str, float] | None = None
) -> dict[str, Segment]:
    """Segments of the upper body of a person.

    Masses, centers of mass and radii of gyration are de Leva's fractions. His columns
    are named after axes: the sagittal radius is about the front-back axis (largest for
    trunk and flat hand, which are wider than deep), the transverse radius about the
    side-to-side axis (largest for the head, which is deeper than wide).

    `trunk_head` is his trunk and head as one body, without the two shoulder girdles:
    these move with the clavicles and have a small mass, so that at rest the total has
    de Leva's mass, center of mass and inertia. The girdle's front-back position and the
    tilt of its long axis are neglected.

    Parameters
    ----------
    stature : float
        Meters.
    mass : float
        Kilograms, whole body.
    sex : str
        "female" or "male".
    lengths : mapping of str to float, optional
        Known lengths in meters, of any of `clavicle`, `upper_arm`, `forearm`, `hand`;
        centers of mass and radii of gyration scale with them, masses do not.

    Returns
    -------
    dict of Segment
        `trunk_head`, and for each side `clavicle` (sternoclavicular joint to shoulder
        joint center), `upper_arm`, `forearm` and `hand` (wrist joint center to third
        metacarpale).

    Raises
    ------
    InvalidInput
        When stature or mass is not an adult's in meters and kilograms, the sex is
        unknown, or a given length is of an unknown segment or not half to twice the
        expected one.

    Examples
    --------
    >>> arm = segments(1.741, 73.0, "male")["upper_arm"]
    >>> round(arm.length_m, 4), round(arm.mass_kg, 2), round(arm.com_m, 4)
    (0.2817, 1.98, 0.1626)
    """
    height = checked_measure("stature", stature).item()
    weight = checked_measure("mass", mass).item()
    sex = normalize_sex(sex)
    length = _limb_lengths(height, sex, lengths or {})
    girdle = _segment("clavicle", "shoulder", "girdle", length["clavicle"], weight, sex)
    limbs = {
        name: _segment(name, "de_leva", name, length[name], weight, sex)
        for name in LIMB_SEGMENTS[1:]
    }
    trunk_head = _trunk_head(height, weight, sex, girdle)
    return {"trunk_head": trunk_head, "clavicle": girdle} | limbs


def _limb_lengths(
    stature: float, sex: str, known: Mapping[str, float]
) -> dict[str, float]:
    expected = expected_lengths(stature, sex)
    for name, value in known.items():
        if name not in expected:
            raise InvalidInput(
                f"lengths names {name!r}, expected any of {', '.join(expected)}."
            )
        if not expected[name] / 2 <= value <= expected[name] * 2:  # also when NaN
            raise InvalidInput(
                f"lengths gives {value:g} m for the {name}, expected about "
                f"{expected[name]:.3f} m; did you give millimeters?"
            )
    return expected | {name: float(value) for name, value in known.items()}


def _segment(
    name: str, table_name: str, row_name: str, length: float, mass: float, sex: str
) -> Segment:
    entry = row(table_name, row_name, sex=sex)
    if table_name == "de_leva":
        sagittal, transverse, longitudinal = entry["gyration"]
        radii = (sagittal, longitudinal, transverse)
    else:
        radii = tuple(entry["gyration"])
    own = mass * entry["mass"]
    front_back, long, across = (own * (radius * length) ** 2 for radius in radii)
    return Segment(
        name=name,
        length_m=length,
        mass_kg=own,
        com_m=length * entry["com"],
        inertia_kg_m2=(front_back, long, across),
        proximal=entry["proximal"],
        distal=entry["distal"],
        source=entry["source"],
    )


def _trunk_head(stature: float, mass: float, sex: str, girdle: Segment) -> Segment:
    """Trunk and head as one body, less the two girdles, seen from suprasternale."""
    trunk, head = (
        _segment(
            name, "de_leva", name, stature_fraction(name, sex) * stature, mass, sex
        )
        for name in ("trunk", "head_cervicale")
    )
    cervicale_up = stature * (
        stature_fraction("trunk_cervicale", sex) - stature_fraction("trunk", sex)
    )
    joints = shoulder_joints(stature, sex)
    reach = joints["glenohumeral"] - joints["sternoclavicular"]
    toward = reach * (girdle.com_m / np.linalg.norm(reach))
    _, girdle_up, girdle_side = joints["sternoclavicular"] + toward
    front_back, long, vertical = girdle.inertia_kg_m2
    one_girdle = np.array([front_back, vertical, long])
    one_girdle += girdle.mass_kg * np.array([girdle_side**2, girdle_side**2, 0.0])
    total, up, inertia = _combine(
        [
            (trunk.mass_kg, -trunk.com_m, np.array(trunk.inertia_kg_m2)),
            (
                head.mass_kg,
                cervicale_up + head.length_m - head.com_m,
                np.array(head.inertia_kg_m2),
            ),
            (-2 * girdle.mass_kg, girdle_up, -2 * one_girdle),
        ]
    )
    return Segment(
        name="trunk_head",
        length_m=trunk.length_m,
        mass_kg=total,
        com_m=float(-up),
        inertia_kg_m2=(float(inertia[0]), float(inertia[1]), float(inertia[2])),
        proximal=trunk.proximal,
        distal=trunk.distal,
        source=f"{trunk.source}; girdles: {girdle.source}",
    )


def _combine(parts: list[tuple[float, float, Array]]) -> tuple[float, float, Array]:
    """Combine bodies with centers on one vertical; a negative mass is subtracted."""
    total = sum(mass for mass, _, _ in parts)
    up = sum(mass * height for mass, height, _ in parts) / total
    inertia = np.zeros(3)
    for mass, height, own in parts:
        inertia += own + mass * (height - up) ** 2 * np.array([1.0, 0.0, 1.0])
    return total, up, inertia
