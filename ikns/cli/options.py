"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

AsJson = Annotated[
    bool, typer.Option("--json", help="Print one JSON object instead of a table.")
]
Force = Annotated[
    bool, typer.Option("--force", help="Overwrite what an earlier run wrote.")
]
SubjectFolder = Annotated[
    Path, typer.Option("--subject", help="Folder that `ikns calibrate` wrote.")
]
#: Endings of recordings, for help texts.
MARKER_FILES = ".c3d, .trc, .csv (Vicon, Motive), .tsv (Qualisys) or .xdf"
RecordingFile = Annotated[
    Path, typer.Argument(help=f"Recording to read: {MARKER_FILES}.")
]
SubjectPrefix = Annotated[
    str | None,
    typer.Option(help="Of several people in a file: Ann, for labels like Ann:RSHO."),
]
From = Annotated[
    str | None,
    typer.Option(
        "--from", help="Start there: seconds, or the name of an event in a C3D file."
    ),
]
To = Annotated[
    str | None, typer.Option("--to", help="Stop there: seconds, or an event likewise.")
]
Rename = Annotated[
    list[str] | None,
    typer.Option(
        metavar="OLD=NEW",
        help="Another label for a marker of the recordings; again for more.",
    ),
]
LabelFile = Annotated[
    Path | None,
    typer.Option(help="Text file with a line OLD=NEW for each such marker."),
]
MarkerSetName = Annotated[
    str,
    typer.Option(
        help="A name that `ikns markers list` shows, such as plug_in_gait, or the path "
        "of a .toml file."
    ),
]
Publish = Annotated[
    list[str] | None,
    typer.Option(
        help="lsl:NAME: c, flexion, state and residual as an LSL stream, and events as "
        "another; on this machine only without lsl:NAME?scope=network. "
        "ros2:NAMESPACE: topics of ROS 2, by the router of this machine without "
        "ros2:NAMESPACE?router=HOST:PORT. Again for more.",
    ),
]
Rerun = Annotated[
    bool,
    typer.Option(
        "--rerun",
        help="Show markers, arms, c, residuals and events in Rerun's viewer, on this "
        "machine.",
    ),
]
Rrd = Annotated[
    Path | None,
    typer.Option(help="Write the same to a file of Rerun, FILE.rrd."),
]
OptionalMarkerSet = Annotated[
    str | None,
    typer.Option(
        help="A name that `ikns markers list` shows, such as plug_in_gait, or the path "
        "of a .toml file."
    ),
]
#: What reads c off recordings.
AnyMethod = Annotated[
    Literal["paper", "proximal", "intent"],
    typer.Option(
        help="What reads c off the posture: the paper's map over joint angles, the "
        "upper arm and elbow alone, or the departure from the natural posture."
    ),
]
