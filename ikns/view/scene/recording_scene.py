"""The scene of a recording: the body plays it, with the PCA points of a map."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Indices
from ikns.body.chains import SIDES, ChainLike, chain_sides
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import posture_at_point
from ikns.nullspace.signal_names import signal_names
from ikns.recording.recording import Recording
from ikns.view.scene.body import body_commands, marker_commands
from ikns.view.scene.commands import ROOT, Command, object_command, root_commands
from ikns.view.scene.ground import ground_commands
from ikns.view.scene.map_scene import (
    chosen_point,
    hidden,
    map_commands,
    map_layers,
)
from ikns.view.scene.places import trail_commands
from ikns.view.scene.playback import (
    Track,
    animation_command,
    body_tracks,
    kept_frames,
    marker_tracks,
    markers_in_thorax,
)
from ikns.view.scene.scene import Layer, Scene, camera_and_target
from ikns.view.scene.swivel import Swivel, swivel_commands
from ikns.view.style import BLUE

_SEEN = "#222222"
_BALL = {
    "type": "SphereGeometry",
    "radius": 0.007,
    "widthSegments": 16,
    "heightSegments": 12,
}
#: Frames played per second.
_RATE = 30.0


def recording_scene(
    skeleton: Skeleton,
    learned: NullSpaceMap,
    chain: ChainLike,
    motion: Motion,
    recording: Recording,
    *,
    simulated: bool,
    title: str = "Recording",
    point: int | None = None,
    c: ArrayLike | None = None,
    read_by: str = "",
) -> Scene:
    """Scene of a recording: the body plays it, with its markers and the hand's trail.

    Ghosts and sweep are hidden at first.

    Parameters
    ----------
    skeleton, learned, chain, simulated, title, point
        As :func:`map_scene` takes them.
    motion : Motion
        The recording as tracked with `skeleton`.
    recording : Recording
        Gives the markers.
    c : (T,) or (T, d) array, optional
        Control signals to play; default those of `learned`.
    read_by : str
        Method that read it, where it is another than that of `learned`; for the page.

    Raises
    ------
    InvalidInput
        When motion and recording differ in length, or there is no such point.
    NotEnoughData
        When the motion has no known posture.
    """
    if len(motion.time) != len(recording.time):
        raise InvalidInput(
            f"expected the motion of this recording with {len(recording.time)} frames, "
            f"found one of {len(motion.time)}."
        )
    known = np.all(np.isfinite(motion.q), axis=1)
    if not known.any():
        raise NotEnoughData(f"{recording.source}: no frame shows a posture to draw.")
    chosen = chosen_point(learned, point)
    place = motion.task_position(chain)
    distance = np.linalg.norm(place - learned.centers_[chosen], axis=1)
    near = int(np.argmin(np.where(known & np.isfinite(distance), distance, np.inf)))
    if not known[near]:  # the hand was never in sight
        near = int(np.argmax(known))
    q = posture_at_point(skeleton, learned, chain, chosen, start=motion.q[near])
    swivel = Swivel.at(skeleton, learned, chain, chosen, q)

    kept = kept_frames(motion.time, rate=_RATE)
    times = motion.time[kept] - motion.time[kept[0]]
    seen = _seen_markers(skeleton, motion, recording, kept)
    first = int(kept[np.argmax(known[kept])])
    if c is None:
        c = learned.control_signal(motion.chain_angles(chain), place)
    signal = np.reshape(np.asarray(c, dtype=np.float64), (len(place), -1))
    camera = camera_and_target(skeleton, learned, chain, motion.q[kept])
    commands = [
        *root_commands(),
        *body_commands(skeleton, motion.q[first if known[first] else near], chain),
        *marker_commands(skeleton),
        *(object_command(track.path, _BALL, _SEEN) for track in seen),
        *_trails(motion, chain, kept),
        *map_commands(learned),
        *ground_commands(np.concatenate([learned.centers_, place[kept]]), *camera),
        *swivel_commands(skeleton, swivel, chain, playing=False),
        animation_command(times, body_tracks(skeleton, motion.q[kept]) + seen),
    ]
    layers = [
        Layer("markers seen", (f"{ROOT}/seen",), _SEEN),
        Layer("path of the hand", (f"{ROOT}/trail",), BLUE),
        *map_layers(skeleton, learned, chosen, playing=True),
    ]
    return Scene(
        title,
        "The recording as tracked, seen from the thorax."
        + f" c is read by the method {read_by}; points and directions are the paper's."
        * bool(read_by),
        simulated,
        commands + hidden(layers),
        layers,
        *camera,
        times=times,
        c=signal[kept, 0] if signal.shape[1] == 1 else signal[kept],
        speed=motion.hand_speed(chain)[kept],
        start=float(motion.time[first] - motion.time[kept[0]]),
        signals=tuple(signal_names(signal.shape[1])),
    )


def _seen_markers(
    skeleton: Skeleton, motion: Motion, recording: Recording, kept: Indices
) -> list[Track]:
    """Return tracks of the markers that were seen and belong to the marker set."""
    worn = skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)[kept]
    places = markers_in_thorax(markers, motion.q[kept])
    return marker_tracks(places, worn.labels, f"{ROOT}/seen")


def _trails(motion: Motion, chain: ChainLike, kept: Indices) -> list[Command]:
    commands: list[Command] = []
    for side in chain_sides(chain):
        hand = motion.hand_in_thorax[kept, SIDES.index(side)]
        commands += trail_commands(f"{ROOT}/trail/{side}", hand)
    return commands
