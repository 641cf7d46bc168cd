"""``ikns ik``: joint angles over time from a recording."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import ikns
from ikns.cli.options import AsJson, Force, RecordingFile, SubjectFolder
from ikns.cli.output import progress, show, table
from ikns.cli.reading import Read, reads_markers
from ikns.errors import naming
from ikns.output.file import refuse_overwriting, write_csv


@reads_markers
def ik(
    read: Read,
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
    from ikns.motion.table import motion_table

    refuse_overwriting(out, force=force, inputs=[recording, subject])
    skeleton = ikns.Subject.load(subject).skeleton
    frames = read(recording)
    with progress() as report, naming(frames.source):
        motion = ikns.MarkerIK(skeleton).track(
            frames, progress=lambda done, total: report("joint angles", done, total)
        )
    found = motion_table(motion)
    write_csv(out, found.columns, found.rows, force=force)
    summary = found.summary
    show(
        {"recording": recording, "csv": out} | summary,
        f"{recording}: {summary['frames_converged']} of {summary['frames']} frames "
        f"solved, median marker residual {1000 * summary['residual_median_m']:.1f} mm",
        table(
            "Joint angles",
            {"joint": "s", "lowest deg": ".1f", "highest deg": ".1f", "note": "s"},
            [
                [name, low, high, _note(name, low, motion.held)]
                for name, (low, high) in found.range_deg.items()
            ],
        ),
        f"Wrote {out}",
        as_json=as_json,
    )


def _note(joint: str, lowest: float, held: tuple[str, ...]) -> str:
    if joint in held:
        return "held: no marker shows it"
    return "never in sight" if math.isnan(lowest) else ""
