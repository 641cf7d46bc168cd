"""What ``ikns calibrate`` runs: learning a subject, or fitting one again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ikns
from ikns.cli.calibration_tables import methods_parts, shift_sentence
from ikns.cli.output import notes, progress, show
from ikns.cli.reading import Read
from ikns.cli.steps_left import one_bar
from ikns.output.folder import check_output_folder


def learn(
    read: Read,
    static: Path | None,
    explorations: list[ikns.Recording],
    natural: list[Path],
    **options: Any,
) -> ikns.Subject:
    """Calibrate, with a bar for all steps, and warn of markers that were not seen."""
    from ikns.calibration.steps import calibration_steps
    from ikns.motion.unseen import warn_unseen

    estimates: dict[str, Any] = {}
    with progress(estimates=estimates) as report:
        still = None if static is None else read(static)
        moving = [read(path) for path in natural]
        steps = calibration_steps(still, explorations, moving)
        person = ikns.calibrate(
            still,
            explorations,
            natural=moving,
            progress=one_bar("calibrating", steps, report, estimates),
            **options,
        )
    for frames in explorations:
        warn_unseen(person.skeleton, frames, options["chain"])
    return person


def fit_again(
    read: Read,
    folder: Path,
    static: Path,
    natural: list[Path],
    *,
    out: Path,
    marker_set: str | None,
    min_static: float,
    force: bool,
    as_json: bool,
) -> None:
    """Fit a subject to new places of its markers, and write another folder."""
    from ikns.calibration.rewear import rewear
    from ikns.calibration.steps import body_steps
    from ikns.calibration.subject_files import FILES

    check_output_folder(out, FILES, force=force, inputs=[folder])
    known = ikns.Subject.load(folder)
    estimates: dict[str, Any] = {}
    with progress(estimates=estimates) as report:
        still, moving = read(static), [read(path) for path in natural]
        steps = body_steps(still, moving)
        person = rewear(
            known,
            still,
            moving,
            marker_set=marker_set,
            min_static=min_static,
            progress=one_bar("calibrating", steps, report, estimates),
        )
    person.save(out, force=force)
    show(
        {"subject": out, "from": folder} | person.report,
        shift_sentence(person.report["rewear"], known.methods),
        *methods_parts(person.report),
        *notes(person.report["warnings"]),
        f"Wrote {out}",
        as_json=as_json,
    )
