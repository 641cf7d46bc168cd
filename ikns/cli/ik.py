"""``ikns ik``: joint angles over time from a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import ikns
from ikns.cli.options import AsJson, Force, RecordingFile, SubjectFolder
from ikns.cli.output import (
    finite_median,
    progress,
    refuse_overwriting,
    show,
    table,
    write_csv,
)
from ikns.errors import naming

__all__ = ["ik"]

_THORAX = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")


def ik(
    recording: RecordingFile,
    subject: SubjectFolder,
    out: Annotated[Path, typer.Option(help="CSV file to write.")] = Path("motion.csv"),
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write joint angles (deg), the pose of the thorax and residuals per frame.

    Cells of a joint are empty in frames in which a segment next to it is out of sight,
    cells of the thorax in frames that do not show it.
    """
    import numpy as np

    refuse_overwriting(out, force=force)
    skeleton = ikns.Subject.load(subject).skeleton
    frames = ikns.read(recording)
    with progress() as report, naming(frames.source):
        motion = ikns.MarkerIK(skeleton).track(
            frames, progress=lambda done, total: report("joint angles", done, total)
        )
    degrees = np.degrees(motion.angles)
    write_csv(
        out,
        [
            "time_s",
            *(f"{joint}_deg" for joint in motion.joint_names),
            *(f"thorax_{part}" for part in _THORAX),
            "residual_m",
            "converged",
        ],
        np.column_stack(
            [
                motion.time,
                degrees,
                motion.thorax_in_world,
                motion.residual,
                motion.converged,
            ]
        ),
    )
    median = finite_median(motion.residual)
    converged = int(motion.converged.sum())
    lowest, highest = np.fmin.reduce(degrees), np.fmax.reduce(degrees)
    span = highest - lowest
    show(
        {
            "recording": recording,
            "csv": out,
            "frames": len(motion.time),
            "frames_converged": converged,
            "frames_without_markers": int(np.isnan(motion.residual).sum()),
            "residual_median_m": median,
            "held_joints": motion.held,
            "moved_deg": dict(zip(motion.joint_names, span, strict=True)),
        },
        f"{recording}: {converged} of {len(motion.time)} frames solved, "
        f"median marker residual {1000 * median:.1f} mm",
        table(
            "Joint angles",
            {"joint": "s", "lowest deg": ".1f", "highest deg": ".1f", "note": "s"},
            [
                [
                    name,
                    low,
                    high,
                    "held: no marker shows it"
                    if name in motion.held
                    else "never in sight" * bool(np.isnan(low)),
                ]
                for name, low, high in zip(
                    motion.joint_names, lowest.tolist(), highest.tolist(), strict=True
                )
            ],
        ),
        f"Wrote {out}",
        as_json=as_json,
    )
