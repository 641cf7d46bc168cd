"""``ikns calibrate``: static trial and explorations in, subject folder out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import ikns
from ikns.cli.options import AsJson, Force, MarkerSetName
from ikns.cli.output import notes, progress, show, table
from ikns.errors import InvalidInput
from ikns.output_folder import check_output_folder

__all__ = ["calibrate", "calibration_parts"]


def calibrate(
    static: Annotated[
        Path, typer.Option(help="Recording of the person standing still.")
    ],
    exploration: Annotated[
        list[Path],
        typer.Option(help="Recordings of the hand at the points, one or more."),
    ],
    out: Annotated[Path, typer.Option(help="Subject folder to write.")],
    marker_set: MarkerSetName = "oxford24",
    side: Annotated[
        Literal["right", "left", "both"], typer.Option(help="Arm of the task.")
    ] = "right",
    clavicle: Annotated[
        bool, typer.Option("--clavicle", help="The clavicle belongs to the task too.")
    ] = False,
    stature: Annotated[float | None, typer.Option(help="Standing height, m.")] = None,
    mass: Annotated[float | None, typer.Option(help="Body mass, kg.")] = None,
    sex: Annotated[str | None, typer.Option(help="'female' or 'male'.")] = None,
    points: Annotated[int, typer.Option(help="PCA points.")] = 10,
    n_dof: Annotated[int, typer.Option(help="Degrees of freedom to control.")] = 1,
    max_hand_speed: Annotated[
        float, typer.Option(help="A slower hand is still, m/s.")
    ] = 0.05,
    radius: Annotated[
        float | None, typer.Option(help="Farthest a sample is from its point, m.")
    ] = None,
    outside: Annotated[
        Literal["nearest", "project", "nan"],
        typer.Option(help="What holds outside the points' volume."),
    ] = "nearest",
    min_static: Annotated[
        float, typer.Option(help="Shortest static trial to accept, s.")
    ] = 1.0,
    min_still: Annotated[
        float, typer.Option(help="Least time of still samples at a point, s.")
    ] = 0.5,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Scale the body, learn the null-space map and write a subject folder."""
    from ikns.subject import FILES

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
    check_output_folder(out, FILES, force=force)
    # Three times None is none of them.
    generic = (
        None
        if stature is None or mass is None or sex is None
        else ikns.Skeleton.from_anthropometry(stature, mass, sex)
    )
    with progress() as report:
        subject = ikns.calibrate(
            ikns.read(static),
            [ikns.read(path) for path in exploration],
            generic=generic,
            marker_set=marker_set,
            chain=chain,
            n_points=points,
            n_dof=n_dof,
            max_hand_speed=max_hand_speed,
            radius=radius,
            outside=outside,
            min_static=min_static,
            min_still=min_still,
            progress=report,
        )
    subject.save(out, force=force)
    show(
        {"subject": out} | subject.report,
        *calibration_parts(subject.report),
        f"Wrote {out}",
        as_json=as_json,
    )


def calibration_parts(report: dict[str, Any]) -> list[Any]:
    """Return tables and sentences that say how a calibration went."""
    static, extrinsic = report["static"], report["extrinsic"]
    least = report["settings"]["min_samples"]
    moved = sorted(extrinsic["joints_deg"].items(), key=lambda item: -item[1])[:2]
    return [
        table(
            "Segments, joint to joint",
            {"segment": "s", "length mm": ".1f", "sd mm": ".1f"},
            [
                [name, 1000 * length, 1000 * static["length_sd_m"][name]]
                for name, length in static["lengths_m"].items()
            ],
        ),
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
        f"{extrinsic['thorax_rotation_deg']:.0f} deg; most of all joints "
        + " and ".join(f"{name} {angle:.0f} deg" for name, angle in moved)
        + ".",
        *notes(report["warnings"]),
    ]


def _verdict(row: dict[str, Any], least: int, n_dof: int) -> str:
    if row["point"] is None:
        return f"left out: fewer than {least}"
    if row["components"] > n_dof:
        return f"used, but took {row['components']} components"
    return "used"
