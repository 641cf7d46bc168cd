"""The parts of a report, and how each becomes HTML.

All text is plain: it is escaped, except that `backticks` set code.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from matplotlib.figure import Figure

from ikns.errors import InvalidInput
from ikns.view.render import data_uri
from ikns.view.style import PAGE_WIDTH

Cell = str | int | float | bool | None


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
class Section:
    """A heading with paragraphs, pictures and tables, in this order."""

    title: str
    text: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()


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

    def section(self, section: Section) -> str:
        """Heading, paragraphs, pictures, tables."""
        parts = [f"<section><h2>{inline(section.title)}</h2>"]
        parts += [f"<p>{inline(paragraph)}</p>" for paragraph in section.text]
        parts += [self.picture(picture) for picture in section.pictures]
        parts += [self.table(table) for table in section.tables]
        return "\n".join([*parts, "</section>"])

    def picture(self, picture: Picture) -> str:
        """Figure with its image inside and its caption."""
        if not picture.alt.strip():
            raise InvalidInput(
                f"the picture captioned '{picture.caption}' needs an alternative text."
            )
        self.figures += 1
        share = min(100.0, 100 * picture.figure.get_figwidth() / PAGE_WIDTH)
        return (
            f'<figure><img src="{data_uri(picture.figure)}" '
            # Text has one size in all pictures, so a narrow figure stays narrow.
            f'style="width: {share:.0f}%" alt="{escape(picture.alt)}">\n'
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
        rows = [[_plain(cell) for cell in row] for row in table.rows]
        columns = [[row[k] for row in rows] for k in range(len(table.columns))]
        side = [
            'class="number"' if cells and all(map(_is_number, cells)) else ""
            for cells in columns
        ]
        decimals = [_decimals(cells) for cells in columns]
        head = "".join(
            f'<th scope="col" {s}>{inline(name)}</th>'
            for name, s in zip(table.columns, side, strict=True)
        )
        body = "\n".join(
            "<tr>"
            + "".join(
                f"<td {s}>{_cell(cell, d)}</td>"
                for cell, s, d in zip(row, side, decimals, strict=True)
            )
            + "</tr>"
            for row in rows
        )
        caption = f"<b>Table {self.tables}.</b> {inline(table.caption)}{self.suffix}"
        return (
            f'<div class="scroll"><table><caption>{caption}</caption>'
            f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>"
        )

    def key_numbers(self, numbers: Sequence[KeyNumber]) -> str:
        """Table of results to see first."""
        if not numbers:
            return ""
        rows = "\n".join(
            f'<tr><th scope="row">{inline(number.name)}</th>'
            f'<td class="value">{inline(number.value)}</td>'
            f"<td>{inline(number.meaning)}</td></tr>"
            for number in numbers
        )
        caption = f"<caption>{self.suffix}</caption>" if self.suffix else ""
        return (
            '<section><h2>Key numbers</h2><div class="scroll">'
            f'<table class="key">{caption}<thead><tr><th scope="col">Quantity</th>'
            '<th scope="col">Value</th><th scope="col">What it means</th></tr></thead>'
            f"\n<tbody>{rows}</tbody></table></div></section>"
        )


def facts_html(facts: Mapping[str, Cell]) -> str:
    """List of names and values."""
    if not facts:
        return ""
    items = "".join(
        f"<div><dt>{inline(name)}</dt><dd>{_cell(value, _decimals([value]))}</dd></div>"
        for name, value in ((name, _plain(given)) for name, given in facts.items())
    )
    return f'<dl class="facts">{items}</dl>'


def steps_html(steps: Sequence[NextStep]) -> str:
    """Numbered list of commands."""
    if not steps:
        return ""
    items = "\n".join(
        f"<li>{inline(step.does)}<pre><code>{escape(step.command)}</code></pre></li>"
        for step in steps
    )
    return f"<section><h2>Next steps</h2><ol>{items}</ol></section>"


def inline(text: str) -> str:
    """Return plain text as HTML; `backticks` set code.

    >>> inline("`a < b`")
    '<code>a &lt; b</code>'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _plain(value: Cell | np.generic) -> Cell:
    plain: Cell = value.item() if isinstance(value, np.generic) else value
    return plain


def _cell(value: Cell, decimals: int) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{decimals}f}"
    return inline(str(value))


def _decimals(cells: Sequence[Cell]) -> int:
    """Return the decimals with which the largest number has three digits."""
    sizes = [abs(c) for c in cells if isinstance(c, float) and math.isfinite(c) and c]
    return min(6, max(0, 2 - math.floor(math.log10(max(sizes))))) if sizes else 0


def _is_number(value: Cell) -> bool:
    return value is None or (
        isinstance(value, int | float) and not isinstance(value, bool)
    )
