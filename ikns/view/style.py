"""How every figure looks: colors, fonts, sizes, and the word "simulated"."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.style
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

# Okabe and Ito, "Color Universal Design" (2008): distinct with any color vision.
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
BLUE, RED, PURPLE, YELLOW = "#0072B2", "#D55E00", "#CC79A7", "#F0E442"
INK, GREY, PALE = "#222222", "#8A8A8A", "#E4E4E4"
#: The paper shows the interpolation volume in light red; it is drawn translucent.
VOLUME = "#CC2233"

#: Colors with their marks, for up to four series: distinct in shape and lightness too.
MARKS = ((BLUE, "o"), (ORANGE, "D"), (GREEN, "s"), (PURPLE, "^"))

#: Neighbors differ in lightness as well as in hue.
_CYCLE = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED, YELLOW)

#: Width of a full figure, inches; 100 pixels of the report's page each.
PAGE_WIDTH = 9.0

_STYLE = {
    "font.family": "sans-serif",
    # Ships with matplotlib, so every machine draws the same picture.
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "figure.facecolor": "white",
    "figure.titlesize": 11,
    "figure.titleweight": "bold",
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.1,
    "svg.fonttype": "path",
    # Otherwise the ids in an SVG are random.
    "svg.hashsalt": "ikns",
    "text.color": INK,
    # Dollar signs in a label do not start a formula.
    "text.parse_math": False,
    "xtick.color": GREY,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 7.5,
    "ytick.color": GREY,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 7.5,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw in this style, whatever the user's matplotlib settings are."""
    with matplotlib.style.context(["default", _STYLE]):
        yield


def new_figure(
    title: str, *, simulated: bool, height: float, width: float = PAGE_WIDTH
) -> Figure:
    """Return an empty figure (inches); its title says whether data are simulated."""
    # Inches around each panel.
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06)
    figure = Figure(figsize=(width, height), layout=layout)
    text = f"{title} (simulated subject)" if simulated else title
    figure.suptitle(text, x=0.008, ha="left")
    return figure


def outside_legend(figure: Figure, *panels: Any) -> None:
    """Add one legend for all panels, next to the title."""
    named: dict[str, Any] = {}
    for axes in panels:
        handles, names = axes.get_legend_handles_labels()
        named |= dict(zip(names, handles, strict=True))
    if named:
        figure.legend(
            list(named.values()),
            list(named),
            loc="outside upper right",
            ncols=len(named),
        )


def point_color(point: int) -> tuple[float, float, float]:
    """Return the color of a PCA point; after the seventh the hues repeat darker.

    >>> point_color(0) == point_color(7)
    False
    """
    darker = 0.62 ** (point // len(_CYCLE))
    red, green, blue = to_rgb(_CYCLE[point % len(_CYCLE)])
    return (red * darker, green * darker, blue * darker)


def joint_labels(joint_names: Sequence[str]) -> list[str]:
    """Return joint names as text, without the side if all share it.

    >>> joint_labels(["right_elbow_flexion", "right_wrist_flexion"])
    ['elbow flexion', 'wrist flexion']
    """
    words = [name.replace("_", " ") for name in joint_names]
    for side in ("right ", "left "):
        if words and all(word.startswith(side) for word in words):
            return [word.removeprefix(side) for word in words]
    return words
