"""The pictures of the documentation, all of one virtual subject."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ikns.arrays import Array
from ikns.body.chains import chain_joints
from ikns.calibration.subject import Subject
from ikns.experiments.demo import Demo, run_demo
from ikns.nullspace.self_motion import posture_at_point
from ikns.view.animation import animation_bytes
from ikns.view.figures import (
    arm_points,
    control_figure,
    directions_figure,
    hand_places_figure,
    methods_figure,
    residual_figure,
    swivel_figure,
    workspace_figure,
)
from ikns.view.scene import map_scene, scene_picture
from ikns.view.style import figure_style

#: Dots per inch of a figure: 810 pixels for a page of 9 inches.
_DPI = 90
#: The place in the middle of the upper face, before the chest: the arm hides nothing.
_SEEN_WELL = 8
#: Names of the pictures, in the order of the line of data.
PICTURES = (
    *("elbow.gif", "scene.png", "places.png", "workspace.png", "directions.png"),
    *("swivel.png", "control.png", "methods.png", "residual.png"),
)


def gallery(
    *,
    seed: int = 1,
    quick: bool = False,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> dict[str, bytes]:
    """Draw the pictures of the documentation.

    Parameters
    ----------
    seed : int
        Which virtual subject.
    quick : bool
        A shorter calibration.
    progress : callable
        Called with (step, done, total).

    Returns
    -------
    dict of str to bytes
        Pictures by their names, :data:`PICTURES`.
    """
    with tempfile.TemporaryDirectory() as folder:
        demo = run_demo(Path(folder), seed=seed, quick=quick, progress=progress)
    person = demo.subject
    scene, moving = (
        map_scene(
            person.skeleton,
            person.null_space_map,
            person.chain,
            simulated=True,
            title="Null-space map",
            point=point,
        )
        for point in (None, _SEEN_WELL)
    )
    drawn = {
        "elbow.gif": animation_bytes(
            moving,
            person.skeleton,
            person.chain,
            caption="The elbow swivels with the hand held; the finger bends with c.",
        ),
        "scene.png": _small(scene_picture(scene).png),
    }
    for name, figure in _figures(demo).items():
        drawn[f"{name}.png"] = _png(figure)
    return {name: drawn[name] for name in PICTURES}


def places_figure(subject: Subject, *, simulated: bool) -> Figure:
    """Draw where a person held the hand: the body at each PCA point of the map.

    Postures are not kept in a subject folder; drawn is one with the hand there in the
    middle of the range.
    """
    centers = subject.null_space_map.centers_
    arms = [_arms(subject, point) for point in range(len(centers))]
    return hand_places_figure(
        arms,
        centers,
        simulated=simulated,
        title=f"The {len(arms)} places of the hand",
    )


def _arms(subject: Subject, point: int) -> Array:
    """Both arms with the hand at a PCA point, (2, 4, 3) m."""
    body, learned, chain = subject.skeleton, subject.null_space_map, subject.chain
    return arm_points(body, posture_at_point(body, learned, chain, point))


def _figures(demo: Demo) -> dict[str, Figure]:
    subject, reaching, still = demo.subject, demo.reaching, demo.still
    learned, chain, motion = subject.null_space_map, subject.chain, subject.motions[0]
    curves, place = demo.curves, reaching.task_position(subject.chain)
    return {
        "places": places_figure(subject, simulated=True),
        "workspace": workspace_figure(
            motion.task_position(chain),
            still.hand,
            still.labels,
            learned.centers_,
            facets=getattr(learned.interpolator_, "hull_facets", None),
            arms=_arms(subject, 0),
            simulated=True,
        ),
        "directions": directions_figure(
            learned.directions_, chain_joints(chain), simulated=True
        ),
        "swivel": swivel_figure(
            still.swivel, still.c, still.labels, still.correlations, simulated=True
        ),
        "control": control_figure(
            reaching.time,
            learned.control_signal(reaching.chain_angles(chain), place),
            reaching.hand_speed(chain),
            learned.inside(place),
            gate=0.05,
            simulated=True,
        ),
        "methods": methods_figure(
            *(curves.reach_time, curves.reach, curves.turn),
            *(curves.turned, curves.swivel, curves.held),
            simulated=True,
        ),
        "residual": residual_figure(motion.time, motion.residual, simulated=True),
    }


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    # matplotlib multiplies the unused corners of its polygons too, which hold anything.
    with figure_style(), np.errstate(over="ignore"):
        figure.savefig(stream, format="png", dpi=_DPI, metadata={"Software": None})
    return stream.getvalue()


def _small(picture: bytes) -> bytes:
    """Make a picture half as wide and high."""
    stream = io.BytesIO()
    large = Image.open(io.BytesIO(picture)).convert("RGB")
    large.reduce(2).save(stream, "PNG", optimize=True)
    return stream.getvalue()
