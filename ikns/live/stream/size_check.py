"""Compare the size of the body in a stream with that of the subject."""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.errors import StreamError
from ikns.live.stream.frame import Feed
from ikns.motion.marker_ik.size import power_of_ten, say_size
from ikns.recording.files.conversion import METERS, mark_gaps

#: Longest look at a source, s.
_SECONDS = 0.5


def first_frames(feed: Feed, frames: int = 10) -> NDArray[np.float64]:
    """Return the markers of the next frames of a feed, (T, M, 3) m.

    They are not read again; there are fewer where they take more than half a second.
    """
    taken = [np.full((len(feed.labels), 3), np.nan)]
    give_up = time.monotonic() + _SECONDS
    while len(taken) <= frames and not feed.ended:
        left = give_up - time.monotonic()
        if left <= 0:
            break
        frame = feed.poll(left)
        if frame is not None:
            taken.append(frame.markers)
    markers = np.array(taken)
    mark_gaps(markers)
    return markers


def check_size(
    name: str,
    labels: tuple[str, ...],
    markers: NDArray[np.float64],
    subject: Subject,
    *,
    meters_per_unit: float = math.nan,
) -> None:
    """Refuse a body that is ten times too large or too small, or more.

    Parameters
    ----------
    name : str
        Address of the source.
    labels : tuple of M str
    markers : (T, M, 3) array
        m in the world.
    subject : Subject
    meters_per_unit : float
        Unit in which positions were read, where an option of the address sets it, m.

    Raises
    ------
    StreamError
        With the factor, and the unit that would be right.
    """
    skeleton = subject.skeleton
    own = skeleton.marker_set.pick(labels, markers)
    power = power_of_ten(skeleton, subject.chain, own)
    if power == 0:
        return
    unit = next(
        (
            unit
            for unit in ("mm", "cm", "m")
            if math.isclose(METERS[unit] * 10.0**power, meters_per_unit)
        ),
        "",
    )
    remedy = (
        f"if its positions are in {unit}, say so with the option unit, as in "
        f"{name}?unit={unit}"
        if unit
        else "expected about the same size: check the unit of the source, and the "
        "subject"
    )
    raise StreamError(f"{name}: {say_size(power)}; {remedy}.")
