"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
RecordingFile = Annotated[
    Path, typer.Argument(help="Recording to read: .c3d, .trc or Vicon .csv.")
]
MarkerSetName = Annotated[
    str,
    typer.Option(
        help="A name that `ikns markers list` shows, such as plug_in_gait, or the path "
        "of a .toml file."
    ),
]
