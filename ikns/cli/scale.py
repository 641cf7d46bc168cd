"""``ikns scale``: a skeleton from stature, mass and sex alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import ikns
from ikns.cli.options import AsJson, ForceFile
from ikns.cli.output import show, table
from ikns.output.file import refuse_overwriting, write_text


def scale(
    stature: Annotated[float, typer.Option(help="Standing height, m.")],
    mass: Annotated[float, typer.Option(help="Body mass, kg.")],
    sex: Annotated[str, typer.Option(help="'female' or 'male'.")],
    out: Annotated[Path, typer.Option(help="URDF file to write.")],
    force: ForceFile = False,
    as_json: AsJson = False,
) -> None:
    """Write a URDF scaled from anthropometric tables.

    People of one stature differ from it by the standard deviations printed.
    """
    from ikns.calibration.scaled_body import length_sd_at_stature

    refuse_overwriting(out, force=force, inputs=[], endings=[".urdf"])
    skeleton = ikns.Skeleton.from_anthropometry(stature=stature, mass=mass, sex=sex)
    write_text(out, skeleton.urdf, force=force)
    lengths = skeleton.segment_lengths
    spread = length_sd_at_stature(lengths)
    show(
        {
            "urdf": out,
            "stature_m": stature,
            "mass_kg": mass,
            "sex": sex,
            "segment_lengths_m": lengths,
            "segment_length_sd_m": spread,
        },
        table(
            f"{stature:g} m, {mass:g} kg, {sex}",
            {"segment": "s", "length mm": ".1f", "sd mm": ".1f"},
            [
                [name, 1000 * length, 1000 * spread[name]]
                for name, length in lengths.items()
            ],
        ),
        f"Wrote {out}",
        as_json=as_json,
    )
