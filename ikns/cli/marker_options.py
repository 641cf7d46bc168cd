"""Options of the commands of ``ikns markers``, and sentences that they share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Movement = Annotated[
    Path | None,
    typer.Option(help="Recording of the same person and markers in movement."),
]
StaticFile = Annotated[Path, typer.Argument(help="Static trial.")]
SetArgument = Annotated[
    str,
    typer.Argument(
        metavar="SET", help="A name that `ikns markers list` shows, or a .toml file."
    ),
]


def followed_sentence(movement: Path | None, residual: float) -> str:
    """Say how well a body follows a movement, and what is usual.

    Of seven people of UE_ADL, in eight recordings each, `ue_adl` leaves 5 to 17 mm;
    single markers of a person who lifts a box leave 9 mm.
    """
    return (
        f"In {movement} markers and body are {1000 * residual:.0f} mm apart in the "
        "median frame; 5 to 17 mm are usual with clusters, 9 mm with single markers."
    )


def millimeters(values: tuple[float, float, float]) -> str:
    """Return a place for a table."""
    return " ".join(f"{1000 * value:z.0f}" for value in values)
