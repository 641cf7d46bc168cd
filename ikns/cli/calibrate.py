"""``ikns calibrate``: static trial and explorations in, subject folder out.

The recordings come from files or, with ``--live``, from a marker stream and a person
who follows prompts; the rest is the same.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ikns.cli.calibration_options import body_of, chain_of, check_options, lengths_of
from ikns.cli.calibration_runs import fit_again, learn
from ikns.cli.calibration_tables import calibration_parts
from ikns.cli.live_calibration import LiveOptions, record_live
from ikns.cli.options import (
    AsJson,
    ChainName,
    Force,
    From,
    MarkerSetName,
    MinStatic,
    To,
)
from ikns.cli.output import show
from ikns.cli.reading import Read, check_inputs, reads_markers, refuse_repeated
from ikns.output.folder import check_output_folder


@reads_markers
def calibrate(
    context: typer.Context,
    read: Read,
    out: Annotated[Path, typer.Option(help="Subject folder to write.")],
    static: Annotated[Path | None, typer.Option(help="Static trial.")] = None,
    exploration: Annotated[
        list[Path] | None,
        typer.Option(
            help="Recordings of exploration, with the hand held at each point. "
            "Repeat for more."
        ),
    ] = None,
    natural: Annotated[
        list[Path] | None,
        typer.Option(help="Recordings of natural movement, for the method intent."),
    ] = None,
    short: Annotated[
        bool,
        typer.Option(
            "--short",
            help="Short protocol for the method intent: 3 s standing still, 20 s "
            "of natural movement (--natural), the hand held at two points.",
        ),
    ] = False,
    rewear: Annotated[
        bool,
        typer.Option(
            "--rewear",
            help="Markers were reapplied: keep what --subject has learned and "
            "fit it to a new --static and --natural.",
        ),
    ] = False,
    subject: Annotated[
        Path | None,
        typer.Option(help="Subject folder to update with --rewear."),
    ] = None,
    live: Annotated[
        bool,
        typer.Option("--live", help="Record live from --source, with prompts."),
    ] = False,
    source: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="replay:FILE, lsl:NAME, qualisys:HOST, vicon:HOST, "
            "natnet:HOST (OptiTrack), or ros2:TOPIC.",
        ),
    ] = None,
    recordings: Annotated[
        Path | None,
        typer.Option(help="Folder for live recordings; default: OUT-recordings."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Continue an interrupted calibration with its recordings."
        ),
    ] = False,
    auto: Annotated[
        bool,
        typer.Option(
            "--auto",
            help="Accept or repeat each recording by its verdict, without a keyboard.",
        ),
    ] = False,
    marker_set: MarkerSetName = "oxford24",
    side: Annotated[
        Literal["right", "left", "both"], typer.Option(help="Arm to calibrate.")
    ] = "right",
    clavicle: Annotated[
        bool, typer.Option("--clavicle", help="Include the clavicle in the chain.")
    ] = False,
    chain: ChainName = None,
    stature: Annotated[
        float | None,
        typer.Option(
            help="Standing height, m. With --mass and --sex it replaces --static."
        ),
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Body mass, kg.")] = None,
    sex: Annotated[str | None, typer.Option(help="'female' or 'male'.")] = None,
    points: Annotated[
        int,
        typer.Option(help="Number of PCA points; 2 with --short.", min=1, max=1000),
    ] = 10,
    static_seconds: Annotated[
        float,
        typer.Option(help="Live: length of the static trial, s.", min=0.0, max=3600.0),
    ] = 5.0,
    free_seconds: Annotated[
        float,
        typer.Option(
            help="Live: length of the free exploration, s.", min=0.0, max=3600.0
        ),
    ] = 60.0,
    natural_seconds: Annotated[
        float,
        typer.Option(
            help="Live: length of the natural movement with everyday objects, s; "
            "0 for none.",
            min=0.0,
            max=3600.0,
        ),
    ] = 20.0,
    point_seconds: Annotated[
        float, typer.Option(help="Live: time at each point, s.", min=0.0, max=3600.0)
    ] = 5.0,
    countdown: Annotated[
        float,
        typer.Option(
            help="Live: countdown before each recording, s.", min=0.0, max=3600.0
        ),
    ] = 3.0,
    n_dof: Annotated[
        int,
        typer.Option(
            help="Degrees of freedom to control: first the elbow swivel of each arm, "
            "then hand rotation.",
            min=1,
            max=7,
        ),
    ] = 1,
    max_hand_speed: Annotated[
        float,
        typer.Option(
            help="Speed below which the hand counts as still, m/s.", min=0.0, max=10.0
        ),
    ] = 0.05,
    radius: Annotated[
        float | None,
        typer.Option(
            help="Largest distance of a sample from its point, m.", min=0.0, max=10.0
        ),
    ] = None,
    outside: Annotated[
        Literal["nearest", "project", "nan"],
        typer.Option(help="Which map to use outside the volume of the points."),
    ] = "nearest",
    min_static: MinStatic = 1.0,
    min_still: Annotated[
        float,
        typer.Option(
            help="Shortest time of still samples at a point, s.", min=0.0, max=3600.0
        ),
    ] = 0.5,
    min_rest: Annotated[
        float,
        typer.Option(
            help="Shortest rest of the hand that counts, s. Use 0.5 if "
            "recordings contain free movement.",
            min=0.0,
            max=3600.0,
        ),
    ] = 0.0,
    from_: From = None,
    to: To = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Scale the body, learn the null-space map and write a subject folder.

    From recordings (--static, --exploration) or live: 5 s standing still, a minute of
    free exploration, then the hand held at ten points while the elbow moves. --short is
    a shorter protocol, and --rewear adapts a subject to reapplied markers. --from and
    --to take a part of every exploration.
    """
    from ikns.body.chain_files import chain_file
    from ikns.calibration.subject_files import FILES

    given_names = check_options(context, live=live, rewear=rewear, short=short)
    refuse_repeated(exploration or [], "--exploration")
    refuse_repeated(natural or [], "--natural")
    own = chain_of(chain, side, clavicle=clavicle, given=given_names)
    generic = body_of(stature, mass, sex)
    inputs = [static, *(exploration or []), *(natural or []), marker_set, subject]
    inputs.append(None if chain is None else chain_file(chain)[0])
    check_output_folder(out, FILES, force=force, inputs=[*inputs, recordings])
    if rewear:
        assert subject is not None and static is not None  # noqa: PT018
        fit_again(
            read,
            subject,
            static,
            natural or [],
            out=out,
            marker_set=marker_set if "marker_set" in given_names else None,
            min_static=min_static,
            force=force,
            as_json=as_json,
        )
        return
    points, static_seconds, free_seconds = lengths_of(
        (points, static_seconds, free_seconds), given_names, live=live, short=short
    )
    common: dict[str, Any] = {
        "generic": generic,
        "marker_set": marker_set,
        "chain": own,
        "n_dof": n_dof,
        "max_hand_speed": max_hand_speed,
        "min_static": min_static,
        "min_still": min_still,
        "min_rest": min_rest,
    }
    takes: list[dict[str, Any]] = []
    if live:
        static, exploration, movement, takes = record_live(
            LiveOptions(
                source=source or "",
                recordings=recordings or out.with_name(f"{out.name}-recordings"),
                points=points,
                static_seconds=static_seconds,
                free_seconds=free_seconds,
                natural_seconds=natural_seconds,
                point_seconds=point_seconds,
                countdown=countdown,
                resume=resume,
                auto=auto,
            ),
            **common,
        )
        natural = [*(natural or []), *movement]
    assert exploration is not None
    check_inputs([static, *exploration, *(natural or [])])
    person = learn(
        read,
        static,
        [read(path, start=from_, end=to) for path in exploration],
        natural or [],
        # Also when points were skipped live: clusters that stay empty are left out.
        n_points=points,
        radius=radius,
        outside=outside,
        **common,
    )
    person.save(out, force=force)
    show(
        {"subject": out} | person.report | ({"takes": takes} if live else {}),
        *calibration_parts(person.report),
        f"Wrote {out}",
        as_json=as_json,
    )
