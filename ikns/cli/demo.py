"""``ikns demo``: the whole line on a virtual subject, from C3D files to a report."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from ikns.cli.comparison_rows import comparison_rows, comparison_table
from ikns.cli.options import AsJson, Force
from ikns.cli.output import json_text, loading, notes, progress, show
from ikns.cli.steps_left import one_bar
from ikns.output.file import write_csv, write_text
from ikns.output.folder import check_output_folder, output_folder

_TRIALS = ("static", "free", "points")
_RECORDINGS = (
    *(f"{trial}.c3d" for trial in _TRIALS),
    *(f"{trial}_truth.csv" for trial in _TRIALS),
    "truth.json",
    "truth.urdf",
)
#: Measured on two cores: 8 to 10 s, and 25 to 30 s for compiling.
_ANNOUNCED = (
    "Simulates a calibration, learns from its files and draws a report: about 10 s, "
    "the very first time half a minute more.\n"
)
_RESULTS = ("control.csv", "report.html", "summary.json", "view.html", "workspace.png")


def demo(
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("ikns-demo"),
    seed: Annotated[
        int, typer.Option(help="Seed of the virtual subject.", min=0, max=2**32 - 1)
    ] = 1,
    quick: Annotated[
        bool, typer.Option("--quick", help="Record 3 s instead of 5 s at each point.")
    ] = False,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Calibrate a virtual subject from C3D files and report on it.

    The subject is simulated, so the report can compare the result with the truth. Its
    motion follows the Jacobian's null space, which the method is not given.
    """
    from ikns.calibration.subject_files import FILES

    files = (
        *(f"recordings/{name}" for name in _RECORDINGS),
        *(f"subject/{name}" for name in FILES),
        *_RESULTS,
    )
    check_output_folder(out, files, force=force)
    if sys.stderr.isatty():
        sys.stderr.write(_ANNOUNCED)
    loading()

    from ikns.experiments.demo import DEMO_STEPS, DRAWING, demo_summary, run_demo
    from ikns.view.demo_report import write_demo_report
    from ikns.view.scene import recording_scene, scene_html

    started = time.perf_counter()
    estimates: dict[str, Any] = {}
    with output_folder(out) as folder, progress(estimates=estimates) as report:
        told = one_bar("demo", DEMO_STEPS, report, estimates)
        found = run_demo(folder, seed=seed, quick=quick, progress=told)
        told(DRAWING, 0, 1)
        subject = found.subject
        write_csv(folder / "control.csv", found.control.columns, found.control.rows)
        rows, warned = comparison_rows(subject, subject.motions[0], source="points.c3d")
        summary = demo_summary(found, rows, warned)
        write_demo_report(folder / "report.html", found, summary)
        write_text(folder / "summary.json", json_text(summary))
        scene = recording_scene(
            subject.skeleton,
            subject.null_space_map,
            subject.chain,
            subject.motions[0],
            found.points,
            simulated=True,
            title=f"Virtual subject {seed} at the PCA points",
        )
        write_text(folder / "view.html", scene_html(scene))
        told(DRAWING, 1, 1)
    page, person = out / "report.html", summary["person"]
    correlations = summary["r_of_c_and_true_swivel"]
    show(
        {"folder": out, "report": page, "seconds": time.perf_counter() - started}
        | summary,
        f"Simulated subject {seed}: {person['sex']}, {person['stature_m']:.2f} m, "
        f"{person['mass_kg']:.0f} kg",
        comparison_table(rows, "Simulated: learned against analytic at each PCA point"),
        f"c and the true elbow swivel: r from {min(correlations):.3f} to "
        f"{max(correlations):.3f} over the points",
        *notes(summary["warnings"]),
        f"Open {page}, and {out / 'view.html'} for the motion in 3-D",
        as_json=as_json,
    )
