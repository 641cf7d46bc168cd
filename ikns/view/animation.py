"""A scene as a moving picture: the arm moves, c with it, and the finger follows c."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ikns.arrays import Array
from ikns.body.chains import ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.view.scene.commands import ROOT, property_command
from ikns.view.scene.drawing import draw_scene
from ikns.view.scene.finger import finger_path, flexion_commands, with_finger
from ikns.view.scene.scene import Scene
from ikns.view.style import BLUE, GREY, PALE, figure_style

#: Endings, and what Pillow calls them. An animated PNG shows its first frame where a
#: program does not know how to move it.
FORMATS = {".gif": "GIF", ".png": "PNG"}
#: Seconds that one picture shows at most; longer ones are too large for a page.
LONGEST = 20.0
#: Frames per second: GIF counts in hundredths of a second.
_RATE = 10.0
_WIDTH, _HEIGHT = 640, 460  # pixels
_FINE = 2  # drawn larger by this factor and averaged, so that edges are smooth
_COLORS = 128
#: Layers that are about the map or the room; here arm and finger are to be seen.
_HIDDEN = tuple(
    f"{ROOT}/{name}" for name in ("ghosts", "points", "volume", "trail", "ground")
)


def animation_bytes(
    scene: Scene,
    skeleton: Skeleton,
    chain: ChainLike,
    *,
    caption: str,
    format: str = "GIF",
) -> bytes:
    """Draw a scene that moves, frame by frame, with c below it.

    Parameters
    ----------
    scene : Scene
        With an animation.
    skeleton : Skeleton
    chain : str
        The first of its arms wears a finger that bends with c, clipped to 0 to 1; where
        c is unknown the finger holds.
    caption : str
        A line under the title of the scene.
    format : {"GIF", "PNG"}

    Returns
    -------
    bytes
        640 by 460 pixels, ten frames a second, repeated without end.

    Raises
    ------
    InvalidInput
        When nothing moves, or for longer than 20 s.
    """
    if len(scene.times) < 2:
        raise InvalidInput("expected a scene that moves, found one that stands still.")
    length = float(scene.times[-1] - scene.times[0])
    if length > LONGEST:
        raise InvalidInput(
            f"expected at most {LONGEST:g} s for a moving picture, found {length:.1f} "
            "s; choose a part with --from and --to."
        )
    times = np.arange(scene.times[0], scene.times[-1], 1 / _RATE)
    c = _at(scene, times)
    flexion = np.clip(_held(c), 0.0, 1.0)
    side = chain_sides(chain)[0]
    worn = with_finger(replace(scene, caption=caption), skeleton, side)
    commands = [
        *worn.commands,
        *(property_command(path, "visible", False) for path in _HIDDEN),
    ]
    frames = []
    for k, time in enumerate(times):
        bent = flexion_commands(finger_path(side), float(flexion[k]))
        shown = replace(worn, commands=commands + bent, start=float(time), layers=[])
        frames.append(_frame(shown, times, c, k))
    stream = io.BytesIO()
    # One palette for all, of a frame in the middle: colors then do not flicker.
    palette = frames[len(frames) // 2].quantize(_COLORS)
    still = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    still[0].save(
        stream,
        format,
        save_all=True,
        append_images=still[1:],
        duration=round(1000 / _RATE),
        loop=0,
        optimize=True,
    )
    return stream.getvalue()


def _at(scene: Scene, times: Array) -> Array:
    """First control signal at the played frame that is the nearest to each time."""
    nearest = np.abs(scene.times[:, None] - times).argmin(axis=0)
    return np.asarray(scene.columns[0][nearest])


def _held(c: Array) -> Array:
    """Replace unknown values by the one before, at the start by 0.

    >>> _held(np.array([np.nan, 0.2, np.nan, 0.4]))
    array([0. , 0.2, 0.2, 0.4])
    """
    known = np.where(np.isfinite(c), np.arange(1, len(c) + 1), 0)
    return np.asarray(np.concatenate([[0.0], c])[np.maximum.accumulate(known)])


def _frame(scene: Scene, times: Array, c: Array, k: int) -> Image.Image:
    """Draw one frame: the body, and c up to now."""
    dpi = 100 * _FINE
    with figure_style():
        figure = Figure(figsize=(_WIDTH / 100, _HEIGHT / 100), dpi=dpi)
        canvas = FigureCanvasAgg(figure)
        body: Any = figure.add_axes((-0.15, 0.1, 1.3, 0.92), projection="3d")
        draw_scene(body, scene)
        curve = figure.add_axes((0.09, 0.06, 0.88, 0.15))
        curve.axhspan(0, 1, color=PALE, alpha=0.5, lw=0)
        curve.plot(times[: k + 1], c[: k + 1], color=BLUE, lw=2)
        curve.plot(times[k], c[k], "o", color=BLUE, ms=6)
        low, high = np.nanmin(np.append(c, 0.0)), np.nanmax(np.append(c, 1.0))
        curve.set(xlim=(times[0], times[-1]), ylim=(low - 0.1, high + 0.1))
        curve.set(yticks=[0, 1], xticks=[], ylabel=scene.signals[0])
        word = " (simulated subject)" if scene.simulated else ""
        figure.text(0.015, 0.945, scene.title + word, fontweight="bold", size=10.5)
        figure.text(0.015, 0.905, scene.caption, color=GREY)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    return Image.fromarray(pixels).resize((_WIDTH, _HEIGHT), Image.Resampling.BOX)
