"""The 3-D view: a scene as plain data, and what shows it.

:func:`map_scene` and :func:`recording_scene` make a :class:`Scene`,
:func:`with_finger` adds a finger to a forearm. :func:`scene_html` turns a scene into a
self-contained page, :func:`scene_picture` into a PNG, and :class:`LiveView` shows it in
the browser while it moves.
"""

from ikns.view.scene.finger import with_finger
from ikns.view.scene.following import body_view
from ikns.view.scene.live import LiveView
from ikns.view.scene.map_scene import map_scene
from ikns.view.scene.page import scene_html
from ikns.view.scene.picture import ScenePicture, scene_picture
from ikns.view.scene.recording_scene import recording_scene
from ikns.view.scene.scene import Layer, Scene

__all__ = [
    "Layer",
    "LiveView",
    "Scene",
    "ScenePicture",
    "body_view",
    "map_scene",
    "recording_scene",
    "scene_html",
    "scene_picture",
    "with_finger",
]
