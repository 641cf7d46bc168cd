"""Animation: tracks that a player interpolates, and the command that plays them.

A track moves one node. Times are seconds from the first frame, shared by all tracks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array, Indices, Mask
from ikns.body.skeleton import Skeleton
from ikns.view.scene.body import drawn_links
from ikns.view.scene.commands import ROOT, Command

#: Frames in one page at most: 15 MB of tracks for a body with 24 markers.
MOST_FRAMES = 18_000


@dataclass(frozen=True, eq=False)
class Track:
    """How a node moves in its parent.

    Neighboring quaternions have one sign, as a player interpolates between them. A
    hidden node keeps its last place.
    """

    path: str
    position: Array  # (F, 3) m
    quaternion: Array | None = None  # (F, 4) x, y, z, w
    visible: Mask | None = None  # (F,)


def kept_frames(time: Array, *, rate: float = 30.0) -> Indices:
    """Return the frames to play: every n-th, so that about `rate` per second remain.

    Never more than 18 000 (ten minutes at 30/s).

    >>> kept_frames(np.arange(10) / 100.0)
    array([0, 3, 6, 9])
    """
    if len(time) < 2:
        return np.arange(len(time))
    step = float(np.median(np.diff(time)))
    every = max(1, round(1 / (rate * step)), -(-len(time) // MOST_FRAMES))
    return np.arange(0, len(time), every)


def body_tracks(skeleton: Skeleton, q: Array) -> list[Track]:
    """Tracks of a body that takes the postures (F, 18 or 25)."""
    names = drawn_links(skeleton)
    return pose_tracks(skeleton, q, names, f"{ROOT}/body")


def pose_tracks(
    skeleton: Skeleton, q: Array, links: list[str], path: str
) -> list[Track]:
    """Tracks of ``<path>/<link>`` for links at postures (F, 18 or 25).

    An unknown posture (NaN) is drawn as the one before it, or the first known.
    """
    known = np.all(np.isfinite(q), axis=1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(q)), 0))
    held = q[np.where(known[last], last, int(np.argmax(known)))]
    tracks = []
    for link in links:
        position, rotation = skeleton.link_in_thorax(held, link)
        tracks.append(Track(f"{path}/{link}", position, _quaternions(rotation)))
    return tracks


def markers_in_thorax(markers: Array, q: Array) -> Array:
    """Transform markers in the world (F, M, 3) m to the thorax frame of `q` (F, 25)."""
    unknown = ~np.all(np.isfinite(q[:, :7]), axis=1)
    turn = np.where(unknown[:, None], [0.0, 0, 0, 1], q[:, 3:7])
    rotation = Rotation.from_quat(turn).as_matrix()
    seen = np.einsum("fji,fmj->fmi", rotation, markers - q[:, None, :3])
    seen[unknown] = np.nan
    return np.asarray(seen)


def marker_tracks(places: Array, labels: tuple[str, ...], path: str) -> list[Track]:
    """Tracks of ``<path>/<label>`` for places (F, M, 3) m; NaN is not shown."""
    tracks = []
    for m, label in enumerate(labels):
        seen = np.all(np.isfinite(places[:, m]), axis=1)
        if not seen.any():
            continue
        last = np.maximum.accumulate(np.where(seen, np.arange(len(seen)), 0))
        held = places[np.where(seen[last], last, int(np.argmax(seen))), m]
        tracks.append(
            Track(f"{path}/{label}", held, visible=None if seen.all() else seen)
        )
    return tracks


def animation_command(times: Array, tracks: list[Track]) -> Command:
    """Play tracks at `times` (F,) s in a loop, paused at first."""
    when = np.asarray(times, dtype=np.float32)

    def clip(track: Track) -> Command:
        curves = [("position", "vector3", track.position)]
        if track.quaternion is not None:
            curves.append(("quaternion", "quaternion", track.quaternion))
        parts: list[Command] = [
            {
                "name": f".{name}",
                "type": kind,
                "times": when,
                "values": np.asarray(values, dtype=np.float32).ravel(),
            }
            for name, kind, values in curves
        ]
        if track.visible is not None:
            parts.append(
                {
                    "name": ".visible",
                    "type": "bool",
                    "times": when,
                    "values": track.visible.astype(np.uint8),
                }
            )
        # Three.js counts times in frames of a clip: at 1 fps they are seconds.
        return {"fps": 1, "name": track.path, "tracks": parts}

    return {
        "type": "set_animation",
        "animations": [{"path": t.path, "clip": clip(t)} for t in tracks],
        # JSON has no infinity; 10^9 repetitions are as good.
        "options": {"play": False, "repetitions": 10**9},
    }


def _quaternions(rotation: Array) -> Array:
    """Quaternions (F, 4) of rotations (F, 3, 3), without jumps to the other sign."""
    quaternion = Rotation.from_matrix(rotation).as_quat()
    turned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    sign = np.where(np.cumsum(np.concatenate([[0], turned])) % 2, -1.0, 1.0)
    return np.asarray(quaternion * sign[:, None])
