"""``ikns compare``: what was learned against what the Jacobian says."""

from __future__ import annotations

import warnings
from typing import Annotated, Any, Literal

import typer

import ikns
from ikns.cli.options import AsJson, RecordingFile, SubjectFolder
from ikns.cli.output import notes, progress, show, table
from ikns.errors import NotEnoughData, naming

__all__ = ["compare", "comparison_rows", "comparison_table"]


def compare(
    recording: RecordingFile,
    subject: SubjectFolder,
    task: Annotated[
        Literal["pose", "position"],
        typer.Option(
            help="What the hand holds: position and orientation, or position."
        ),
    ] = "pose",
    as_json: AsJson = False,
) -> None:
    """Compare learned and analytic directions at every PCA point."""
    from ikns.calibration import track_chain

    calibrated = ikns.Subject.load(subject)
    frames = ikns.read(recording)
    with progress() as report:
        motion = track_chain(
            calibrated.skeleton, frames, calibrated.chain, progress=report
        )
    rows, warned = comparison_rows(calibrated, motion, source=str(recording), task=task)
    show(
        {
            "recording": recording,
            "chain": calibrated.chain,
            "task": task,
            "points": rows,
            "warnings": warned,
        },
        comparison_table(rows, f"{recording}: learned against analytic, {task} held"),
        *notes(warned),
        as_json=as_json,
    )


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

    from ikns.clustering import nearest_center
    from ikns.nullspace_map import MapWarning

    learned, chain = subject.null_space_map, subject.chain
    with naming(source), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        x, _ = ikns.null_space_samples(motion, chain)
        near, _ = nearest_center(x, learned.centers_, radius=learned.radius_)
        counts = np.bincount(near[near >= 0], minlength=len(learned.centers_))
        # The analytic map needs samples at each of its points.
        visited = np.flatnonzero(counts > 0)
        if not visited.size:
            raise NotEnoughData("expected still samples near a PCA point, found none.")
        some = ikns.NullSpaceMap.from_arrays(
            learned.centers_[visited],
            learned.directions_[visited],
            learned.lower_[visited],
            learned.upper_[visited],
        )
        some.radius_ = learned.radius_
        analytic = ikns.analytic_map(
            subject.skeleton,
            motion,
            some.centers_,
            chain=chain,
            task=task,
            radius=learned.radius_,
            n_dof=learned.n_dof,
            reference=some.directions_.sum(axis=0),
        )
        found = ikns.compare(some, analytic, motion, chain=chain)
    rows: list[dict[str, Any]] = [
        {"point": k + 1, "samples": int(count)} for k, count in enumerate(counts)
    ]
    for i, k in enumerate(visited):
        rows[k] |= {
            "angle_deg": np.degrees(found.angles[i]).tolist(),
            "inside": float(found.inside[i]),
            "learned_leak_m": float(found.learned_leak[i]),
            "analytic_leak_m": float(found.analytic_leak[i]),
            "agreement": float(found.agreement[i]),
            "learned_direction": some.directions_[i].tolist(),
            "analytic_direction": analytic.directions_[i].tolist(),
        }
    return rows, [f"analytic map: {warning.message}" for warning in caught]


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
                1000 * row.get("analytic_leak_m", nan),
                row.get("agreement", nan),
            ]
            for row in rows
        ],
    )
