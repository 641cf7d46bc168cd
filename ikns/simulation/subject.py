"""A virtual subject: a simulated person with exactly known bones and markers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.body.anthropometry import Adult, sample_adults, segments
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton

#: Spread of thorax size between people of one stature, relative (our estimate).
_THORAX_SD = 0.04
#: Spread of a segment's length between the sides of one person, relative (our
#: estimate).
_SIDE_SD = 0.01
#: A marker with a larger spread of placement, m, is technical: it sits on soft tissue
#: somewhere along the segment, not on a palpated landmark.
_TECHNICAL = 0.012


@dataclass(frozen=True)
class VirtualSubject:
    """A simulated person, drawn from a seed.

    `skeleton` is the true body with the true markers, static-only ones included;
    `adult` has sex, stature, mass and lengths as drawn from the population.
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
    """Draw a simulated adult who wears markers.

    Segment lengths are those of a sampled adult (ANSUR II), with random differences of
    the thorax and between the sides. Each marker is displaced from its nominal position
    by a normal error per axis.

    Parameters
    ----------
    seed : int
        The same seed gives the same person.
    marker_set : str or path
        Name or file of the marker set.
    sex : {"female", "male"}, optional
        Default: either.
    palpation_sd : float
        Placement error on bony landmarks, m per axis. 2 mm is an assumption, for a
        trained examiner and landmarks right under the skin. Under thick tissue, spreads
        of 15 to 20 mm are published (trochanter; review by Della Croce et al. 2005,
        Gait & Posture 21:226).
    technical_sd : float
        Placement error of technical markers, m per axis (assumption).

    Examples
    --------
    >>> from ikns import virtual_subject
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
