"""One row a PCA point: what was learned there against what the Jacobian says."""

from __future__ import annotations

import warnings
from typing import Any, Literal

import ikns
from ikns.cli.output import table
from ikns.errors import naming


def comparison_rows(
    subject: ikns.Subject,
    motion: ikns.Motion,
    *,
    source: str,
    task: Literal["pose", "position"] = "pose",
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return one row a PCA point, and what the analytic map warns of.

    Where the recording has no still sample near a point, its row says just that.
    """
    import numpy as np

    from ikns.analysis.compare import compare_visited
    from ikns.nullspace.map import MapWarning

    with naming(source), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        visited = compare_visited(
            subject.null_space_map,
            subject.skeleton,
            motion,
            chain=subject.chain,
            task=task,
            **subject.gate,
        )
    found = visited.comparison
    rows: list[dict[str, Any]] = [
        {"point": k + 1, "samples": int(count)}
        for k, count in enumerate(visited.counts)
    ]
    for i, k in enumerate(visited.points):
        rows[k] |= {
            "angle_deg": np.degrees(found.angles[i]).tolist(),
            "inside": float(found.inside[i]),
            "learned_leak_m": float(found.learned_leak[i]),
            "learned_leak_corrected_m": float(found.learned_leak_corrected[i]),
            "learned_leak_interval_m": found.learned_leak_interval[i].tolist(),
            "analytic_leak_m": float(found.analytic_leak[i]),
            "agreement": float(found.agreement[i]),
            "learned_direction": visited.learned.directions_[i].tolist(),
            "analytic_direction": visited.analytic.directions_[i].tolist(),
        }
    return rows, [
        f"the analytic map, which c is not read from: {warning.message}"
        for warning in caught
    ]


def comparison_table(rows: list[dict[str, Any]], title: str) -> Any:
    """Return the rows as a table for people."""
    nan = float("nan")
    return table(
        title,
        {
            "point": "d",
            "still\nsamples": "d",
            "angle\ndeg": ".1f",
            "% variance\nalong analytic": ".1f",
            "leak mm/c\nlearned": ".1f",
            "without\nnoise": ".1f",
            "leak mm/c\nanalytic": ".1f",
            "r of\nboth c": ".3f",
        },
        [
            [
                row["point"],
                row["samples"],
                max(row.get("angle_deg", [nan])),
                100 * row.get("inside", nan),
                1000 * row.get("learned_leak_m", nan),
                1000 * row.get("learned_leak_corrected_m", nan),
                1000 * row.get("analytic_leak_m", nan),
                row.get("agreement", nan),
            ]
            for row in rows
        ],
    )
