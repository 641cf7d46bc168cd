"""``ikns convert``: one file into another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ikns.cli.options import (
    MARKER_FILES,
    AsJson,
    ForceFile,
    From,
    LabelFile,
    Rename,
    SubjectPrefix,
    To,
)
from ikns.cli.output import show
from ikns.cli.reading import label_names, refuse_unused
from ikns.output.file import refuse_overwriting


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            help=f"Markers, {MARKER_FILES}; or joint angles, .mot, .sto or .csv."
        ),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            help="File to write: .c3d, .trc or .csv for markers, .mot, .sto or .csv "
            "for joint angles."
        ),
    ],
    subject_prefix: SubjectPrefix = None,
    rename: Rename = None,
    labels: LabelFile = None,
    from_: From = None,
    to: To = None,
    stream: Annotated[
        str | None,
        typer.Option(help="Name of the marker stream, if an .xdf file has several."),
    ] = None,
    force: ForceFile = False,
    as_json: AsJson = False,
) -> None:
    """Convert a recording or joint angles to another format, whole or in part.

    Times and labels are kept, except that --rename and --labels rename markers and
    --subject-prefix strips the prefix.
    """
    from ikns.recording.files.convert import convert_file

    refuse_overwriting(target, force=force, inputs=[source, labels])
    how = {"subject_prefix": subject_prefix, "stream": stream}
    refuse_unused(rename, [source], **how)
    found = convert_file(
        source,
        target,
        **how,
        start=from_,
        end=to,
        names=label_names(rename, labels),
        force=force,
    )
    lost = (
        f", without {found.left_out} frames in which a coordinate is missing"
        if found.left_out
        else ""
    )
    show(
        {
            "source": source,
            "target": target,
            "kind": found.kind,
            "frames": found.frames,
            "names": found.names,
            "duration_s": found.duration,
            "frames_left_out": found.left_out,
        },
        f"Wrote {target}: {_count(len(found.names), found.kind)}, "
        f"{_count(found.frames, 'frames')}, {found.duration:.2f} s{lost}",
        as_json=as_json,
    )


def _count(number: int, things: str) -> str:
    return f"{number} {things.removesuffix('s') if number == 1 else things}"
