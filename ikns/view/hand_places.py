"""Where the hand is held: the body at each place, for who leads a calibration."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.body import body_surfaces
from ikns.view.style import GREY, INK, figure_style, new_figure, point_color

#: Thorax frame (X forward, Y up, Z right) to matplotlib's axes, of which Z is up.
_TO_DRAWING = [2, 0, 1]
_COLUMNS = 5
_ELEVATION, _AZIMUTH = 14, 55  # deg; from the front, on the side of the arm


def hand_places_figure(
    arms: ArrayLike, places: ArrayLike, *, simulated: bool, title: str = "Hand places"
) -> Figure:
    """Draw the body once a place, with the hand there; the other places are small.

    Parameters
    ----------
    arms : (P, 2, 4, 3) array
        Of :func:`ikns.view.figures.arm_points`, one posture a place, m.
    places : (P, 3) array
        Where the hand is held, thorax frame, m.
    simulated : bool
    title : str
    """
    postures, points = np.asarray(arms, dtype=float), np.asarray(places, dtype=float)
    if postures.ndim != 4 or points.shape != (len(postures), 3):
        raise InvalidInput(
            "expected arms (P, 2, 4, 3) and places (P, 3), found "
            f"{postures.shape} and {points.shape}."
        )
    rows = -(-len(points) // _COLUMNS)
    turned = _AZIMUTH if points[:, 2].mean() >= 0 else 180 - _AZIMUTH
    with figure_style():
        figure = new_figure(title, simulated=simulated, height=2.1 * rows + 0.4)
        # The layout engine does not know the size of 3-D axes.
        figure.set_layout_engine("none")
        top = 1 - 0.4 / (2.1 * rows + 0.4)
        for k, posture in enumerate(postures):
            row, column = divmod(k, _COLUMNS)
            corner = (column / _COLUMNS, top * (1 - (row + 1) / rows))
            size = (1 / _COLUMNS, top / rows)
            axes: Any = figure.add_axes((*corner, *size), projection="3d")
            _draw(axes, posture, points, k)
            axes.view_init(elev=_ELEVATION, azim=turned)
            figure.text(
                corner[0] + 0.02, corner[1] + size[1] * 0.9, f"{k + 1}", weight="bold"
            )
    return figure


def _draw(axes: Any, posture: Array, places: Array, k: int) -> None:
    light = LightSource(azdeg=30 if places[:, 2].mean() >= 0 else 330, altdeg=50)
    for surface in body_surfaces(posture):
        axes.plot_surface(
            *np.moveaxis(surface, -1, 0)[_TO_DRAWING],
            color="#ECEEF1",
            lightsource=light,
            # With 2, facets have unequal numbers of corners, and matplotlib projects
            # whatever memory holds in place of the missing ones: sometimes a warning.
            rstride=1,
            cstride=1,
            linewidth=0,
            antialiased=False,
            zorder=1,
        )
    drawn = places.T[_TO_DRAWING]
    axes.scatter(*drawn, s=8, color=GREY, depthshade=False, zorder=5)
    axes.scatter(*drawn[:, [k]], s=70, color=[point_color(k)], edgecolors=INK, zorder=6)
    extent = np.concatenate([posture.reshape(-1, 3), places]).T[_TO_DRAWING]
    middle = (extent.min(axis=1) + extent.max(axis=1)) / 2
    middle[2] += 0.06  # the head is above the shoulders
    for name, center in zip("xyz", middle, strict=True):
        getattr(axes, f"set_{name}lim")(center - 0.36, center + 0.36)
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.set_proj_type("ortho")
    axes.computed_zorder = False
    axes.set_axis_off()
