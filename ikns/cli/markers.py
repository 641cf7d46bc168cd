"""``ikns markers``: marker sets, those that come along and one's own."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

import ikns
from ikns.cli.checks import checked
from ikns.cli.marker_questions import ask_sites
from ikns.cli.options import AsJson, Force, MinStatic
from ikns.cli.output import held_sentences, notes, show, table
from ikns.cli.reading import Read, reads_markers
from ikns.errors import InvalidInput, naming
from ikns.output.file import refuse_overwriting, write_text

markers_app = typer.Typer(
    help="Marker sets: list, show, make one's own, check one.",
    no_args_is_help=True,
    add_completion=False,
)

#: A marker this many placement deviations from its nominal place is pointed out.
_FAR = 3.0

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


def list_(as_json: AsJson = False) -> None:
    """List the marker sets that come with ikns."""
    found = [ikns.MarkerSet.load(name) for name in ikns.MarkerSet.names()]
    show(
        {
            "sets": [
                {
                    "name": each.name,
                    "markers": len(each.markers),
                    "static_only": [m.label for m in each.markers if m.static_only],
                    "held": each.held,
                    "source": each.source,
                }
                for each in found
            ]
        },
        table(
            "Marker sets",
            {"name": "s", "markers": "d", "held joints": "d", "first labels": "s"},
            [
                [
                    each.name,
                    len(each.markers),
                    len(each.held),
                    ", ".join(each.labels[:6]),
                ]
                for each in found
            ],
        ),
        "Your own, from a static trial: ikns markers new static.c3d --out mine.toml",
        as_json=as_json,
    )


def show_(marker_set: SetArgument, as_json: AsJson = False) -> None:
    """Show a marker set: where each marker sits, and which joints are held."""
    worn = ikns.MarkerSet.load(marker_set)
    rows = [
        {
            "label": m.label,
            "segment": m.link,
            "position_m": m.position,
            "placement_sd_m": m.placement_sd,
            "static_only": m.static_only,
            "weight": m.weight,
            "aliases": m.aliases,
        }
        for m in worn.markers
    ]
    show(
        {
            "name": worn.name,
            "source": worn.source,
            "held": worn.held,
            "markers": rows,
        },
        table(
            f"{worn.name}: {worn.source}",
            {
                "marker": "s",
                "segment": "s",
                "forward, up, right mm": "s",
                "sd mm": "s",
                "note": "s",
            },
            [
                [
                    m.label,
                    m.link,
                    _millimeters(m.position),
                    _millimeters(m.placement_sd),
                    "; ".join(
                        [
                            *(["static only"] if m.static_only else []),
                            *([f"weight {m.weight:g}"] if m.weight != 1 else []),
                            *([f"also {', '.join(m.aliases)}"] if m.aliases else []),
                        ]
                    ),
                ]
                for m in worn.markers
            ],
        ),
        *held_sentences(worn.held),
        as_json=as_json,
    )


def sites_(as_json: AsJson = False) -> None:
    """List the places on the body that ikns markers new knows."""
    from ikns.body.sites import sites

    known = sites().values()
    show(
        {
            "sites": [
                {
                    "name": each.name,
                    "about": each.about,
                    "segment": each.link,
                    "position_m": each.position,
                    "usual_labels": each.labels,
                }
                for each in known
            ]
        },
        table(
            "Places on the body; each right_ one also as left_",
            {"place": "s", "what it is": "s", "usual labels": "s"},
            [
                [each.name, each.about, ", ".join(each.labels)]
                for each in known
                if each.side != "left"
            ],
        ),
        as_json=as_json,
    )


@reads_markers
def check(
    read: Read,
    marker_set: SetArgument,
    static: StaticFile,
    movement: Movement = None,
    min_static: MinStatic = 1.0,
    as_json: AsJson = False,
) -> None:
    """Compare a marker set with a static trial, and with a movement.

    How far each marker is from where the set expects it, in millimeters and in
    placement deviations, and the joint angles in which the person stands; with
    --movement, how far the markers are from the body that follows them.
    """
    from ikns.calibration.set_check import check_marker_set, follow_movement

    frames = read(static)
    worn = ikns.MarkerSet.load(marker_set)
    moved = None
    if movement is not None:
        moved = follow_movement(
            ikns.Skeleton.load(),
            frames,
            read(movement),
            marker_set=worn,
            min_duration=min_static,
        )
    in_motion = {} if moved is None else moved.markers
    with naming(str(static)):
        found = check_marker_set(
            ikns.Skeleton.load(),
            frames,
            marker_set=worn,
            min_duration=min_static,
        )
    remarks = [
        *(
            f"{m.label} is {m.offset_sd:.1f} standard deviations from its place: "
            "misplaced, swapped, or from another set."
            for m in found.markers
            if m.seen and m.offset_sd > _FAR
        ),
        *(f"{m.label} is never seen." for m in found.markers if not m.seen),
        *(
            f"{j.joint} is at {math.degrees(j.angle):.0f} deg, beyond its limits."
            for j in found.joints
            if not j.lower <= j.angle <= j.upper
        ),
        *([] if found.converged else ["the fit did not converge."]),
        *([] if moved is None else [one.sentence for one in moved.findings]),
    ]
    show(
        {
            "marker_set": marker_set,
            "static": static,
            "converged": found.converged,
            "markers": [
                {
                    "label": m.label,
                    "segment": m.link,
                    "seen": m.seen,
                    "offset_m": m.offset,
                    "offset_sd": m.offset_sd,
                    "residual_m": m.residual,
                    "residual_in_movement_m": in_motion.get(m.label),
                }
                for m in found.markers
            ],
            "movement": movement,
            "residual_in_movement_m": None if moved is None else moved.residual,
            "static_angles_deg": {j.joint: math.degrees(j.angle) for j in found.joints},
            "held": [j.joint for j in found.joints if j.held],
            "segment_lengths_m": found.lengths,
            "notes": remarks,
        },
        table(
            f"{marker_set} in {static}",
            {
                "marker": "s",
                "segment": "s",
                "off its place mm": ".1f",
                "in sd": ".1f",
                "residual mm": ".1f",
                **({} if moved is None else {"moving mm": ".1f"}),
            },
            [
                [
                    m.label,
                    m.link,
                    1000 * m.offset,
                    m.offset_sd,
                    1000 * m.residual,
                    *(
                        []
                        if moved is None
                        else [1000 * in_motion.get(m.label, math.nan)]
                    ),
                ]
                for m in found.markers
            ],
        ),
        table(
            "The person stands like this",
            {"joint": "s", "deg": ".0f", "limits deg": "s", "note": "s"},
            [
                [
                    j.joint,
                    math.degrees(j.angle),
                    f"{math.degrees(j.lower):.0f} .. {math.degrees(j.upper):.0f}",
                    "held" if j.held else "",
                ]
                for j in found.joints
            ],
        ),
        *([] if moved is None else [_followed(movement, moved.residual)]),
        *notes(remarks),
        as_json=as_json,
    )


def _followed(movement: Path | None, residual: float) -> str:
    return (
        f"In {movement} markers and body are {1000 * residual:.0f} mm apart in the "
        "median frame; skin leaves 10 to 22 mm with clusters, 9 with single markers."
    )


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
            "questions; `static` behind a place that is worn in static trials only."
        ),
    ] = None,
    guess: Annotated[
        bool,
        typer.Option("--guess", help="Do not ask: take what the labels usually mean."),
    ] = False,
    movement: Movement = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the set. Default: that of the file.")
    ] = None,
    min_static: MinStatic = 1.0,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Make a marker set from a static trial and where each marker sits.

    Asks for every label where it sits, with what the label usually means as the
    default. Places of landmarks are known; where the other markers sit is measured.
    Markers that --movement lacks are taken to be worn in static trials only, and how
    well the body follows that movement is said.
    """
    refuse_overwriting(out, force=force, inputs=[static, sites, movement])
    if out.suffix.lower() != ".toml":
        raise InvalidInput(
            f"{out}: expected a file that ends in .toml, found '{out.suffix}'."
        )
    if guess and sites is not None:
        raise InvalidInput("expected --sites or --guess, found both.")
    from ikns.calibration.own_markers import own_marker_set
    from ikns.calibration.set_check import follow_movement
    from ikns.recording.labels import read_name_pairs

    frames = read(static)
    moved = None if movement is None else read(movement)
    seen = () if moved is None else moved.labels
    answers = (
        ask_sites(frames.labels, guess=guess, moving=seen)
        if sites is None
        else read_name_pairs(sites)
    )
    with naming(str(static if sites is None else sites)):
        made = own_marker_set(
            ikns.Skeleton.load(),
            frames,
            answers,
            name=name or out.stem,
            min_duration=min_static,
        )
    write_text(out, made.marker_set.toml(), force=force)
    where = {one.label: one.site for one in made.placed}
    rows: list[list[Any]] = [
        [
            m.label,
            where[m.label].name,
            _millimeters(m.position),
            "measured" if where[m.label].position is None else "known",
            "static only" if m.static_only else "",
        ]
        for m in made.marker_set.markers
    ]
    remarks = [
        *(
            f"no landmark on {link}: its angles are measured from the static trial."
            for link in made.assumed
        ),
        *([f"left out: {', '.join(made.skipped)}."] if made.skipped else []),
        *(
            [
                f"{', '.join(made.turning)} turn about the forearm with its skin: the "
                "hand shows how far the forearm is turned."
            ]
            if made.turning
            else []
        ),
    ]
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
        table(
            f"{made.marker_set.name}, from {static}",
            {
                "marker": "s",
                "place": "s",
                "forward, up, right mm": "s",
                "how": "s",
                "note": "s",
            },
            rows,
        ),
        *held_sentences(made.marker_set.held),
        *([] if followed is None else [_followed(movement, followed.residual)]),
        *notes(remarks),
        f"Wrote {out}; see how it fits: ikns markers check {out} {static}"
        + " --movement RECORDING" * (movement is None),
        as_json=as_json,
    )


def _millimeters(values: tuple[float, float, float]) -> str:
    return " ".join(f"{1000 * value:.0f}" for value in values)


for name_, command in (
    ("list", list_),
    ("show", show_),
    ("check", check),
    ("new", new),
    ("sites", sites_),
):
    markers_app.command(name_)(checked(command))
