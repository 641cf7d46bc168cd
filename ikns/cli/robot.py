"""``ikns robot``: the same comparison on a robot's recorded joint angles."""

from __future__ import annotations

import csv
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import ikns
from ikns.cli.comparison_tables import (
    HELD,
    findings_json,
    leak_sentence,
    point_table,
    pooled_table,
)
from ikns.cli.options import AsJson, Force
from ikns.cli.output import notes, show
from ikns.cli.picture import refuse_picture, write_picture
from ikns.errors import FileError, NotEnoughData, naming

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["robot"]

#: Endings of a column's name, and the joint's unit in them.
_UNITS = {"_rad": 1.0, "_m": 1.0, "_deg": 0.017453292519943295}


def robot(
    urdf: Annotated[Path, typer.Argument(help="Any robot's URDF file.")],
    angles: Annotated[
        Path,
        typer.Argument(
            help="CSV with the columns time_s and JOINT_rad (or JOINT_deg, JOINT_m)."
        ),
    ],
    frame: Annotated[str, typer.Option(help="The link that does the task.")],
    task: Annotated[
        Literal["both", "pose", "position"], typer.Option(help="What was held.")
    ] = "both",
    points: Annotated[int, typer.Option(help="PCA points.", min=1)] = 10,
    radius: Annotated[
        float | None, typer.Option(help="Samples farther from their point go, m.")
    ] = None,
    speed: Annotated[float, typer.Option(help="A slower frame is held, m/s.")] = 0.05,
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Say so in tables and picture.")
    ] = False,
    figure: Annotated[
        Path | None, typer.Option(help="Picture to write, .png, .svg or .pdf.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the intervals.", min=0)] = 0,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Learn directions from a robot's joint angles and hold them against its Jacobian.

    The robot holds its frame at some places and moves the rest, as a person does in the
    calibration.
    """
    import numpy as np

    from ikns.analysis.compare import compare_robot
    from ikns.nullspace.map.checks import MapWarning

    refuse_picture(figure, force=force)
    arm = ikns.Robot.load(urdf, frame)
    time, q = _read(angles, arm.joint_names)
    with naming(str(angles)), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MapWarning)
        place, _ = arm.pose(q)
        held = np.linalg.norm(np.gradient(place, time, axis=0), axis=1) < speed
        if not held.any():
            raise NotEnoughData(
                f"expected samples with '{frame}' slower than {speed:g} m/s, found "
                "none."
            )
        learned = ikns.NullSpaceMap(n_points=points, radius=radius)
        learned.fit(place[held], q[held])
        tasks: tuple[Literal["pose", "position"], ...] = (
            ("pose", "position") if task == "both" else (task,)
        )
        found = [
            compare_robot(
                learned, arm, time, q, task=one, max_hand_speed=speed, seed=seed
            )
            for one in tasks
        ]
    warned = [str(warning.message) for warning in caught]
    if figure is not None:
        from ikns.view.comparison import comparison_figure

        named = {
            f"{HELD[one]} held": each for one, each in zip(tasks, found, strict=True)
        }
        write_picture(figure, comparison_figure(named, simulated=simulated))
    title = f"{'Simulated, ' if simulated else ''}{angles}: {frame}"
    show(
        {
            "robot": urdf,
            "angles": angles,
            "frame": frame,
            "joints": arm.joint_names,
            "simulated": simulated,
            "samples": len(time),
            "held": int(held.sum()),
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


def _read(
    path: Path, joints: tuple[str, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Time (T,) s and joint positions (T, n); rows that miss one are left out."""
    import numpy as np

    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = list(csv.reader(file)) or [[]]
        uneven = [i for i, row in enumerate(rows, 2) if len(row) != len(header)]
        if uneven:
            raise ValueError(f"line {uneven[0]} has not {len(header)} cells")
        table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    except (OSError, ValueError) as error:
        raise FileError(
            f"{path}: cannot be read as a table of numbers: {error}."
        ) from None
    if len(rows) < 2:
        raise FileError(
            f"{path}: expected a header and two rows or more, found {len(rows)} rows."
        )
    columns = {"time_s": (header.index("time_s"), 1.0)} if "time_s" in header else {}
    for place, name in enumerate(header):
        for ending, unit in _UNITS.items():
            if name.endswith(ending):
                columns.setdefault(name.removesuffix(ending), (place, unit))
    missing = [name for name in ("time_s", *joints) if name not in columns]
    if missing:
        raise FileError(
            f"{path}: expected the columns time_s and JOINT_rad, found none for "
            f"{', '.join(missing)}."
        )
    wanted = [columns[name] for name in ("time_s", *joints)]
    values = np.stack([unit * table[:, place] for place, unit in wanted], axis=1)
    values = values[np.isfinite(values).all(axis=1)]
    if len(values) < 2 or not (np.diff(values[:, 0]) > 0).all():
        raise FileError(f"{path}: expected a time_s that increases from row to row.")
    return values[:, 0], values[:, 1:]
