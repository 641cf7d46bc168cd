"""``ikns robot``: learned against analytic on a robot's recorded joint angles."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Literal

import typer

import ikns
from ikns.cli.comparison_json import findings_json
from ikns.cli.comparison_tables import (
    HELD,
    leak_sentence,
    point_table,
    pooled_table,
)
from ikns.cli.options import AsJson, Force
from ikns.cli.output import notes, show
from ikns.cli.picture import refuse_picture, write_picture
from ikns.errors import naming


def robot(
    urdf: Annotated[Path, typer.Argument(help="Any robot's URDF file.")],
    angles: Annotated[
        Path,
        typer.Argument(
            help="CSV with the columns time_s and JOINT_rad (or JOINT_deg, JOINT_m), "
            "or OpenSim's .mot or .sto."
        ),
    ],
    frame: Annotated[str, typer.Option(help="Link that performs the task.")],
    start: Annotated[
        str | None,
        typer.Option(
            "--from",
            help="Link where the chain starts, such as a torso; default: the root.",
        ),
    ] = None,
    task: Annotated[
        Literal["both", "pose", "position"],
        typer.Option(
            help="What was held: position, orientation, or both as far as the "
            "joints leave freedom."
        ),
    ] = "both",
    up: Annotated[
        Literal["x", "y", "z"],
        typer.Option(help="Axis of the first link that points up."),
    ] = "z",
    points: Annotated[int, typer.Option(help="PCA points.", min=1, max=1000)] = 10,
    radius: Annotated[
        float | None,
        typer.Option(
            help="Largest distance of a sample from its point, m.", min=0.0, max=100.0
        ),
    ] = None,
    speed: Annotated[
        float,
        typer.Option(
            help="Speed below which the link counts as held, m/s.", min=0.0, max=100.0
        ),
    ] = 0.05,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Label tables and picture as simulated.")
    ] = False,
    figure: Annotated[
        Path | None, typer.Option(help="Picture to write, .png, .svg or .pdf.")
    ] = None,
    seed: Annotated[
        int, typer.Option(help="Seed of the intervals.", min=0, max=2**32 - 1)
    ] = 0,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Learn directions from a robot's joint angles and compare them with its Jacobian.

    The robot holds its frame at several places and moves in its null space, as a person
    does in the calibration. Angles of continuous joints may jump by full turns;
    joints that mimic others follow them and need no column.
    """
    from ikns.analysis.compare import compare_robot, free_tasks
    from ikns.nullspace.map import MapWarning, robot_null_space_samples
    from ikns.recording.files.joint_angles import read_joint_angles

    refuse_picture(figure, force=force, inputs=[urdf, angles])
    arm = ikns.Robot.load(urdf, frame, base=start)
    time, q = read_joint_angles(angles, arm.joint_names, sliding=arm.sliding)
    with naming(str(angles)), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        held = robot_null_space_samples(arm, time, q, max_hand_speed=speed)
        tasks = free_tasks(arm, held[1]) if task == "both" else (task,)
        learned = ikns.NullSpaceMap(
            n_points=points, radius=radius, up=["xyz".index(up) == k for k in range(3)]
        ).fit(*held)
        found = [
            compare_robot(
                learned, arm, time, q, task=one, max_hand_speed=speed, seed=seed
            )
            for one in tasks
        ]
    warned = [str(warning.message) for warning in caught]
    if task == "both" and "pose" not in tasks:
        warned.append(
            f"the {len(arm.joint_names)} joints leave no null space while position and "
            "orientation are held, so that only the position is compared."
        )
    if figure is not None:
        from ikns.view.comparison import comparison_figure

        named = {
            f"{HELD[one]} held": each for one, each in zip(tasks, found, strict=True)
        }
        drawn = comparison_figure(named, simulated=simulated)
        write_picture(figure, drawn, force=force)
    title = f"{'Simulated, ' if simulated else ''}{angles}: {frame}"
    show(
        {
            "robot": urdf,
            "angles": angles,
            "frame": frame,
            "from": start,
            "joints": arm.joint_names,
            "simulated": simulated,
            "samples": len(time),
            "held": len(held[0]),
            "comparisons": [
                findings_json(each, task=one)
                for one, each in zip(tasks, found, strict=True)
            ],
            "figure": figure,
            "warnings": warned,
        },
        *(
            point_table(each, f"{title}, {HELD[one]} held")
            for one, each in zip(tasks, found, strict=True)
        ),
        pooled_table(
            [
                (("robot", one, "internal"), e)
                for one, e in zip(tasks, found, strict=True)
            ],
            "All points together (root mean squares); in brackets 95 % intervals",
        ),
        leak_sentence(found[0]),
        *([] if figure is None else [f"Wrote {figure}"]),
        *notes(warned),
        as_json=as_json,
    )
