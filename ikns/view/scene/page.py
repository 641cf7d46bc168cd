"""A scene as one HTML file that loads nothing: MeshCat's viewer, the scene, a slider.

MeshCat's own export needs its server and a web socket; the viewer itself does not.
"""

from __future__ import annotations

import base64
import json
from functools import cache
from html import escape
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ikns.errors import FileError, plain
from ikns.view.scene.scene import FIELD_OF_VIEW, Scene

#: Arrays up to this size are written as numbers.
_SHORT = 16
#: Shown over the curve of c; the gray box goes from 0 to 1.
_CURVE = (
    "c before clipping: the finger gets 0 below and 1 above the gray box; beyond "
    "-0.15 and 1.15 the line leaves the picture"
)
_KINDS = {"f": ("<f4", "f4"), "u": ("<u4", "u4"), "i": ("<u4", "u4")}


def scene_html(scene: Scene, *, live: str | None = None) -> str:
    """Return the page; the same scene gives the same text.

    Poses may be sent from a live address on the same server
    (:class:`ikns.view.scene.live.LiveView`). Without MeshCat's viewer, a FileError.
    """
    data = {
        "commands": scene.commands,
        "layers": [layer.__dict__ for layer in scene.layers],
        "camera": scene.camera,
        "target": scene.target,
        "fov": FIELD_OF_VIEW,
        "times": np.asarray(scene.times, dtype=np.float32),
        "signals": scene.signals,
        "c": [np.asarray(column, dtype=np.float32) for column in scene.columns],
        "speed": np.asarray(scene.speed, dtype=np.float32),
        "start": scene.start,
        "live": live,
    }
    here = files("ikns.view.scene")
    style, script = (
        here.joinpath(name).read_text(encoding="utf-8")
        for name in ("page.css", "page.js")
    )
    # The browser itself refuses everything else.
    policy = (
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        f"img-src data: blob:{'; connect-src ' + repr('self') if live else ''}"
    )
    badge = '<p class="badge">Simulated subject</p>' if scene.simulated else ""
    title = escape(scene.title)
    rows = "".join(
        f"""<div class="signal">
<span class="name">{name}<small>control signal before clipping</small></span>
<div id="{name}_curve" class="curve" title="{_CURVE}"></div>
<output id="{name}"></output>
<div id="{name}_gauge" class="gauge"><i></i></div></div>
"""
        for name in scene.signals
    )
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}{" (simulated)" if scene.simulated else ""}</title>
<style>
{style}</style></head><body>
<header id="head">{badge}<h1>{title}</h1><p>{escape(scene.caption)}</p></header>
<details id="legend"><summary>Layers</summary><ul></ul></details>
<main id="pane" tabindex="0" aria-label="Body in 3-D; arrow keys turn it"></main>
<footer id="player" hidden>
<button id="play" type="button" aria-label="Play">&#9654;</button>
<input id="time" type="range" min="0" step="any" value="0" aria-label="Time">
<output id="clock"></output>
{rows}<span class="name speed">hand<small>speed, m/s</small></span>
<div id="speed_curve" class="curve speed"></div>
<output id="speed" class="speed"></output></footer>
<p id="fault" role="alert" hidden></p>
<script id="scene" type="application/json">{packed_json(data)}</script>
<script>
{_viewer()}
</script>
<script>
{script}</script>
</body></html>
"""


def packed_json(value: Any) -> str:
    """Return JSON to embed in a page; long arrays are base64 of float32.

    >>> packed_json({"matrix": np.eye(2)})
    '{"matrix":[[1.0,0.0],[0.0,1.0]]}'
    >>> packed_json(np.zeros(17, dtype=np.float32))[:24]
    '{"$":"f4","data":"AAAAAA'
    """
    text = json.dumps(value, default=_packed, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def _packed(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        raise TypeError(f"a scene holds no {type(value).__name__}")
    if value.size <= _SHORT and np.isfinite(value).all() and value.size:
        return value.tolist()
    stored, name = _KINDS[value.dtype.kind]
    if value.dtype == np.uint8:
        stored = name = "u1"
    data = np.ascontiguousarray(value, dtype=stored).tobytes()
    return {"$": name, "data": base64.b64encode(data).decode("ascii")}


@cache
def _viewer() -> str:
    # Not imported: that would load IPython and a message queue.
    package = find_spec("meshcat")
    folder = Path((package and package.origin) or "meshcat").parent
    file = folder / "viewer" / "dist" / "main.min.js"
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(
            f"{file}: MeshCat's viewer cannot be read ({plain(error)}); "
            "install meshcat again."
        ) from None
    return text.replace("</script", "<\\/script")
