"""A report: one HTML file that contains its pictures and loads nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from ikns.errors import FileError
from ikns.output.file import write_bytes
from ikns.view.parts import (
    Cell,
    KeyNumber,
    NextStep,
    Picture,
    ReportPage,
    Section,
    Table,
    facts_html,
    inline,
    steps_html,
)

__all__ = [
    "KeyNumber",
    "Picture",
    "Section",
    "NextStep",
    "Table",
    "html_document",
    "report_html",
    "write_report",
]


def write_report(path: str | Path, page: str) -> None:
    """Write a page; an earlier file is kept until the new one is complete."""
    target = Path(path)
    try:
        # File names may hold bytes that are not text; they become question marks.
        write_bytes(target, page.encode("utf-8", errors="replace"))
    except OSError as error:
        raise FileError(f"{target}: cannot be written: {error.strerror}.") from None


def report_html(
    *,
    title: str,
    sections: Sequence[Section],
    simulated: bool,
    lead: str = "",
    facts: Mapping[str, Cell] | None = None,
    key_numbers: Sequence[KeyNumber] = (),
    next_steps: Sequence[NextStep] = (),
) -> str:
    """Return the page of a report; same input, same text.

    Parameters
    ----------
    title : str
        Heading of the page.
    sections : sequence of Section
        In order.
    simulated : bool
        Whether the data come from a virtual subject; the header, every caption and
        every table then say so.
    lead : str
        Paragraph under the title: the outcome.
    facts : mapping, optional
        Subject and provenance for the header: side, chain, seed, versions.
    key_numbers : sequence of KeyNumber
        Results to see first.
    next_steps : sequence of NextStep
        Commands for the end of the page.
    """
    page = ReportPage(simulated)
    style = files("ikns.view").joinpath("report.css").read_text(encoding="utf-8")
    badge = '<p class="badge">Simulated subject</p>' if simulated else ""
    body = [
        f"<header>{badge}<h1>{inline(title)}</h1>",
        f'<p class="lead">{inline(lead)}</p>' if lead else "",
        facts_html(facts or {}),
        "</header><main>",
        page.key_numbers(key_numbers),
        *(page.section(section) for section in sections),
        steps_html(next_steps),
        "</main>",
    ]
    return html_document(title, style, body)


def html_document(title: str, style: str, body: Iterable[str]) -> str:
    """Return a document; the browser itself refuses whatever it would load.

    Title is plain text, style CSS; body are HTML elements, of which empty ones are left
    out.
    """
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "img-src data:; style-src 'unsafe-inline'\">",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        f"<title>{escape(title)}</title>",
        f"<style>\n{style}</style></head><body>",
        *body,
        "</body></html>",
    ]
    return "\n".join(part for part in parts if part) + "\n"
