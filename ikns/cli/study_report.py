"""``ikns report``: a study's visits as a page, figures and tables."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ikns.cli.options import AsJson, Force
from ikns.cli.output import loading, notes, progress, show, table
from ikns.output.folder import check_output_folder, output_folder


def report(
    study: Annotated[
        Path, typer.Argument(help="Study folder, or the folder of one visit.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write. Default: `report` in the study."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            help="Number of processes that read visits; -1: one per core, the "
            "default for many visits.",
            min=-1,
            max=1024,
        ),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write tables, figures and statistics of a study's visits, and one page with all.

    Everything is computed again from the recorded attempts. People and simulated
    participants are never pooled; the page says which is which.
    """
    from ikns.experiments.visits import list_visits

    list_visits(study)  # a missing study is reported before the rest loads
    loading()

    from ikns.experiments.study.summary import summarize
    from ikns.experiments.study.summary.numbers import numbers
    from ikns.view.study_report import report_files, write_study_report

    place = study / "report" if out is None else out
    if study.is_dir():  # otherwise the study is missing, not the output
        check_output_folder(place, report_files(), force=force, inputs=[study])
    with progress(kernels=False) as on_progress:
        summary = summarize(study, workers=jobs, progress=on_progress)
        with output_folder(place) as folder:
            write_study_report(folder, summary, progress=on_progress)
    page = place / "report.html"
    result = {"report": page} | numbers(summary)
    parts: list[Any] = []
    for group in result["groups"]:
        who = "Simulated participants" if group["simulated"] else "Participants"
        parts += _tables(group, who)
        for each in group["answers"]:
            parts += [each["question"], *(f"  {a}" for a in each["answer"]), ""]
    show(
        result,
        *parts,
        *notes(each["reason"] for each in result["left_out"]),
        f"Open {page}; figures for print are in {place / 'figures'}",
        as_json=as_json,
    )


def _tables(group: dict[str, Any], who: str) -> list[Any]:
    """Short tables for the terminal."""
    made = []
    if group["tracking"] is not None:
        made.append(
            table(
                f"{who}: RMSE of tracking, of 100",
                {
                    "condition": "s",
                    "trajectory": "s",
                    "mean": ".2f",
                    "SD": ".2f",
                    "n": "d",
                    "trials": "d",
                },
                [
                    [
                        cell["condition"],
                        cell["level"] or "all",
                        cell["over"]["mean"],
                        cell["over"]["deviation"],
                        cell["over"]["subjects"],
                        cell["trials"],
                    ]
                    for cell in group["tracking"]["rmse"]
                ],
            )
        )
    if group["picking"] is not None:
        made.append(
            table(
                f"{who}: pick and place",
                {
                    "condition": "s",
                    "object": "s",
                    "succeeded": "d",
                    "trials": "d",
                    "median s": ".2f",
                    "with failures s": ".2f",
                },
                [
                    [
                        cell["condition"],
                        cell["object"] or "all",
                        cell["succeeded"],
                        cell["trials"],
                        cell["median"],
                        cell["restricted"],
                    ]
                    for cell in group["picking"]["objects_by_condition"]
                ],
            )
        )
    return made
