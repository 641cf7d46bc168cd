"""A virtual subject: a simulated person whose bones and markers are known exactly."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.body.anthropometry import Adult, sample_adults, segments
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton

__all__ = ["VirtualSubject", "virtual_subject"]

#: Spread of thorax size among people of one stature (our estimate).
_THORAX_SD = 0.04
#: Left against right segment in one person (our estimate).
_SIDE_SD = 0.01
#: A marker whose site people meet less exactly than this is technical: it sits on soft
#: tissue somewhere along the segment, and is not palpated.
_TECHNICAL = 0.012


@dataclass(frozen=True)
class VirtualSubject:
    """A simulated person.

    Parameters
    ----------
    skeleton : Skeleton
        The true body, wearing the true markers, the static-only ones included.
    adult : Adult
        Sex, stature, mass and lengths as drawn from the population.
    marker_set : str
        Name of the marker set.
    seed : int
        What it was drawn from.
    """

    skeleton: Skeleton
    adult: Adult
    marker_set: str
    seed: int


def virtual_subject(
    seed: int,
    *,
    marker_set: str | Path = "oxford24",
    sex: str | None = None,
    palpation_sd: float = 2e-3,
    technical_sd: float = 10e-3,
) -> VirtualSubject:
    """Draw a simulated adult with markers on.

    Segment lengths are those of a sampled adult (ANSUR II), thorax and side differences
    added. Each marker sits off its nominal place by a normal error per axis.

    Parameters
    ----------
    seed : int
        Same seed, same person.
    marker_set : str or path
        What the person wears.
    sex : {"female", "male"}, optional
        Default: either.
    palpation_sd : float
        Placement error on bony landmarks, m per axis. 2 mm is an assumption: a trained
        examiner on landmarks right under the skin. Where tissue is thick, spreads of 15
        to 20 mm are published (trochanter; review by Della Croce et al. 2005, Gait &
        Posture 21:226).
    technical_sd : float
        Placement error of technical markers, m per axis (assumption).

    Returns
    -------
    VirtualSubject

    Examples
    --------
    >>> person = virtual_subject(3)
    >>> 0.2 < person.skeleton.segment_lengths["right_upper_arm"] < 0.35
    True
    """
    rng = np.random.default_rng(seed)
    adult = sample_adults(1, seed=rng, sex=sex)[0]
    parts = segments(adult.stature_m, adult.mass_kg, adult.sex, lengths=adult.lengths_m)
    average = Skeleton.load(marker_set=marker_set).proportioned(
        parts, stature=adult.stature_m
    )
    spread = {name: _SIDE_SD for name in SEGMENTS} | {"thorax": _THORAX_SD}
    body = average.resized(
        {name: float(np.exp(sd * rng.normal())) for name, sd in spread.items()}
    )
    worn = body.marker_set
    sd = np.array(
        [
            technical_sd if min(marker.placement_sd) > _TECHNICAL else palpation_sd
            for marker in worn.markers
        ]
    )
    places = body.marker_positions + sd[:, None] * rng.normal(size=(len(sd), 3))
    return VirtualSubject(
        skeleton=body.with_markers(worn.at(places)),
        adult=adult,
        marker_set=worn.name,
        seed=seed,
    )
