"""``ikns demo``: the whole line on a virtual subject, from C3D files to a report."""

from __future__ import annotations

import dataclasses
import time
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import ikns
from ikns.cli.compare import comparison_rows, comparison_table
from ikns.cli.control import write_control
from ikns.cli.options import AsJson, Force
from ikns.cli.output import json_text, notes, progress, show
from ikns.output_folder import check_output_folder, output_folder

__all__ = ["demo"]

_TRIALS = ("static", "free", "points")
_RECORDINGS = (
    *(f"{trial}.c3d" for trial in _TRIALS),
    *(f"{trial}_truth.csv" for trial in _TRIALS),
    "truth.json",
    "truth.urdf",
)
_RESULTS = ("control.csv", "report.html", "summary.json", "view.html", "workspace.png")


def demo(
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("ikns-demo"),
    seed: Annotated[int, typer.Option(help="Which virtual subject.")] = 1,
    quick: Annotated[
        bool, typer.Option("--quick", help="3 s a point instead of 5 s.")
    ] = False,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Calibrate a virtual subject from C3D files and report on it.

    The subject is simulated, so the truth is known and the report says how close the
    result comes. Its motion follows the Jacobian's null space, which the method never
    sees.
    """
    from ikns.calibration.subject import FILES
    from ikns.view.demo_report import still_samples, write_demo_report
    from ikns.view.scene import recording_scene, scene_html

    files = (
        *(f"recordings/{name}" for name in _RECORDINGS),
        *(f"subject/{name}" for name in FILES),
        *_RESULTS,
    )
    check_output_folder(out, files, force=force)
    started = time.perf_counter()
    with output_folder(out) as folder, progress() as report:
        report("simulating", 0, 1)
        run = ikns.simulate_protocol(ikns.virtual_subject(seed), seed=seed, quick=quick)
        ikns.write_protocol(folder / "recordings", run)
        report("simulating", 1, 1)

        # From here on as with a real person: nothing but the files is used.
        static, free, points = (
            ikns.read(folder / "recordings" / f"{trial}.c3d") for trial in _TRIALS
        )
        subject = ikns.calibrate(static, [points], progress=report)
        about = subject.report | {"simulated": True}
        subject = dataclasses.replace(subject, report=about)
        subject.save(folder / "subject")
        motion = subject.motions[0]
        reaching = ikns.MarkerIK(subject.skeleton).track(
            free, chain=subject.chain, progress=partial(report, "free.c3d")
        )
        control = write_control(folder / "control.csv", subject, reaching)
        rows, warned = comparison_rows(subject, motion, source="points.c3d")

        # And now the truth.
        at_rest = still_samples(subject, run.points.swivel)
        correlations = at_rest.correlations
        true = run.subject.skeleton.segment_lengths
        found = subject.skeleton.segment_lengths
        summary = {
            "simulated": True,
            "ikns": ikns.__version__,
            "seed": seed,
            "quick": quick,
            "person": {
                "sex": run.subject.adult.sex,
                "stature_m": run.subject.adult.stature_m,
                "mass_kg": run.subject.adult.mass_kg,
            },
            "length_error_m": {name: found[name] - true[name] for name in true},
            "residual_median_m": subject.report["explorations"][0]["residual_median_m"],
            "r_of_c_and_true_swivel": correlations,
            "same_sign_everywhere": bool(min(correlations) * max(correlations) > 0),
            "points": rows,
            "control_while_reaching_freely": control,
            "warnings": subject.report["warnings"] + warned,
        }
        write_demo_report(
            folder / "report.html",
            run=run,
            subject=subject,
            reaching=reaching,
            at_rest=at_rest,
            summary=summary,
        )
        (folder / "summary.json").write_text(json_text(summary), encoding="utf-8")
        report("drawing", 0, 1)
        scene = recording_scene(
            subject.skeleton,
            subject.null_space_map,
            subject.chain,
            motion,
            points,
            simulated=True,
            title=f"Virtual subject {seed} at the PCA points",
        )
        (folder / "view.html").write_text(scene_html(scene), encoding="utf-8")
        report("drawing", 1, 1)
    page = out / "report.html"
    show(
        {"folder": out, "report": page, "seconds": time.perf_counter() - started}
        | summary,
        f"Simulated subject {seed}: {run.subject.adult.sex}, "
        f"{run.subject.adult.stature_m:.2f} m, {run.subject.adult.mass_kg:.0f} kg",
        comparison_table(rows, "Simulated: learned against analytic at each PCA point"),
        f"c and the true elbow swivel: r from {min(correlations):.3f} to "
        f"{max(correlations):.3f} over the points",
        *notes(summary["warnings"]),
        f"Open {page}, and {out / 'view.html'} for the motion in 3-D",
        as_json=as_json,
    )
