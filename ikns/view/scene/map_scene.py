"""The scene of a map: its PCA points, and the self-motion of the arm at one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_hex

from ikns.arrays import Indices
from ikns.body.chains import ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import posture_at_point, visited_posture
from ikns.nullspace.signal_names import signal_names
from ikns.view.scene.body import body_commands, marker_commands
from ikns.view.scene.commands import ROOT, Command, property_command, root_commands
from ikns.view.scene.ground import GROUND, ground_commands
from ikns.view.scene.places import point_commands, volume_commands
from ikns.view.scene.playback import animation_command
from ikns.view.scene.scene import Layer, Scene, camera_and_target
from ikns.view.scene.swivel import Swivel, swivel_commands, swivel_tracks
from ikns.view.style import INK, VOLUME, point_color

#: Legend entry of objects in many colors.
_MANY = "conic-gradient({} 33%, {} 0 67%, {} 0)".format(
    *(to_hex(point_color(k)) for k in range(3))
)


def map_scene(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: ChainLike,
    *,
    simulated: bool,
    title: str = "Null-space map",
    point: int | None = None,
) -> Scene:
    """Scene of a map: body, PCA points, volume, ghosts along Z, sweep of the elbow.

    The body plays the sweep: the hand is held while c goes from 0 to 1 and back. One
    ghost moves along Z with the same c.

    Parameters
    ----------
    skeleton : Skeleton
    learned : NullSpaceMap
    chain : str
        Joints of the map.
    simulated : bool
        Whether the map comes from a virtual subject; the page says so.
    title : str
    point : int, optional
        Row of ``learned.centers_`` at which the body is drawn. Default: the point with
        the widest range.

    Raises
    ------
    InvalidInput
        When there is no such point.
    """
    chosen = chosen_point(learned, point)
    visited = visited_posture(skeleton, learned, chain, chosen)
    q = posture_at_point(skeleton, learned, chain, chosen, start=visited)
    two = len(chain_sides(chain)) > 1
    swivel = Swivel.at(skeleton, learned, chain, chosen, q)
    tracks = swivel_tracks(skeleton, swivel, chain)
    camera = camera_and_target(skeleton, learned, chain, q)
    commands = [
        *root_commands(),
        *body_commands(skeleton, q, chain),
        *marker_commands(skeleton),
        *map_commands(learned),
        *ground_commands(learned.centers_, *camera),
        *swivel_commands(skeleton, swivel, chain, playing=True),
    ]
    layers = map_layers(skeleton, learned, chosen)
    if tracks:
        commands.append(animation_command(swivel.times, tracks))
    return Scene(
        title,
        f"{'Arms' if two else 'Arm'} at PCA point {chosen + 1} with the "
        f"{'hands' if two else 'hand'} held: the Jacobian's self-motion "
        "(body) next to the learned direction Z (ghosts)."
        # A subject folder holds hand positions, but no postures.
        + ("" if visited is not None else " The posture is assumed."),
        simulated,
        commands + hidden(layers),
        layers,
        *camera,
        times=swivel.times,
        c=swivel.playing_c,
        start=swivel.start,
        signals=tuple(signal_names(learned.n_dof)[:1]),  # only the first freedom moves
    )


def chosen_point(learned: NullSpaceMap, point: int | None) -> int:
    """Return `point`, or the PCA point whose range M - m is the widest."""
    if point is None:
        return int(np.argmax((learned.upper_ - learned.lower_)[:, 0]))
    if not 0 <= point < len(learned.centers_):
        raise InvalidInput(
            f"expected a PCA point from 1 to {len(learned.centers_)}, "
            f"found {point + 1}."
        )
    return point


def map_commands(learned: NullSpaceMap) -> list[Command]:
    """Draw the PCA points of a map and the volume between them."""
    return [
        *point_commands(learned.centers_),
        *volume_commands(learned.centers_, _facets(learned)),
    ]


def map_layers(
    skeleton: Skeleton, learned: NullSpaceMap, point: int, *, playing: bool = False
) -> list[Layer]:
    """Return the layers of a map; `playing` hides those at one point."""
    links = dict.fromkeys(m.link for m in skeleton.marker_set.markers)
    worn = tuple(f"{ROOT}/body/{link}/markers" for link in links)
    ghost = to_hex(point_color(point))
    where = f" at point {point + 1}" if playing else ""
    layers = [
        Layer("markers of the model", worn, "#4A4F57", shown=False),
        Layer("PCA points", (f"{ROOT}/points",), _MANY),
        Layer(f"along learned Z{where}", (f"{ROOT}/ghosts",), ghost, not playing),
        Layer(f"self-motion (Jacobian){where}", (f"{ROOT}/sweep",), INK, not playing),
        GROUND,
    ]
    if len(_facets(learned)):
        layers.insert(2, Layer("interpolation volume", (f"{ROOT}/volume",), VOLUME))
    return layers


def hidden(layers: Sequence[Layer]) -> list[Command]:
    """Hide the layers that are not shown at first."""
    return [
        property_command(path, "visible", False)
        for layer in layers
        if not layer.shown
        for path in layer.paths
    ]


def _facets(learned: NullSpaceMap) -> Indices:
    """Triangles of the volume as rows of the points, (F, 3); none around 1 to 3."""
    none = np.zeros((0, 3), dtype=np.int64)
    return np.asarray(getattr(learned.interpolator_, "hull_facets", none))
