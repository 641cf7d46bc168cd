"""Options of the commands that run an experiment with a person."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

VisitFolder = Annotated[
    Path | None,
    typer.Argument(help="Folder of the visit. An existing visit is continued."),
]
FromStudy = Annotated[
    Path | None,
    typer.Option(
        help="Study folder, which sets the design and the folder of the visit."
    ),
]
Participant = Annotated[
    str | None,
    typer.Option(help="Participant's code: letters and digits.", show_default="01"),
]
Number = Annotated[
    int | None,
    typer.Option(
        help="Participant's number, counted from 0; it sets the order of conditions.",
        min=0,
        max=9999,
    ),
]
Rest = Annotated[
    float | None,
    typer.Option(
        help="Rest between conditions, s.", show_default="120", min=0.0, max=3600.0
    ),
]
ForIkns = Annotated[
    Path | None, typer.Option(help="For ikns: folder that `ikns calibrate` wrote.")
]
SourceAddress = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="For ikns: replay:FILE, lsl:NAME, qualisys:HOST, vicon:HOST, "
        "natnet:HOST (OptiTrack), or ros2:TOPIC.",
    ),
]
SessionFolder = Annotated[
    Path | None,
    typer.Option(
        help="For ikns: folder for its sessions.", show_default="in the visit"
    ),
]
SafeState = Annotated[
    Literal["limp", "hold", "open"],
    typer.Option(help="State of the finger when poses stop arriving."),
]
LiveMethod = Annotated[
    Literal["paper", "proximal", "intent"],
    typer.Option(
        help="For ikns: how c is read from the posture: the paper's map of joint "
        "angles, a map of upper arm and elbow only, or the departure "
        "from the natural posture."
    ),
]
MaxUncertainty = Annotated[
    float,
    typer.Option(
        help="For ikns: hold the finger while the standard deviation of c is larger.",
        min=0.0,
        max=10.0,
    ),
]
View = Annotated[
    bool, typer.Option("--view/--no-view", help="Show the body in 3-D on the panel.")
]
Realtime = Annotated[
    bool,
    typer.Option(
        "--realtime",
        help="For ikns: run the control loop at real-time priority, if allowed.",
    ),
]
Host = Annotated[
    str,
    typer.Option(
        help="Network address of the pages. Opening them needs the token in "
        "the printed address; other machines get them unencrypted."
    ),
]
Port = Annotated[
    int, typer.Option(help="Port of the pages; 0 chooses a free one.", min=0, max=65535)
]
Browser = Annotated[
    bool, typer.Option("--browser/--no-browser", help="Open the pages in a browser.")
]
