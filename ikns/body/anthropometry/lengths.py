"""Distances between joint centers given stature, and their spread among people."""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.anthropometry.measures import checked_measure, expected_measure
from ikns.body.anthropometry.shoulder import clavicle_length, shoulder_joints
from ikns.body.anthropometry.tables import row, subjects

#: Segments of each side, from the sternum to the hand.
LIMB_SEGMENTS = ("clavicle", "upper_arm", "forearm", "hand")

#: Surface measure that predicts a segment's length among people of one stature.
SURFACE_MEASURES = {
    "clavicle": "biacromial_breadth",
    "upper_arm": "acromion_radiale",
    "forearm": "radiale_stylion",
    "hand": "hand_length",
}


def expected_lengths(stature: float, sex: str) -> dict[str, float]:
    """Mean lengths of the limb segments of people of a stature.

    Upper arm, forearm and hand are the same fractions of stature as in the subjects of
    de Leva 1996; the clavicle follows from ANSUR II (see :func:`shoulder_joints`).

    Parameters
    ----------
    stature : float
        Meters.
    sex : str
        "female" or "male".

    Returns
    -------
    dict of float
        Meters for each of :data:`LIMB_SEGMENTS`; the hand ends at the third
        metacarpale.

    Raises
    ------
    InvalidInput
        When the sex is unknown or the stature is not that of an adult in meters.

    Examples
    --------
    >>> {k: round(v, 3) for k, v in expected_lengths(1.741, "male").items()}
    {'clavicle': 0.158, 'upper_arm': 0.282, 'forearm': 0.269, 'hand': 0.086}
    """
    height = checked_measure("stature", stature)
    arm = {
        name: float(stature_fraction(name, sex) * height)
        for name in LIMB_SEGMENTS
        if name != "clavicle"
    }
    return {"clavicle": float(clavicle_length(height, sex))} | arm


def length_uncertainty(sex: str) -> dict[str, float]:
    """Spread of the limb segments among people of one (average) stature.

    The standard error of estimate of the surface measure in ANSUR II, scaled to the
    segment; for the clavicle together with the uncertainty of the offset from acromion
    to joint center. How well a surface measure represents a distance of joint centers
    is not included, as no table states it, so these are lower bounds.

    Parameters
    ----------
    sex : str
        "female" or "male".

    Returns
    -------
    dict of float
        Standard deviations in meters for each of :data:`LIMB_SEGMENTS`.

    Raises
    ------
    InvalidInput
        When the sex is unknown.

    Examples
    --------
    >>> {k: round(1000 * v, 1) for k, v in length_uncertainty("male").items()}
    {'clavicle': 10.0, 'upper_arm': 9.0, 'forearm': 10.9, 'hand': 3.3}
    """
    height = row("ansur2", "stature", sex=sex)["mean_mm"] / 1000
    length = expected_lengths(height, sex)
    spread = {}
    for name, measure_name in SURFACE_MEASURES.items():
        measure = row("ansur2", measure_name, sex=sex)
        spread[name] = length[name] * measure["see_mm"] / measure["mean_mm"]
    joints = shoulder_joints(height, sex)
    reach = joints["glenohumeral"] - joints["sternoclavicular"]
    half_breadth = row("ansur2", "biacromial_breadth", sex=sex)["see_mm"] / 2000
    offset = row("shoulder", "acromion_to_glenohumeral", sex=sex)["sd"] * height
    lateral_share = float(reach[2] / np.linalg.norm(reach))
    spread["clavicle"] = lateral_share * hypot(half_breadth, offset)
    return spread


def person_length(name: str, stature: ArrayLike, surface: ArrayLike, sex: str) -> Array:
    """Length of a limb segment of a person whose surface measure is known, meters.

    ``expected length(stature) * surface / expected surface(stature)``: the ratio to the
    mean of people of the same stature is that of the measure which
    :data:`SURFACE_MEASURES` names. The clavicle follows from the biacromial breadth
    directly. Arguments are numbers or (N,) arrays.
    """
    if name == "clavicle":
        return clavicle_length(stature, sex, biacromial=surface)
    height = np.asarray(stature, dtype=np.float64)
    share = np.asarray(surface) / expected_measure(SURFACE_MEASURES[name], height, sex)
    return stature_fraction(name, sex) * height * share


def stature_fraction(row_name: str, sex: str) -> float:
    """Mean length of a de Leva row over the mean stature of its subjects."""
    length = row("de_leva", row_name, sex=sex)["length_mm"]
    return float(length / subjects("de_leva", sex=sex)["stature_mm"])
