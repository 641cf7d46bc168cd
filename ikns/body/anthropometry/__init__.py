"""Anthropometry: lengths, masses and their variation, from published tables.

The tables are data (``*.toml`` in this folder). Every row states its landmarks, source
and reliability, because one name, such as "upper arm", is used for lengths that differ
by 18 %: acromion to radiale on the skin, or shoulder to elbow joint center. All results
are SI; segments run from joint center to joint center.
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
