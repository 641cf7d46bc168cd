"""A figure as bytes; the same figure always gives the same bytes."""

from __future__ import annotations

import base64
import io
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from matplotlib.figure import Figure

from ikns.view.style import figure_style

#: Dots per inch of a PNG: about two per pixel of a page 900 pixels wide.
_DPI = 170
#: Points of a figure's lines (60 bytes each in an SVG) above which they become pixels.
_MOST_POINTS = 3000


def svg(figure: Figure) -> bytes:
    """Vector picture; text is drawn as outlines, so no font is needed to show it."""
    return _saved(figure, "svg")


def png(figure: Figure) -> bytes:
    """Pixel picture."""
    return _saved(figure, "png")


def pdf(figure: Figure) -> bytes:
    """Vector picture for print."""
    return _saved(figure, "pdf")


def data_uri(figure: Figure) -> str:
    """Return the picture for ``<img src>``: an SVG, sharp at every size.

    Long lines, and surfaces in space, are pixels within it, which are smaller; text and
    axes are not.

    >>> data_uri(Figure(figsize=(1, 1)))[:26]
    'data:image/svg+xml;base64,'
    """
    with _crowds_as_pixels(figure):
        picture = svg(figure)
    return f"data:image/svg+xml;base64,{base64.b64encode(picture).decode('ascii')}"


@contextmanager
def _crowds_as_pixels(figure: Figure) -> Iterator[None]:
    """Draw what would make a large SVG as pixels, here only."""
    lines = [line for axes in figure.axes for line in axes.lines]
    sizes = [np.size(line.get_xdata()) for line in lines]
    crowded = sum(sizes) > _MOST_POINTS
    # The longest, which are those of measured time series.
    long = [x for x, n in zip(lines, sizes, strict=True) if n > max(sizes) / 10]
    solid = [axes for axes in figure.axes if axes.name == "3d"]
    for line in long:
        line.set_rasterized(crowded)
    for axes in solid:  # all but its three axes
        axes.set_rasterization_zorder(math.inf)
    try:
        yield
    finally:
        for line in long:
            line.set_rasterized(False)
        for axes in solid:
            axes.set_rasterization_zorder(None)


def _saved(figure: Figure, kind: str) -> bytes:
    stream = io.BytesIO()
    # Otherwise the bytes would hold the date or matplotlib's version.
    dated = {"svg": "Date", "png": "Software", "pdf": "CreationDate"}[kind]
    with figure_style(), warnings.catch_warnings():
        # A label in a script that the font lacks shows boxes.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(stream, format=kind, dpi=_DPI, metadata={dated: None})
    return stream.getvalue()
