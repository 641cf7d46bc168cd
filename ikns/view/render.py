"""A figure as bytes; the same figure always gives the same bytes."""

from __future__ import annotations

import base64
import io
import warnings

import numpy as np
from matplotlib.figure import Figure

from ikns.view.style import figure_style

#: Dots per inch of a PNG: about two per pixel of a page 900 pixels wide.
_DPI = 170
#: Points of a figure above which an SVG (60 bytes each) is larger than the PNG.
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
    """Return the picture for ``<img src>``: an SVG, or a PNG where that is smaller.

    >>> data_uri(Figure(figsize=(1, 1)))[:26]
    'data:image/svg+xml;base64,'
    """
    if _is_crowded(figure):
        kind, picture = "image/png", png(figure)
    else:
        kind, picture = "image/svg+xml", svg(figure)
    return f"data:{kind};base64,{base64.b64encode(picture).decode('ascii')}"


def _is_crowded(figure: Figure) -> bool:
    sizes = (np.size(line.get_xdata()) for axes in figure.axes for line in axes.lines)
    # 3-D axes are used for surfaces and clouds of points.
    return sum(sizes) > _MOST_POINTS or any(axes.name == "3d" for axes in figure.axes)


def _saved(figure: Figure, kind: str) -> bytes:
    stream = io.BytesIO()
    # Otherwise the bytes would hold the date or matplotlib's version.
    dated = {"svg": "Date", "png": "Software", "pdf": "CreationDate"}[kind]
    with figure_style(), warnings.catch_warnings():
        # A label in a script that the font lacks shows boxes.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(stream, format=kind, dpi=_DPI, metadata={dated: None})
    return stream.getvalue()
