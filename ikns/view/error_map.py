"""A map of errors over the workspace: horizontal slices, seen from above."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array, Mask
from ikns.errors import InvalidInput
from ikns.view.style import GREY, INK, PAGE_WIDTH, PALE, figure_style, new_figure

__all__ = ["Slices", "error_map_figure", "workspace_slices"]

_MARGIN = 0.03  # m around the PCA points


class Slices(NamedTuple):
    """Grids of places in horizontal slices through PCA points; m, thorax frame."""

    height: Array  # (S,) Y of each slice
    forward: Array  # (A,) X of the rows
    right: Array  # (B,) Z of the columns

    @property
    def places(self) -> Array:
        """Every place, (S, A, B, 3) m."""
        y, x, z = np.meshgrid(self.height, self.forward, self.right, indexing="ij")
        return np.stack([x, y, z], axis=-1)


def workspace_slices(
    centers: ArrayLike, *, n: int = 3, spacing: float = 0.01
) -> Slices:
    """Return `n` slices that cover PCA points (P, 3) m, evenly spaced in height.

    The grid within a slice has the given spacing, m.

    Examples
    --------
    >>> workspace_slices([[0, 0, 0], [0.1, 0.4, 0.2]], n=3).height
    array([0.1, 0.2, 0.3])
    """
    points = _points(centers)
    if n < 1 or not 0 < spacing < np.inf:
        raise InvalidInput(
            f"expected at least 1 slice and a spacing above 0 m, found {n} and "
            f"{spacing:g}."
        )
    low, high = points.min(axis=0), points.max(axis=0)
    # At its ends the volume has no width.
    height = low[1] + (high[1] - low[1]) * np.arange(1, n + 1) / (n + 1)
    forward, right = (
        np.arange(low[k] - _MARGIN, high[k] + _MARGIN + spacing / 2, spacing)
        for k in (0, 2)
    )
    return Slices(height, forward, right)


def error_map_figure(
    slices: Slices,
    errors: ArrayLike,
    centers: ArrayLike,
    *,
    label: str,
    simulated: bool,
    title: str = "Where in the workspace the error is",
    highest: float | None = None,
) -> Figure:
    """Draw errors in horizontal slices, seen from above.

    Parameters
    ----------
    slices : Slices
        As from :func:`workspace_slices`.
    errors : (S, A, B) array
        Not negative, at ``slices.places``; NaN, such as outside the volume, is white.
    centers : (P, 3) array
        PCA points, m; each is drawn in the slice nearest to it, numbered from 1.
    label : str
        Of the color bar: the error, with its unit in parentheses.
    simulated : bool
    title : str
    highest : float, optional
        End of the color scale, also for larger errors. Default: the largest.
    """
    wrong, points = np.asarray(errors, dtype=np.float64), _points(centers)
    expected = tuple(len(axis) for axis in slices)
    if wrong.shape != expected:
        raise InvalidInput(f"expected errors {expected}, found {wrong.shape}.")
    known = wrong[np.isfinite(wrong)]
    most = float(known.max(initial=0.0)) if highest is None else highest
    of_point = np.abs(points[:, 1:2] - slices.height).argmin(axis=1)
    # Panels share the width next to the color bar, at one scale on both axes.
    deep = float(np.ptp(slices.forward) / max(np.ptp(slices.right), 1e-9))
    width = (PAGE_WIDTH - 1.8) / len(slices.height)
    with figure_style():
        figure = new_figure(
            title, simulated=simulated, height=1.5 + min(deep * width, 6.0)
        )
        panels: Any = figure.subplots(
            1, len(slices.height), sharex=True, sharey=True, squeeze=False
        )[0]
        for k, axes in enumerate(panels):
            mesh = axes.pcolormesh(
                slices.right,
                slices.forward,
                wrong[k],
                # Even in lightness: readable in grey and with any color vision.
                cmap="cividis_r",
                vmin=0.0,
                vmax=most or 1.0,
                shading="nearest",
                rasterized=True,
            )
            _draw_points(axes, points, of_point == k)
            axes.set_title(_where(slices.height[k]))
            axes.set_aspect("equal")
            axes.grid(color=PALE)
            axes.set_xlabel("Z right (m)")
        panels[0].set_ylabel("X forward (m)")
        beyond = "max" if known.size and known.max() > most else "neither"
        bar = figure.colorbar(mesh, ax=list(panels), extend=beyond)
        bar.set_label(label)
        bar.outline.set_edgecolor(GREY)
    return figure


def _where(height: float) -> str:
    """Describe a height, m, relative to the notch (the origin of the thorax).

    >>> _where(-0.214), _where(0.05)
    ('21 cm under the notch', '5 cm over the notch')
    """
    side = "under" if height < 0 else "over"
    return f"{100 * abs(height):.0f} cm {side} the notch"


def _draw_points(axes: Any, points: Array, here: Mask) -> None:
    for k in np.flatnonzero(here):
        forward, _, right = points[k]
        axes.plot(right, forward, "o", color="white", mec=INK, mew=0.9, ms=10)
        axes.text(
            right,
            forward,
            str(k + 1),
            ha="center",
            va="center",
            fontsize=6,
            fontweight="bold",
        )


def _points(values: ArrayLike) -> Array:
    points = np.asarray(values, dtype=np.float64)
    good = points.ndim == 2 and points.shape[1:] == (3,) and len(points) > 0
    if not good or not np.isfinite(points).all():
        raise InvalidInput(f"expected finite PCA points (P, 3), found {points.shape}.")
    return points
