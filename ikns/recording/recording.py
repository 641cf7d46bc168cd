"""A recording: marker positions over time.

Time is the first axis. Positions are in meters in the laboratory (world) frame; NaN
means that the cameras did not see the marker in that frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput, MarkerMismatch


# Arrays have no single truth value, so recordings are compared by identity.
@dataclass(frozen=True, eq=False)
class Recording:
    """Marker positions over time.

    Parameters
    ----------
    time : (T,) array
        Seconds, strictly increasing.
    markers : (T, M, 3) array
        Meters in the world frame; NaN where a marker was not seen.
    labels : sequence of M str
        Marker names as the file has them, each once.
    source : str
        Name of the recording, for messages.
    notes : sequence of str
        What a reader repaired or left out, one sentence each.

    Raises
    ------
    InvalidInput
        When shapes disagree, labels repeat, time does not increase, or a position is
        infinite.

    Examples
    --------
    >>> markers = np.zeros((3, 2, 3))
    >>> recording = Recording([0.0, 0.01, 0.02], markers, ["RSHO", "LSHO"])
    >>> recording.rate, recording.select(["LSHO"]).markers.shape
    (100.0, (3, 1, 3))
    """

    time: Array
    markers: Array
    labels: tuple[str, ...]
    source: str
    notes: tuple[str, ...]

    def __init__(
        self,
        time: ArrayLike,
        markers: ArrayLike,
        labels: Sequence[str],
        source: str = "recording",
        notes: Sequence[str] = (),
    ) -> None:
        time_s = np.array(time, dtype=np.float64)
        markers_m = np.array(markers, dtype=np.float64)
        names = tuple(labels)
        expected = (len(time_s) if time_s.ndim == 1 else -1, len(names), 3)
        if time_s.ndim != 1 or markers_m.shape != expected:
            raise InvalidInput(
                f"{source}: expected time (T,) and markers (T, {len(names)}, 3), "
                f"found {time_s.shape} and {markers_m.shape}."
            )
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise InvalidInput(
                f"{source}: each marker label must appear once, "
                f"found {', '.join(repeated)} more than once."
            )
        if not np.isfinite(time_s).all():
            raise InvalidInput(f"{source}: time holds values that are not finite.")
        backwards = np.flatnonzero(np.diff(time_s) <= 0)
        if backwards.size:
            raise InvalidInput(
                f"{source}: time must increase from frame to frame, but frame "
                f"{backwards[0] + 2} is at {time_s[backwards[0] + 1]:g} s after "
                f"{time_s[backwards[0]]:g} s."
            )
        if np.isinf(markers_m).any():
            raise InvalidInput(
                f"{source}: marker positions must be finite or NaN, found infinity."
            )
        time_s.flags.writeable = False
        markers_m.flags.writeable = False
        object.__setattr__(self, "time", time_s)
        object.__setattr__(self, "markers", markers_m)
        object.__setattr__(self, "labels", names)
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "notes", tuple(notes))

    @property
    def rate(self) -> float:
        """Frames per second; NaN with fewer than two frames."""
        if len(self.time) < 2:
            return float("nan")
        return (len(self.time) - 1) / float(self.time[-1] - self.time[0])

    def select(self, labels: Sequence[str]) -> Recording:
        """Return the same frames with only these markers, in this order.

        Raises
        ------
        MarkerMismatch
            When the recording has no marker of that name.
        """
        missing = [label for label in labels if label not in self.labels]
        if missing:
            raise MarkerMismatch(
                f"{self.source}: expected markers {', '.join(missing)}, found only "
                f"{', '.join(self.labels)}."
            )
        columns = [self.labels.index(label) for label in labels]
        return Recording(
            self.time, self.markers[:, columns], labels, self.source, self.notes
        )
