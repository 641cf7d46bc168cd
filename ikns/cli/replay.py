"""``ikns replay``: compute a recorded session again, check and export it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ikns.cli.options import AsJson, Force
from ikns.cli.output import notes, show, table


def replay(
    session: Annotated[Path, typer.Argument(help="Folder that `ikns run` wrote.")],
    run: Annotated[
        int | None,
        typer.Option(
            help="Number of the run; the last by default.", min=1, max=1000000
        ),
    ] = None,
    export: Annotated[
        Path | None, typer.Option(help="Also write the run as .csv, .mat or .c3d.")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Recompute c and the commands of a session and compare them bit for bit."""
    from ikns.live.runtime import replay_run
    from ikns.live.session import (
        check_export,
        check_session,
        export_run,
        read_run,
    )

    if export is not None:
        check_export(export, session, force=force)
    recorded = read_run(session, run)
    found = check_session(session)
    again = replay_run(recorded)
    if export is not None:
        export_run(recorded, export, force=force)
    show(
        {
            "session": session,
            "run": recorded.number,
            "frames": len(recorded.frame),
            "same": again.same,
            "different": again.different,
            "findings": found,
            "export": export,
        },
        table(
            f"{session}, run {recorded.number}: {len(recorded.frame)} frames",
            {"column": "s", "frames that differ\nin any bit": "d"},
            [[name, count] for name, count in again.different.items()],
        ),
        *notes(found),
        *([f"Wrote {export}"] if export else []),
        as_json=as_json,
    )
    if not again.same:
        raise typer.Exit(1)
