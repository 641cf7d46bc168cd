"""``ikns calibrate``: static trial and explorations in, subject folder out.

The recordings come from files or, with ``--live``, from a marker stream and a person
who follows prompts; the rest is the same.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import ikns
from ikns.cli.live_calibration import LiveOptions, record_live
from ikns.cli.options import AsJson, Force, MarkerSetName
from ikns.cli.output import held_sentences, notes, progress, show, table
from ikns.cli.reading import Read, check_inputs, reads_markers
from ikns.errors import InvalidInput
from ikns.output.folder import check_output_folder

#: Options of files only.
_FILES_ONLY = (
    "static",
    "exploration",
    "subject_prefix",
    "rename",
    "labels",
    "cutoff",
)
#: Options of a live calibration only.
_LIVE_ONLY = (
    "source",
    "recordings",
    "static_seconds",
    "free_seconds",
    "point_seconds",
    "countdown",
    "resume",
    "auto",
)


@reads_markers
def calibrate(
    context: typer.Context,
    read: Read,
    out: Annotated[Path, typer.Option(help="Subject folder to write.")],
    static: Annotated[
        Path | None, typer.Option(help="Recording of the person standing still.")
    ] = None,
    exploration: Annotated[
        list[Path] | None,
        typer.Option(help="Recordings with the hand held at the points, one or more."),
    ] = None,
    natural: Annotated[
        list[Path] | None,
        typer.Option(help="Recordings of ordinary movement, for the method intent."),
    ] = None,
    live: Annotated[
        bool,
        typer.Option("--live", help="Record now, from --source, with prompts."),
    ] = False,
    source: Annotated[
        str | None,
        typer.Option(help="replay:FILE, lsl:NAME, qualisys:HOST or vicon:HOST."),
    ] = None,
    recordings: Annotated[
        Path | None,
        typer.Option(help="Folder for live recordings; default: OUT-recordings."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue with recordings that exist.")
    ] = False,
    auto: Annotated[
        bool,
        typer.Option("--auto", help="Live without a keyboard: follow every verdict."),
    ] = False,
    marker_set: MarkerSetName = "oxford24",
    side: Annotated[
        Literal["right", "left", "both"], typer.Option(help="Arm of the task.")
    ] = "right",
    clavicle: Annotated[
        bool, typer.Option("--clavicle", help="Include the clavicle in the chain.")
    ] = False,
    stature: Annotated[
        float | None,
        typer.Option(help="Standing height, m; with --mass and --sex for --static."),
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Body mass, kg.")] = None,
    sex: Annotated[str | None, typer.Option(help="'female' or 'male'.")] = None,
    points: Annotated[int, typer.Option(help="PCA points.", min=1, max=1000)] = 10,
    static_seconds: Annotated[
        float, typer.Option(help="Live: standing still, s.", min=0.0, max=3600.0)
    ] = 5.0,
    free_seconds: Annotated[
        float, typer.Option(help="Live: free exploration, s.", min=0.0, max=3600.0)
    ] = 60.0,
    point_seconds: Annotated[
        float, typer.Option(help="Live: each point, s.", min=0.0, max=3600.0)
    ] = 5.0,
    countdown: Annotated[
        float, typer.Option(help="Live: before each recording, s.", min=0.0, max=3600.0)
    ] = 3.0,
    n_dof: Annotated[
        int, typer.Option(help="Degrees of freedom to control.", min=1, max=7)
    ] = 1,
    max_hand_speed: Annotated[
        float,
        typer.Option(
            help="Hand speed below which it counts as still, m/s.", min=0.0, max=10.0
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
        typer.Option(help="Map outside the volume of the points."),
    ] = "nearest",
    min_static: Annotated[
        float,
        typer.Option(help="Shortest static trial accepted, s.", min=0.0, max=3600.0),
    ] = 1.0,
    min_still: Annotated[
        float,
        typer.Option(
            help="Least duration of still samples at a point, s.", min=0.0, max=3600.0
        ),
    ] = 0.5,
    min_rest: Annotated[
        float,
        typer.Option(
            help="Shorter rests of the hand do not count, s; 0.5 for recordings with "
            "free movement.",
            min=0.0,
            max=3600.0,
        ),
    ] = 0.0,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Scale the body, learn the null-space map and write a subject folder.

    From recordings (--static, --exploration) or live: 5 s standing still, a minute of
    free exploration, then the hand held at ten points while the elbow moves.
    """
    from ikns.calibration.subject_files import FILES

    if side == "both" and clavicle:
        raise InvalidInput("--clavicle goes with --side right or left, not with both.")
    chain = f"{side}_arm" + "_clavicle" * clavicle if side != "both" else "both_arms"
    body = {"--stature": stature, "--mass": mass, "--sex": sex}
    given = [name for name, value in body.items() if value is not None]
    if len(given) in (1, 2):
        raise InvalidInput(
            f"expected --stature, --mass and --sex together or none of them, found "
            f"only {' and '.join(given)}."
        )
    _check_input(context, live=live)
    inputs = [static, *(exploration or []), *(natural or []), marker_set, recordings]
    check_output_folder(out, FILES, force=force, inputs=inputs)
    # Three times None is none of them.
    generic = (
        None
        if stature is None or mass is None or sex is None
        else ikns.Skeleton.from_anthropometry(stature, mass, sex)
    )
    takes: list[dict[str, Any]] = []
    if live:
        if radius is not None and not radius > 0:
            raise InvalidInput(f"expected a radius above 0 m, found {radius:g}.")
        static, exploration, movement, takes = record_live(
            LiveOptions(
                source=source or "",
                recordings=recordings or out.with_name(f"{out.name}-recordings"),
                points=points,
                static_seconds=static_seconds,
                free_seconds=free_seconds,
                point_seconds=point_seconds,
                countdown=countdown,
                resume=resume,
                auto=auto,
            ),
            generic=generic,
            marker_set=marker_set,
            chain=chain,
            n_dof=n_dof,
            max_hand_speed=max_hand_speed,
            min_static=min_static,
            min_still=min_still,
            min_rest=min_rest,
        )
        natural = [*(natural or []), *movement]
    assert exploration is not None
    check_inputs([static, *exploration, *(natural or [])])

    from ikns.motion.unseen import warn_unseen

    explorations = [read(path) for path in exploration]
    with progress() as report:
        subject = ikns.calibrate(
            None if static is None else read(static),
            explorations,
            natural=[read(path) for path in natural or []],
            generic=generic,
            marker_set=marker_set,
            chain=chain,
            # Also when points were skipped live: the clustering starts from the box of
            # all samples, and clusters that stay empty are left out.
            n_points=points,
            n_dof=n_dof,
            max_hand_speed=max_hand_speed,
            radius=radius,
            outside=outside,
            min_static=min_static,
            min_still=min_still,
            min_rest=min_rest,
            progress=report,
        )
    for frames in explorations:
        warn_unseen(subject.skeleton, frames, chain)
    subject.save(out, force=force)
    show(
        {"subject": out} | subject.report | ({"takes": takes} if live else {}),
        *calibration_parts(subject.report),
        f"Wrote {out}",
        as_json=as_json,
    )


def _check_input(context: typer.Context, *, live: bool) -> None:
    """Check that either files or a live source are given, not both."""
    given = {
        name
        for name in context.params
        if (origin := context.get_parameter_source(name)) and origin.name != "DEFAULT"
    }
    if live:
        files = [f"--{name.replace('_', '-')}" for name in _FILES_ONLY if name in given]
        if files:
            raise InvalidInput(
                f"{' and '.join(files)} {'goes' if len(files) == 1 else 'go'} with "
                "recordings from files, and --live records them; give one or the other."
            )
        if "source" not in given:
            raise InvalidInput("--live needs the --source of the markers.")
        return
    alone = [f"--{n.replace('_', '-')}" for n in _LIVE_ONLY if n in given]
    if alone:
        raise InvalidInput(f"{' and '.join(alone)} needs --live.")
    missing = [] if "exploration" in given else ["--exploration"]
    if not given & {"static", "stature"}:
        missing.insert(0, "--static (or --stature, --mass and --sex)")
    if missing:
        raise InvalidInput(
            f"expected {' and '.join(missing)}, or --live with a --source."
        )


def _axes(body: dict[str, Any]) -> list[str]:
    """Say how the axes lie that the explorations show, against the generic body's."""
    told = [
        f"{name[:-2].replace('_', ' ')} {math.degrees(body['tilts_rad'][name]):+.1f} "
        f"about {name[-1].upper()} (sd {math.degrees(body['tilt_sd_rad'][name]):.1f})"
        for name in body.get("tilts_shown", [])
    ]
    return [f"Axes against the generic body's, deg: {', '.join(told)}."] if told else []


def calibration_parts(report: dict[str, Any]) -> list[Any]:
    """Return tables and sentences on the quality of a calibration."""
    static, extrinsic = report["static"], report["extrinsic"]
    # Folders from before explorations were used have no body of both.
    body = report.get("body") or static
    least = report["settings"]["min_samples"]
    seen = [item for item in extrinsic["joints_deg"].items() if item[1] is not None]
    moved = sorted(seen, key=lambda item: -item[1])[:2]
    return [
        table(
            "Segments, joint to joint"
            + ", assumed from stature" * (static["source"] is None),
            {"segment": "s", "length mm": ".1f", "sd mm": ".1f"},
            [
                [name, 1000 * length, 1000 * body["length_sd_m"][name]]
                for name, length in body["lengths_m"].items()
            ],
        ),
        *_axes(body),
        table(
            "Explorations",
            {"recording": "s", "s": ".1f", "still s": ".1f", "residual mm": ".1f"},
            [
                [
                    Path(row["source"]).name,
                    row["duration_s"],
                    row["still_s"],
                    1000 * (row["residual_median_m"] or math.nan),
                ]
                for row in report["explorations"]
            ],
        ),
        table(
            f"PCA points of {report['chain']} in the thorax frame",
            {
                "point": "d",
                "forward\nmm": ".0f",
                "up\nmm": ".0f",
                "right\nmm": ".0f",
                "still\nsamples": "d",
                "verdict": "s",
            },
            [
                [
                    row["point"],
                    *(1000 * x for x in row["center_m"]),
                    row["samples"],
                    _verdict(row, least, report["settings"]["n_dof"]),
                ]
                for row in report["points"]
            ],
        ),
        "Outside the chain, while the hand was still: thorax "
        f"{1000 * extrinsic['thorax_translation_m']:.0f} mm and "
        f"{extrinsic['thorax_rotation_deg']:.0f} deg"
        + "; most of all joints " * bool(moved)
        + " and ".join(f"{name} {angle:.0f} deg" for name, angle in moved)
        + ".",
        *held_sentences(static["held"]),
        methods_sentence(report),
        *notes([*report["warnings"], *report["methods"]["warnings"]]),
    ]


def methods_sentence(report: dict[str, Any]) -> str:
    """Say which methods of `control --method` were learned."""
    methods = report["methods"]
    lost = methods["without"]
    known = [name for name in ("paper", "proximal", "intent") if name not in lost]
    parts = [f"Methods learned: {', '.join(known)}."]
    parts += [f"Not {name}: {reason.rstrip('.')}." for name, reason in lost.items()]
    if "intent" not in lost:
        taught = methods["natural_posture"]
        parts.append(
            f"Natural posture of {taught['frames']} frames of this person's movement."
            if taught["frames"]
            else "Natural posture of other people, as there was too little ordinary "
            "movement; add some with --natural."
        )
    return " ".join(parts)


def _verdict(row: dict[str, Any], least: int, n_dof: int) -> str:
    if row["point"] is None:
        return f"left out: fewer than {least}"
    if row["components"] > n_dof:
        return f"used, but took {row['components']} components"
    return "used"
