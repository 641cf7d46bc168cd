"""``ikns check``: what is wrong with recordings, before they are used."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import ikns
from ikns.cli.options import (
    MARKER_FILES,
    AsJson,
    From,
    MinStatic,
    OptionalMarkerSet,
    To,
)
from ikns.cli.output import show, table
from ikns.cli.reading import Read, check_inputs, reads_markers, refuse_repeated
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.output.wording import counted

if TYPE_CHECKING:
    from ikns.calibration.judge.finding import Finding


def _counted(findings: Sequence[Finding]) -> list[str]:
    """Say that findings are no errors; nothing where some are, or none was found."""
    from ikns.calibration.judge.finding import refused

    if not findings or refused(findings):
        return []
    kinds = [finding.severity for finding in findings]
    told = [
        counted(kinds.count(severity), name)
        for severity, name in (("warn", "warning"), ("note", "note"))
        if severity in kinds
    ]
    return [f"No errors; {' and '.join(told)}."]


@reads_markers
def check(
    read: Read,
    recordings: Annotated[
        list[Path],
        typer.Argument(help=f"Recordings of one person: {MARKER_FILES}."),
    ],
    static: Annotated[
        Path | None,
        typer.Option(help="Static trial to compare with."),
    ] = None,
    subject: Annotated[
        Path | None,
        typer.Option(help="Subject folder to compare with."),
    ] = None,
    marker_set: OptionalMarkerSet = None,
    min_static: MinStatic = 1.0,
    from_: From = None,
    to: To = None,
    as_json: AsJson = False,
) -> None:
    """Check recordings for wrong labels, units, ghost markers or another person.

    A recording in which the person stands still is judged as a static trial. Exits
    with 2 when one must not be used. --from and --to take a part of every recording,
    not of --static.
    """
    if static is not None and subject is not None:
        raise InvalidInput("--static and --subject exclude each other; give one.")
    if subject is not None and marker_set is not None:
        raise InvalidInput(
            "--marker-set works only with --static; a subject has its own markers."
        )
    refuse_repeated(recordings)
    check_inputs([*recordings, static], subject)

    from ikns.calibration.judge.finding import refusal, refused

    person = None if subject is None else ikns.Subject.load(subject)
    found = ikns.check_recordings(
        [read(path, start=from_, end=to) for path in recordings],
        static=None if static is None else read(static),
        skeleton=None if person is None else person.skeleton,
        report=None if person is None else person.report,
        marker_set=marker_set or "oxford24",
        min_static=min_static,
    )
    shown = {
        "refuse": "do not use",
        "warn": "take care",
        "note": "note",
    }
    rows = [
        [
            shown[finding.severity],
            Path(finding.where).name,
            finding.found + (f", frames {finding.frames}" * bool(finding.frames)),
            finding.right,
        ]
        for finding in found.findings
    ]
    show(
        found.as_dict(),
        table(
            "Roles",
            {"recording": "s", "checked as": "s"},
            [[Path(name).name, kind] for name, kind in found.judged],
        ),
        table(
            "Found",
            {"verdict": "s", "recording": "s", "problem": "s", "remedy": "s"},
            rows,
        )
        if rows
        else "No problems found.",
        *_counted(found.findings),
        as_json=as_json,
    )
    if faults := refused(found.findings):
        raise MarkerMismatch(refusal(faults))
