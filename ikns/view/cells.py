"""Cells of tables as text: numbers of a column share their decimals.

All text is plain: it is escaped, except that `backticks` set code.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape

import numpy as np

Cell = str | int | float | bool | None


def inline(text: str) -> str:
    """Return plain text as HTML; `backticks` set code.

    >>> inline("`a < b`")
    '<code>a &lt; b</code>'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def plain_cell(value: Cell | np.generic) -> Cell:
    """Return a value without NumPy's types."""
    plain: Cell = value.item() if isinstance(value, np.generic) else value
    return plain


def cell_html(value: Cell, decimals: int) -> str:
    """Return a cell as HTML; NaN and None become a dash.

    >>> cell_html(1.23456, 2), cell_html(None, 0), cell_html(True, 0)
    ('1.23', '–', 'yes')
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{decimals}f}"
    return inline(str(value))


def shared_decimals(cells: Sequence[Cell]) -> int:
    """Return the decimals with which the largest number has three digits.

    >>> shared_decimals([0.5, 12.345])
    1
    """
    sizes = [abs(c) for c in cells if isinstance(c, float) and math.isfinite(c) and c]
    return min(6, max(0, 2 - math.floor(math.log10(max(sizes))))) if sizes else 0


def is_number(value: Cell) -> bool:
    """Whether a cell stands right: a number, or the dash for a missing one."""
    return value is None or (
        isinstance(value, int | float) and not isinstance(value, bool)
    )
