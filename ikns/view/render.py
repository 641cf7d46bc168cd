"""A figure as bytes: the same figure always gives the same bytes."""

from __future__ import annotations

import base64
import io
import warnings

from matplotlib.figure import Figure

from ikns.view.style import house_style

__all__ = ["data_uri", "png", "svg"]

#: Dots per inch of a PNG: about two per pixel of a page 900 pixels wide.
_DPI = 170
#: An SVG above this size (bytes) holds so many points that a PNG is smaller.
_LARGEST_SVG = 250_000


def svg(figure: Figure) -> bytes:
    """Vector picture; text is drawn as outlines, so no font is needed to show it."""
    return _saved(figure, "svg")


def png(figure: Figure) -> bytes:
    """Pixel picture."""
    return _saved(figure, "png")


def data_uri(figure: Figure) -> str:
    """Picture for ``<img src>``: an SVG, or a PNG where that is smaller.

    >>> data_uri(Figure(figsize=(1, 1)))[:26]
    'data:image/svg+xml;base64,'
    """
    # A 3-D figure holds thousands of polygons: not worth drawing to find out.
    spatial = any(axes.name == "3d" for axes in figure.axes)
    vector = b"" if spatial else svg(figure)
    if spatial or len(vector) > _LARGEST_SVG:
        kind, picture = "image/png", png(figure)
    else:
        kind, picture = "image/svg+xml", vector
    return f"data:{kind};base64,{base64.b64encode(picture).decode('ascii')}"


def _saved(figure: Figure, kind: str) -> bytes:
    stream = io.BytesIO()
    # Without these two, the bytes hold the time of day and matplotlib's version.
    dated = {"Date": None} if kind == "svg" else {"Software": None}
    with house_style(), warnings.catch_warnings():
        # A label in a script that the font lacks shows boxes; the page still stands.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(stream, format=kind, dpi=_DPI, metadata=dated)
    return stream.getvalue()
