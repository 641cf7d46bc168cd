"""``ikns markers new``: a marker set of your own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import ikns
from ikns.cli.marker_options import (
    Movement,
    StaticFile,
    followed_sentence,
    millimeters,
)
from ikns.cli.marker_questions import ask_sites
from ikns.cli.options import AsJson, ForceFile, From, MinStatic, To
from ikns.cli.output import held_sentences, notes, show, table
from ikns.cli.reading import Read, reads_markers
from ikns.errors import InvalidInput, naming
from ikns.output.file import refuse_overwriting, write_text

if TYPE_CHECKING:
    from ikns.calibration.own_markers import OwnMarkerSet


@reads_markers
def new(
    read: Read,
    static: StaticFile,
    out: Annotated[Path, typer.Option(help="TOML file to write.")] = Path(
        "markers.toml"
    ),
    sites: Annotated[
        Path | None,
        typer.Option(
            help="Text file with a line LABEL=PLACE for each marker, instead of "
            "questions; add `static` after the place of a marker that is worn in "
            "static trials only."
        ),
    ] = None,
    guess: Annotated[
        bool,
        typer.Option("--guess", help="Do not ask: take what the labels usually mean."),
    ] = False,
    side: Annotated[
        Literal["right", "left"] | None,
        typer.Option(
            help="Side of the labels that name none, where one arm wears markers."
        ),
    ] = None,
    movement: Movement = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the set. Default: that of the file.")
    ] = None,
    min_static: MinStatic = 1.0,
    from_: From = None,
    to: To = None,
    force: ForceFile = False,
    as_json: AsJson = False,
) -> None:
    """Make a marker set from a static trial and where each marker sits.

    Asks for every label where it sits, with what the label usually means as the
    default. Places of landmarks are known; where the other markers sit is measured.
    Markers that --movement lacks are taken to be worn in static trials only, and it is
    reported how well the body follows that movement. --from and --to take a part of the
    static trial, if a longer recording holds one.
    """
    inputs = [static, sites, movement]
    refuse_overwriting(out, force=force, inputs=inputs, endings=[".toml"])
    if guess and sites is not None:
        raise InvalidInput("expected --sites or --guess, found both.")
    if side is not None and sites is not None:
        raise InvalidInput("--side and --sites exclude each other; give one.")
    from ikns.calibration.own_markers import own_marker_set
    from ikns.calibration.set_check import follow_movement
    from ikns.recording.labels import read_name_pairs

    frames = read(static, start=from_, end=to)
    moved = None if movement is None else read(movement)
    seen = () if moved is None else moved.labels
    answers = (
        ask_sites(frames.labels, guess=guess, moving=seen, side=side)
        if sites is None
        else read_name_pairs(sites, form="LABEL=PLACE")
    )
    with naming(str(static if sites is None else sites), str(static)):
        made = own_marker_set(
            ikns.Skeleton.load(),
            frames,
            answers,
            name=name or out.stem,
            min_duration=min_static,
        )
    remarks = _remarks(made, guess=guess)
    followed = None
    if moved is not None:
        followed = follow_movement(
            ikns.Skeleton.load(),
            frames,
            moved,
            marker_set=made.marker_set,
            min_duration=min_static,
        )
        remarks += [finding.sentence for finding in followed.findings]
    write_text(out, made.marker_set.toml(), force=force)
    show(
        {
            "marker_set": out,
            "name": made.marker_set.name,
            "static": static,
            "sites": {
                one.label: one.site.name + " static" * one.static_only
                for one in made.placed
            },
            "measured": [one.label for one in made.placed if not one.site.position],
            "held": made.marker_set.held,
            "turning": made.turning,
            "residual_in_movement_m": None if followed is None else followed.residual,
            "skipped": made.skipped,
            "assumed": made.assumed,
        },
        _place_table(made, f"{made.marker_set.name}, from {static}"),
        *held_sentences(made.marker_set.held),
        *([] if followed is None else [followed_sentence(movement, followed.residual)]),
        *notes(remarks),
        f"Wrote {out}; see how it fits: ikns markers check {out} {static}"
        + f" --min-static {min_static:g}" * (min_static != 1.0)
        + "".join(
            f" --{option} {value}"
            for option, value in (("from", from_), ("to", to))
            if value is not None
        )
        + f" --movement {movement or 'RECORDING'}",
        as_json=as_json,
    )


def _remarks(made: OwnMarkerSet, *, guess: bool) -> list[str]:
    """Say what was assumed or left out."""
    from ikns.calibration.own_markers import side_sentence

    return [
        *(
            f"no landmark on {link}: its angles count from the static trial's posture."
            for link in made.assumed
        ),
        *([f"left out: {', '.join(made.skipped)}."] if made.skipped else []),
        *([f"{told}."] if guess and (told := side_sentence(made.skipped)) else []),
        *(
            [
                f"{', '.join(made.turning)} turn about the forearm with its skin: the "
                "hand shows how far the forearm is turned."
            ]
            if made.turning
            else []
        ),
    ]


def _place_table(made: OwnMarkerSet, title: str) -> Any:
    """Return where each marker sits, and how that is known."""
    where = {one.label: one.site for one in made.placed}
    rows: list[list[Any]] = [
        [
            m.label,
            where[m.label].name,
            millimeters(m.position),
            "measured" if where[m.label].position is None else "known",
            "static only" if m.static_only else "",
        ]
        for m in made.marker_set.markers
    ]
    return table(
        title,
        {
            "marker": "s",
            "place": "s",
            "forward, up, right mm": "s",
            "how": "s",
            "note": "s",
        },
        rows,
    )
