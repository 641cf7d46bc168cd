"""A moving picture shows what the scene plays: the arm, c below it, and the finger."""

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import small_person
from PIL import Image

from ikns.errors import InvalidInput
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.part import between
from ikns.view.animation import animation_bytes
from ikns.view.scene import Scene, recording_scene
from ikns.view.style import BLUE

SECONDS = 0.4


@cache
def scene(*, rising: bool) -> Scene:
    """A part of the free exploration, played with a c that rises or stays at 0."""
    person = small_person.subject()
    free = between(small_person.protocol().free.recording, end=SECONDS)
    motion = MarkerIK(person.skeleton).track(free, chain=person.chain)
    return recording_scene(
        person.skeleton,
        person.null_space_map,
        person.chain,
        motion,
        free,
        simulated=True,
        c=np.linspace(0.0, float(rising), len(free.time)),
    )


def frames(picture: bytes) -> list[np.ndarray]:
    image = Image.open(io.BytesIO(picture))
    found = []
    for k in range(image.n_frames):
        image.seek(k)
        found.append(np.asarray(image.convert("RGB"), dtype=int))
    return found


def drawn(*, rising: bool = True, format: str = "GIF") -> list[np.ndarray]:
    person = small_person.subject()
    picture = animation_bytes(
        scene(rising=rising), person.skeleton, person.chain, caption="", format=format
    )
    assert picture.startswith({"GIF": b"GIF89a", "PNG": b"\x89PNG"}[format])
    return frames(picture)


def test_the_dot_below_the_body_is_at_c() -> None:
    shown = drawn()
    assert len(shown) == round(SECONDS * 10)  # ten frames a second
    blue = np.array([int(BLUE[k : k + 2], 16) for k in (1, 3, 5)])
    places = []
    for frame in shown:
        lower = frame[int(0.75 * len(frame)) :]
        rows, columns = np.nonzero(np.abs(lower - blue).sum(axis=2) < 30)
        dot = columns > columns.max() - 8  # its diameter is 6 points: 8 pixels
        places.append((columns[dot].mean(), rows[dot].mean()))
    x, y = np.array(places).T
    # c rises evenly, so the dot goes along a line to the upper right, but for half a
    # played frame (0.02 of 0.4 s, 1/20 of 48 pixels) and half a pixel.
    assert np.all(np.diff(x) > 10)
    assert np.all(np.diff(y) < 0)
    assert np.abs(y - np.polyval(np.polyfit(x, y, 1), x)).max() < 3


def test_the_finger_bends_with_c_and_with_nothing_else() -> None:
    moving, straight = drawn(format="PNG")[-1], drawn(rising=False, format="PNG")[-1]
    body = slice(40, 320)  # rows between the title and the curve
    differ = np.abs(moving[body] - straight[body]).sum(axis=2) > 60
    assert 20 < differ.sum() < 0.05 * differ.size


def test_what_stands_still_or_lasts_too_long_is_refused() -> None:
    person, still = small_person.subject(), scene(rising=True)
    for times, said in ((still.times[:1], "stands still"), (still.times * 60, "20 s")):
        with pytest.raises(InvalidInput, match=said):
            animation_bytes(
                replace(still, times=times),
                person.skeleton,
                person.chain,
                caption="",
            )
