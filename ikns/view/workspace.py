"""The paper's figure: path of the hand, and where the null space was learned."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LightSource, to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput
from ikns.view.arrays import outward
from ikns.view.body import body_surfaces
from ikns.view.style import (
    BLUE,
    GREY,
    INK,
    VOLUME,
    figure_style,
    new_figure,
    point_color,
)

#: Thorax frame (X forward, Y up, Z right) to the drawing's right, forward, up.
_TO_DRAWING = [2, 0, 1]
_MARGIN = 0.04  # m around everything that is drawn
_ELEVATION, _AZIMUTH = 17.0, 38.0  # of the viewer, deg above and to the right of front
_NUMBER_AWAY = 0.13  # from its PCA point, share of the volume's radius


def workspace_figure(
    hand: ArrayLike,
    samples: ArrayLike,
    labels: ArrayLike,
    centers: ArrayLike,
    *,
    simulated: bool,
    facets: ArrayLike | None = None,
    arms: ArrayLike | None = None,
) -> Figure:
    """Draw the path of the hand, and the clusters and the interpolation volume.

    Parameters
    ----------
    hand : (T, 3) array
        Where the hand was, m in the thorax frame; NaN breaks the line.
    samples : (N, 3) array
        Still samples, likewise.
    labels : (N,) integer array
        PCA point of each sample, -1 where it was discarded.
    centers : (P, 3) array
        PCA points, m; numbered from 1 in the figure.
    facets : (F, 3) integer array, optional
        Triangles of the interpolation volume, as rows of `centers`.
    arms : (2, 4, 3) array, optional
        Both arms (see :func:`ikns.view.body.arm_points`); draws a body behind.
    """
    path, still = _points(hand, "hand"), _points(samples, "samples")
    point = _points(centers, "centers")
    of_sample = np.asarray(labels)
    if of_sample.shape != (len(still),):
        raise InvalidInput(
            f"expected one label for each of {len(still)} samples, "
            f"found {of_sample.shape}."
        )
    body = [] if arms is None else body_surfaces(arms)
    rightwards = bool(np.mean(point[:, 2]) >= 0)
    with figure_style():
        figure = new_figure(
            "Hand in the thorax frame, and where the null space was learned",
            simulated=simulated,
            height=5.0,
        )
        # The layout engine does not know the size of 3-D axes.
        figure.set_layout_engine("none")
        left: Any = figure.add_axes((0.0, 0.06, 0.48, 0.85), projection="3d")
        right: Any = figure.add_axes((0.5, 0.06, 0.48, 0.85), projection="3d")
        _draw_body(left, body, rightwards=rightwards)
        _draw_volume(left, point, facets)
        left.plot(*_drawn(path), color=BLUE, lw=0.7, alpha=0.7, zorder=6, label="hand")
        _frame(left, [path, point, *body], rightwards=rightwards, tick=0.2)
        _draw_volume(right, point, facets)
        _draw_samples(right, still, of_sample, len(point))
        _draw_points(right, point)
        _frame(right, [still, point], rightwards=rightwards, tick=0.1)
        went = np.isfinite(path).any()
        _title(figure, left, f"a   where the {'hand went' if went else 'volume is'}")
        _title(figure, right, "b   still samples, colored by PCA point")
        _legend(figure, right)
    return figure


def _points(values: ArrayLike, name: str) -> Array:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidInput(f"expected {name} (n, 3), found {array.shape}.")
    return array


def _drawn(points: Array) -> Array:
    """Coordinates along the drawing's three axes, first axis first."""
    return np.moveaxis(points, -1, 0)[_TO_DRAWING]


def _draw_body(axes: Any, surfaces: list[Array], *, rightwards: bool) -> None:
    light = LightSource(azdeg=30 if rightwards else 330, altdeg=50)
    for surface in surfaces:
        axes.plot_surface(
            *_drawn(surface),
            color="#ECEEF1",
            rstride=1,
            cstride=1,
            linewidth=0,
            antialiased=False,
            lightsource=light,
            zorder=1,
        )


def _draw_volume(axes: Any, centers: Array, facets: ArrayLike | None) -> None:
    if facets is None or not len(np.asarray(facets)):
        return
    axes.plot_trisurf(
        *_drawn(centers),
        triangles=np.asarray(facets),
        color=to_rgba(VOLUME, 0.12),
        edgecolor=to_rgba(VOLUME, 0.35),
        linewidth=0.6,
        shade=False,
        zorder=5,
        label="interpolation volume",
    )


def _draw_samples(axes: Any, samples: Array, labels: Array, n_points: int) -> None:
    dots = {"s": 12, "linewidths": 0, "depthshade": False}
    if (labels < 0).any():
        axes.scatter(
            *_drawn(samples[labels < 0]),
            color=GREY,
            alpha=0.35,
            zorder=6,
            label="still, discarded",
            **dots,
        )
    for point in range(n_points):
        axes.scatter(
            *_drawn(samples[labels == point]),
            color=[point_color(point)],
            alpha=0.5,
            zorder=7,
            label=f"point {point + 1}",
            **dots,
        )


def _draw_points(axes: Any, centers: Array) -> None:
    axes.scatter(
        *_drawn(centers),
        marker="+",
        s=28,
        color=INK,
        linewidths=1.0,
        depthshade=False,
        zorder=8,
        label="PCA point",
    )
    # Numbers are outside the volume, so that no sample is hidden.
    radius = float(np.linalg.norm(centers - centers.mean(axis=0), axis=1).max())
    places = centers + _NUMBER_AWAY * max(0.1, radius) * outward(centers)
    axes.scatter(
        *_drawn(places),
        s=90,
        color="white",
        edgecolors=[point_color(point) for point in range(len(centers))],
        linewidths=1.6,
        depthshade=False,
        zorder=9,
        label="number",
    )
    for point, place in enumerate(places):
        axes.text(
            *_drawn(place),
            str(point + 1),
            ha="center",
            va="center",
            fontsize=6,
            fontweight="bold",
            zorder=10,
        )


def _frame(axes: Any, drawn: list[Array], *, rightwards: bool, tick: float) -> None:
    points = np.vstack([part.reshape(-1, 3) for part in drawn])
    low = _drawn(np.nanmin(points, axis=0) - _MARGIN)
    high = _drawn(np.nanmax(points, axis=0) + _MARGIN)
    for name, start, end in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{name}lim")(start, end)
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(MultipleLocator(tick))
        axis.set_pane_color((1, 1, 1, 0))
        axis.labelpad = -1
    axes.tick_params(pad=-1)
    axes.set_box_aspect(high - low, zoom=_zoom(high - low))
    axes.set_proj_type("ortho")
    # Otherwise matplotlib orders whole artists by their mean depth.
    axes.computed_zorder = False
    # From the front, on the side of the hand that moves.
    axes.view_init(elev=_ELEVATION, azim=_AZIMUTH if rightwards else 180 - _AZIMUTH)
    axes.set_xlabel("Z right (m)")
    axes.set_ylabel("X forward (m)")
    axes.set_zlabel("Y up (m)")


def _zoom(size: Array) -> float:
    """Shrink long and tall boxes: matplotlib scales by the diagonal alone."""
    turn, tilt = np.deg2rad([_AZIMUTH, _ELEVATION])
    right, forward, up = size / np.linalg.norm(size)
    width = right * np.sin(turn) + forward * np.cos(turn)
    depth = right * np.cos(turn) + forward * np.sin(turn)
    height = up * np.cos(tilt) + depth * np.sin(tilt)
    # Found by trial to fit the panels with their tick labels.
    return float(min(1.0, 0.85 / width, 0.8 / height))


def _title(figure: Figure, axes: Any, text: str) -> None:
    figure.text(axes.get_position().x0 + 0.012, 0.9, text, fontweight="bold")


def _legend(figure: Figure, axes: Any) -> None:
    handles, names = axes.get_legend_handles_labels()
    named = dict(zip(names, handles, strict=True))
    shown = [
        n
        for n in ("PCA point", "interpolation volume", "still, discarded")
        if n in named
    ]
    figure.legend(
        [named[name] for name in shown],
        shown,
        loc="lower right",
        ncols=3,
        markerscale=1.6,
        borderaxespad=0.3,
    )
