"""Motion of the arm with the hand held: learned (ghosts along Z) and by the Jacobian.

Both pass through one posture at a PCA point, between the same ends m and M.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import SIDES, ChainLike, chain_joints, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import postures_along, self_motion
from ikns.view.scene.body import arm_links, ghost_commands
from ikns.view.scene.commands import ROOT, Command
from ikns.view.scene.places import trail_commands
from ikns.view.scene.playback import Track, body_tracks, pose_tracks
from ikns.view.style import INK, point_color

#: Control signals of the ghosts; the body is in the middle.
_STEPS = np.array([0.0, 0.25, 0.75, 1.0])
#: Duration of a sweep and its return, s.
_PERIOD = 6.0
_LINE = 0.0025  # radius of the elbow's and the hand's paths, m


@dataclass(frozen=True, eq=False)
class Swivel:
    """Postures with the hand (nearly) held at a PCA point."""

    point: int  # row of the map
    sweep: Array  # (N, 18) the hand held exactly, rad; from one end to the other
    c: Array  # (N,) the point's own control signal along the sweep
    ghosts: Array  # (4, 18) straight along Z, c from 0 to 1
    along: Array  # (N, 18) straight along Z, with the sweep's c
    middle: int  # row of the sweep that both pass through

    @classmethod
    def at(
        cls,
        skeleton: Skeleton,
        learned: NullSpaceMap,
        chain: ChainLike,
        point: int,
        q: Array,
    ) -> Swivel:
        """Postures through `q` (18,) at a point of a map."""
        sweep = self_motion(skeleton, learned, chain, point, q)
        columns = [skeleton.joint_names.index(joint) for joint in chain_joints(chain)]
        lower, upper = learned.lower_[point, 0], learned.upper_[point, 0]
        signal = sweep[:, columns] @ learned.directions_[point, 0] - lower
        # A point where nothing moved has no range, and no c.
        c = signal / (upper - lower) if upper > lower else np.zeros(len(sweep))
        return cls(
            point=point,
            sweep=sweep,
            c=c,
            ghosts=postures_along(skeleton, learned, chain, point, q, _STEPS),
            along=postures_along(skeleton, learned, chain, point, q, c),
            middle=int(np.argmin(np.abs(sweep - q).max(axis=1))),
        )

    @property
    def _outward_times(self) -> Array:
        """Times of the sweep's postures on the outward way, s: slow at both ends."""
        way = np.linspace(0.0, 1.0, len(self.sweep))
        return _PERIOD / 2 * np.arccos(1 - 2 * way) / np.pi

    @property
    def times(self) -> Array:
        """Times of the postures out and back, s; empty where nothing moves."""
        if len(self.sweep) < 2:
            return np.zeros(0)
        there = self._outward_times
        return np.concatenate([there, _PERIOD - there[-2::-1]])

    @property
    def start(self) -> float:
        """Time of the posture that both pass through, s."""
        return float(self._outward_times[self.middle]) if len(self.sweep) > 1 else 0.0

    @property
    def playing_c(self) -> Array:
        """Control signal at `times`."""
        return self._with_return(self.c) if len(self.sweep) > 1 else np.zeros(0)

    def _with_return(self, values: Array) -> Array:
        return np.concatenate([values, values[-2::-1]])


def swivel_commands(
    skeleton: Skeleton, swivel: Swivel, chain: ChainLike, *, playing: bool
) -> list[Command]:
    """Draw ghosts, paths of elbow and hand, and what moves.

    With `playing`, the body shows the sweep and one more ghost moves along Z; otherwise
    two translucent arms show the ends of the sweep.
    """
    links, color = arm_links(skeleton, chain), point_color(swivel.point)
    ghosts = f"{ROOT}/ghosts"
    commands = ghost_commands(
        ghosts, skeleton, swivel.ghosts, links, color, opacity=0.13, first_layer=1
    )
    layer = len(swivel.ghosts) + 1
    if playing:
        commands += ghost_commands(
            f"{ghosts}/moving",
            skeleton,
            swivel.along[[swivel.middle]],
            links,
            color,
            opacity=0.25,
            first_layer=layer,
        )
    else:
        commands += ghost_commands(
            f"{ROOT}/sweep",
            skeleton,
            swivel.sweep[[0, -1]],
            links,
            INK,
            opacity=0.2,
            first_layer=layer,
        )
    for side in chain_sides(chain):
        elbow = skeleton.link_in_thorax(swivel.sweep, f"{side}_forearm")[0]
        fine = skeleton.link_in_thorax(swivel.along, f"{side}_forearm")[0]
        hand = skeleton.hands_in_thorax(swivel.along)[0][:, SIDES.index(side)]
        for path, places, ink in (
            (f"{ROOT}/sweep/{side}_elbow", elbow, INK),
            (f"{ghosts}/{side}_elbow", fine, color),
            (f"{ghosts}/{side}_hand", hand, color),
        ):
            commands += trail_commands(
                path, places, color=ink, radius=_LINE, on_top=True
            )
    return commands


def swivel_tracks(skeleton: Skeleton, swivel: Swivel, chain: ChainLike) -> list[Track]:
    """Tracks of the body along the sweep and of the moving ghost along Z."""
    if len(swivel.sweep) < 2:
        return []
    links = arm_links(skeleton, chain)
    sweep, along = swivel._with_return(swivel.sweep), swivel._with_return(swivel.along)
    return body_tracks(skeleton, sweep) + pose_tracks(
        skeleton, along, links, f"{ROOT}/ghosts/moving/0"
    )
