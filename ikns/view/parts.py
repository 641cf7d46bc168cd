"""The parts of a report, and how each becomes HTML.

All text is plain: it is escaped, except that `backticks` set code.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

from matplotlib.figure import Figure

from ikns.errors import InvalidInput
from ikns.view.cells import (
    Cell,
    cell_html,
    inline,
    is_number,
    plain_cell,
    shared_decimals,
)
from ikns.view.render import data_uri
from ikns.view.style import PAGE_WIDTH


@dataclass(frozen=True)
class Picture:
    """A figure with its caption and its alternative text."""

    figure: Figure
    caption: str
    alt: str


@dataclass(frozen=True)
class Table:
    """Named columns and rows of cells; NaN and None become a dash."""

    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""


@dataclass(frozen=True)
class Widget:
    """Part of a page that one can move: our own HTML, not escaped, and its script."""

    html: str
    script: str


@dataclass(frozen=True)
class Section:
    """A heading with paragraphs, a widget, pictures and tables, in this order.

    What is in `details` is folded away until it is asked for; a section that is
    `folded` shows its heading only.
    """

    title: str
    text: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()
    details: Sequence[Picture | Table] = ()
    widget: Widget | None = None
    folded: bool = False


@dataclass(frozen=True)
class KeyNumber:
    """A result: its name, its value with unit, and its meaning in plain words."""

    name: str
    value: str
    meaning: str


@dataclass(frozen=True)
class NextStep:
    """A command to run next, and what it does."""

    command: str
    does: str


class ReportPage:
    """Turns parts into HTML and numbers figures and tables in their order.

    Where data are simulated every caption says so.
    """

    def __init__(self, simulated: bool) -> None:
        self.suffix = ' <span class="tag">Simulated.</span>' if simulated else ""
        self.figures = 0
        self.tables = 0
        self.headings: dict[str, str] = {}  # title by its id, in order
        self.section_tag = ""  # label of a section's heading

    def anchor(self, title: str) -> str:
        """Return an id for a heading, and list it in the contents."""
        name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")[:60] or "section"
        unique, number = name, 1
        while unique in self.headings:
            number += 1
            unique = f"{name}-{number}"
        self.headings[unique] = title
        return unique

    def section(self, section: Section) -> str:
        """Heading, paragraphs, widget, pictures, tables, details."""
        parts = [f"<p>{inline(paragraph)}</p>" for paragraph in section.text]
        parts += [] if section.widget is None else [section.widget.html]
        parts += [self.picture(picture) for picture in section.pictures]
        parts += [self.table(table) for table in section.tables]
        parts += [self.folded(detail) for detail in section.details]
        head = f"<h2>{inline(section.title)}{self.section_tag}</h2>"
        if section.folded:
            head = f'<details class="whole"><summary>{head}</summary>'
            parts.append("</details>")
        opening = f'<section id="{self.anchor(section.title)}">{head}'
        return "\n".join([opening, *parts, "</section>"])

    def folded(self, detail: Picture | Table) -> str:
        """Picture or table under a line that opens it."""
        if isinstance(detail, Picture):
            name, html = f"Figure {self.figures + 1}", self.picture(detail)
        else:
            name, html = f"Table {self.tables + 1}", self.table(detail)
        # As far as the first clause: what is folded has its whole caption inside.
        words = re.split(r"[.:;,]\s|\.$", detail.caption)[0]
        summary = f"{name}: {words}" if words else name
        return f"<details><summary>{inline(summary)}</summary>{html}</details>"

    def picture(self, picture: Picture) -> str:
        """Figure with its image inside and its caption."""
        if not picture.alt.strip():
            raise InvalidInput(
                f"the picture captioned '{picture.caption}' needs an alternative text."
            )
        self.figures += 1
        share = min(100.0, 100 * picture.figure.get_figwidth() / PAGE_WIDTH)
        # Text has one size in all pictures, so a narrow figure stays narrow; on a phone
        # (22 rem) a wide one is scrolled.
        least = round(0.4 * share)
        kind = "scroll picture wide" if least > 22 else "scroll picture"
        return (
            f'<figure><div class="{kind}" tabindex="0" role="group" '
            f'aria-label="Figure {self.figures}">'
            f'<img src="{data_uri(picture.figure)}" '
            f'style="width: {share:.0f}%; min-width: {least}rem" '
            f'alt="{escape(picture.alt)}"></div>\n'
            f"<figcaption><b>Figure {self.figures}.</b> {inline(picture.caption)}"
            f"{self.suffix}</figcaption></figure>"
        )

    def table(self, table: Table) -> str:
        """Table whose columns of numbers are aligned right."""
        for row in table.rows:
            if len(row) != len(table.columns):
                raise InvalidInput(
                    f"a table of {len(table.columns)} columns holds a row of "
                    f"{len(row)} cells."
                )
        self.tables += 1
        rows = [[plain_cell(cell) for cell in row] for row in table.rows]
        columns = [[row[k] for row in rows] for k in range(len(table.columns))]
        side = [
            'class="number"' if cells and all(map(is_number, cells)) else ""
            for cells in columns
        ]
        decimals = [shared_decimals(cells) for cells in columns]
        head = "".join(
            f'<th scope="col" {s}>{inline(name)}</th>'
            for name, s in zip(table.columns, side, strict=True)
        )
        body = "\n".join(
            "<tr>"
            + "".join(
                f"<td {s}>{cell_html(cell, d)}</td>"
                for cell, s, d in zip(row, side, decimals, strict=True)
            )
            + "</tr>"
            for row in rows
        )
        caption = f"<b>Table {self.tables}.</b> {inline(table.caption)}{self.suffix}"
        return (
            f'<div class="scroll" tabindex="0" role="group" '
            f'aria-label="Table {self.tables}"><table><caption>{caption}</caption>'
            f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>"
        )

    def key_numbers(self, numbers: Sequence[KeyNumber]) -> str:
        """Results to see first, large."""
        if not numbers:
            return ""
        items = "\n".join(
            f"<div><dt>{inline(number.name)}</dt>"
            f'<dd class="value">{inline(number.value)}</dd>'
            f"<dd>{inline(number.meaning)}</dd></div>"
            for number in numbers
        )
        anchor = self.anchor("Key numbers")
        return (
            f'<section id="{anchor}"><h2>Key numbers{self.suffix}</h2>'
            f'<dl class="keys">{items}</dl></section>'
        )

    def contents(self) -> str:
        """Links to all headings so far; none where there are only two."""
        if len(self.headings) < 3:
            return ""
        items = "".join(
            f'<li><a href="#{name}">{inline(title)}</a></li>'
            for name, title in self.headings.items()
        )
        return f'<nav class="contents" aria-label="Contents"><ol>{items}</ol></nav>'


def facts_html(facts: Mapping[str, Cell]) -> str:
    """List of names and values."""
    if not facts:
        return ""
    items = "".join(
        f"<div><dt>{inline(name)}</dt>"
        f"<dd>{cell_html(value, shared_decimals([value]))}</dd></div>"
        for name, value in ((name, plain_cell(given)) for name, given in facts.items())
    )
    return f'<dl class="facts">{items}</dl>'


def steps_html(steps: Sequence[NextStep]) -> str:
    """Numbered list of commands."""
    if not steps:
        return ""
    items = "\n".join(
        f'<li>{inline(step.does)}<pre tabindex="0"><code>{escape(step.command)}'
        "</code></pre></li>"
        for step in steps
    )
    return f'<section id="next"><h2>Next steps</h2><ol>{items}</ol></section>'
