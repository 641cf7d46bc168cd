"""What ``ikns compare`` found, as JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ikns.analysis.compare import Crosstalk, NullSpaceComparison

#: A comparison with the names of its chain, task and coordinates.
Named = tuple[tuple[str, str, str], "NullSpaceComparison"]


def findings_json(found: NullSpaceComparison, **about: Any) -> dict[str, Any]:
    """Return all numbers of a comparison; angles in deg, everything else in SI."""
    import numpy as np

    def degrees(values: Any) -> Any:
        return np.degrees(values).tolist()

    points = [
        {
            "point": int(found.points[i]) + 1,
            "samples": int(found.counts[i]),
            "angles_deg": degrees(found.angles[i]),
            "angle_corrected_deg": degrees(found.angle_corrected[i]),
            "angle_interval_deg": degrees(found.angle_interval[i]),
            "mean_posture_angles_deg": degrees(found.mean_posture_angles[i]),
            "mean_posture_interval_deg": degrees(found.mean_posture_interval[i]),
            "concentration": found.concentration[i],
            "inside": found.inside[i],
            "inside_interval": found.inside_interval[i],
            "inside_mean_posture": found.inside_mean_posture[i],
            "inside_chance_median_and_95": found.inside_chance[i],
            "leak_m": found.leak[i],
            "leak_corrected_m": found.leak_corrected[i],
            "leak_interval_m": found.leak_interval[i],
            "turn_deg": degrees(found.turn[i]),
            "turn_corrected_deg": degrees(found.turn_corrected[i]),
            "turn_interval_deg": degrees(found.turn_interval[i]),
            "kinematic_leak_m": found.kinematic_leak[i],
            "kinematic_turn_deg": degrees(found.kinematic_turn[i]),
            "curvature_deg": degrees(found.curvature[i]),
            "straight_leak_m": found.straight_leak[i],
            "straight_turn_deg": degrees(found.straight_turn[i]),
            "agreement": found.agreement[i],
            "agreement_interval": found.agreement_interval[i],
            "direction": found.directions[i],
            "null_directions": found.null_directions[i],
        }
        for i in range(len(found.points))
    ]
    pooled: dict[str, Any] = {}
    for name, values in found.pooled.items():
        kind = name.removesuffix("_corrected")
        angle = kind.endswith(("angle", "turn", "curvature"))
        unit = "_deg" if angle else "_m" if kind.endswith("leak") else ""
        value, low, high = degrees(values) if angle else values
        pooled[name + unit] = {"value": value, "interval": [low, high]}
    return about | {
        "null_space_dimensions": found.null_dim,
        "chance_angles_deg": {
            "one_in_twenty_below": degrees(found.chance_angles[0]),
            "median": degrees(found.chance_angles[1]),
        },
        "points": points,
        "pooled": pooled,
    }


def crosstalk_json(found: Crosstalk, **about: Any) -> dict[str, Any]:
    """Return all numbers of the reaches."""
    return about | {
        "reaches": len(found.change),
        "mean_change": found.mean_change,
        "mean_change_interval": found.mean_change_interval,
        "per_meter": found.per_meter,
        "per_meter_interval": found.per_meter_interval,
        "largest_excursion": found.largest,
        "changes": found.change,
        "distances_m": found.distance,
        "excursions": found.excursion,
    }


def found_json(
    found: list[Named], across: Crosstalk | None, *, recording: Path
) -> dict[str, Any]:
    """Return all comparisons, and the crosstalk on a recording if it is known."""
    return {
        "comparisons": [
            findings_json(each, chain=names[0], task=names[1], coordinates=names[2])
            for names, each in found
        ],
        "crosstalk": None
        if across is None
        else crosstalk_json(across, recording=recording),
    }
