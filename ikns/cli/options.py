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
#: The same where one file is written.
ForceFile = Annotated[
    bool, typer.Option("--force", help="Overwrite the file if it exists.")
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
    typer.Option(
        help="Which person to read where labels are like Ann:RSHO, for example Ann."
    ),
]
From = Annotated[
    str | None,
    typer.Option(
        "--from",
        help="Start of the part to read: seconds, or the name of an event in "
        "a C3D or Qualisys file.",
    ),
]
To = Annotated[
    str | None,
    typer.Option(
        "--to", help="End of the part to read: seconds, or the name of an event."
    ),
]
Rename = Annotated[
    list[str] | None,
    typer.Option(
        metavar="OLD=NEW",
        help="Read marker OLD as NEW. Repeat for more markers.",
    ),
]
LabelFile = Annotated[
    Path | None,
    typer.Option(help="Text file with a line OLD=NEW for each renamed marker."),
]
MarkerSetName = Annotated[
    str,
    typer.Option(
        help="A name that `ikns markers list` shows, such as plug_in_gait, or the path "
        "of a .toml file."
    ),
]
Fingers = Annotated[
    list[str] | None,
    typer.Option(
        "--finger",
        metavar="ADDRESS",
        help="Finger to drive: sim:, dynamixel:/dev/ttyUSB0, ros2:TOPIC or "
        "lerobot:TYPE. Repeat for more; one with dof=2 follows the second freedom of "
        "the map.",
    ),
]
Publish = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ADDRESS",
        help="Where to publish c, flexion, state, residual and events: lsl:NAME (two "
        "LSL streams) or ros2:NAMESPACE (ROS 2 topics). Only this machine gets them, "
        "except with lsl:NAME?scope=network and ros2:NAMESPACE?router=HOST:PORT. "
        "Repeat for more.",
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
    typer.Option(help="Write the same to a Rerun file, FILE.rrd."),
]
OptionalMarkerSet = Annotated[
    str | None,
    typer.Option(
        help="A name that `ikns markers list` shows, such as plug_in_gait, or the path "
        "of a .toml file."
    ),
]
MinStatic = Annotated[
    float,
    typer.Option(help="Shortest static trial accepted, s.", min=0.0, max=3600.0),
]
#: A chain of joints, by name or file.
ChainName = Annotated[
    str | None,
    typer.Option(
        "--chain",
        metavar="NAME|FILE",
        help="Joints of the task, in place of --side: a chain such as right_arm, or "
        "one of your own: a .toml file, or FILE:NAME where it has several.",
    ),
]
#: What reads c off recordings.
AnyMethod = Annotated[
    Literal["paper", "proximal", "intent"],
    typer.Option(
        help="How c is read from the posture: the paper's map of joint "
        "angles, a map of upper arm and elbow only, or the departure "
        "from the natural posture."
    ),
]
