"""How long, how heavy and how varied people are: published tables and what follows.

The tables are data (``*.toml`` beside this file). Every row names its landmarks, its
source and how sure we are of it, because one word, such as "upper arm", names lengths
that differ by 18 %: acromion to radiale on the skin, or shoulder to elbow joint center.
All results are SI; the segments run from joint center to joint center.
"""

from ikns.body.anthropometry.lengths import (
    LIMB_SEGMENTS,
    expected_lengths,
    length_uncertainty,
)
from ikns.body.anthropometry.population import Adult, sample_adults
from ikns.body.anthropometry.segment import Segment, segments
from ikns.body.anthropometry.shoulder import shoulder_joints
from ikns.body.anthropometry.tables import SEXES, TABLES, normalize_sex, row, table

__all__ = [
    "LIMB_SEGMENTS",
    "SEXES",
    "TABLES",
    "Adult",
    "Segment",
    "expected_lengths",
    "length_uncertainty",
    "normalize_sex",
    "row",
    "sample_adults",
    "segments",
    "shoulder_joints",
    "table",
]
