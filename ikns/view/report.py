"""A report: one HTML file that contains its pictures and loads nothing."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from ikns.errors import FileError, plain
from ikns.output.file import write_bytes
from ikns.view.cells import Cell, inline
from ikns.view.parts import (
    KeyNumber,
    NextStep,
    Picture,
    ReportPage,
    Section,
    Table,
    facts_html,
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
        raise FileError(f"{target}: cannot be written: {plain(error)}.") from None


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
    found = [page.key_numbers(key_numbers), *map(page.section, sections)]
    body = [
        f"<header>{badge}<h1>{inline(title)}</h1>",
        f'<p class="lead">{inline(lead)}</p>' if lead else "",
        page.contents(),
        "</header><main>",
        *found,
        steps_html(next_steps),
        "</main>",
        f"<footer>{facts_html(facts)}</footer>" if facts else "",
    ]
    scripts = [s.widget.script for s in sections if s.widget is not None]
    return html_document(title, style, body, scripts=scripts)


def html_document(
    title: str, style: str, body: Iterable[str], *, scripts: Iterable[str] = ()
) -> str:
    """Return a document; the browser itself refuses whatever it would load.

    Title is plain text, style CSS; body are HTML elements, of which empty ones are left
    out; no script runs but these.
    """
    code = [f"\n{script}" for script in scripts]
    digests = [hashlib.sha256(text.encode()).digest() for text in code]
    allowed = "".join(f" 'sha256-{base64.b64encode(d).decode()}'" for d in digests)
    policy = f"; script-src{allowed}" if allowed else ""
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        f"img-src data:; style-src 'unsafe-inline'{policy}\">",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<meta name="color-scheme" content="light dark">',
        f"<title>{escape(title)}</title>",
        f"<style>\n{style}</style></head><body>",
        *body,
        *(f"<script>{text}</script>" for text in code),
        "</body></html>",
    ]
    return "\n".join(part for part in parts if part) + "\n"
