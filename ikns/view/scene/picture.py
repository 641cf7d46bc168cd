"""A scene as PNG: by a browser without a window where there is one, else matplotlib."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ikns.view.scene.drawing import scene_drawing
from ikns.view.scene.page import scene_html
from ikns.view.scene.scene import Scene

HOW_TO_GET_ONE = (
    "no Chromium or Chrome found; get one with `apt install chromium`, or name yours "
    "in the environment variable CHROME"
)
_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
)
#: WebGL in software, and no network access of its own.
_OPTIONS = (
    "--headless",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-gpu-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--disable-dev-shm-usage",
)
_LONGEST = 60.0  # s for one picture
#: Size of the window, CSS pixels, and pixels of the picture per CSS pixel.
_WIDTH, _HEIGHT, _SCALE = 1100, 800, 1.5


def find_browser(environ: Mapping[str, str] | None = None) -> str | None:
    """Path of a Chromium or Chrome: that in ``CHROME``, else the first on ``PATH``.

    >>> find_browser({"PATH": ""}) is None
    True
    """
    known = os.environ if environ is None else environ
    wanted = known.get("CHROME")
    for name in (wanted,) if wanted else _NAMES:
        found = shutil.which(name, path=known.get("PATH", ""))
        if found:
            return found
    return None


def browser_options() -> list[str]:
    """Options with which a browser draws 3-D on a machine without a screen."""
    # Chromium has no sandbox for root. The page is ours and loads nothing.
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return [*_OPTIONS, *(["--no-sandbox"] if root else [])]


def screenshot(
    browser: str, page: str, *, width: int, height: int, scale: float = 2.0
) -> bytes | None:
    """Picture of a page of HTML as PNG, or None when the browser made none.

    Width and height of the window are in CSS pixels, the scale is pixels of the picture
    per CSS pixel.
    """
    with tempfile.TemporaryDirectory(
        prefix="ikns-view-", ignore_cleanup_errors=True
    ) as folder:
        place = Path(folder).resolve()
        picture = place / "page.png"
        (place / "page.html").write_text(page, encoding="utf-8")
        command = [
            browser,
            *browser_options(),
            f"--user-data-dir={place / 'profile'}",
            f"--window-size={width},{height}",
            f"--force-device-scale-factor={scale:g}",
            # Virtual time gives a slow machine enough time to draw.
            "--virtual-time-budget=4000",
            f"--screenshot={picture}",
            (place / "page.html").as_uri() + "#picture",
        ]
        try:
            subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=_LONGEST,
                check=True,
            )
            return picture.read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None


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
