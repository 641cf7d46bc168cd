"""A scene as PNG: by a browser where there is one, else by matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ikns.view.scene.browser import HOW_TO_GET_ONE, find_browser, screenshot
from ikns.view.scene.drawing import scene_drawing
from ikns.view.scene.page import scene_html
from ikns.view.scene.scene import Scene

__all__ = ["ScenePicture", "scene_picture"]

#: Size of the window, CSS pixels, and pixels of the picture per CSS pixel.
_WIDTH, _HEIGHT, _SCALE = 1100, 800, 1.5


class ScenePicture(NamedTuple):
    """A picture and a note on how it was drawn."""

    png: bytes
    note: str | None  # why it is plain and what to install; None from a browser


def scene_picture(
    scene: Scene, *, environ: Mapping[str, str] | None = None
) -> ScenePicture:
    """Draw a scene as it looks at its start; `environ` is for :func:`find_browser`."""
    browser = find_browser(environ)
    if browser is None:
        note = f"the picture is drawn plainly: {HOW_TO_GET_ONE}"
    else:
        taken = screenshot(
            browser, scene_html(scene), width=_WIDTH, height=_HEIGHT, scale=_SCALE
        )
        if taken is not None:
            return ScenePicture(taken, None)
        note = f"the picture is drawn plainly: {browser} took none"
    return ScenePicture(scene_drawing(scene, width=_WIDTH, height=_HEIGHT), note)
