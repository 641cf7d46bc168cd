"""Labels that change places for a while, in a recording and frame by frame.

That they do is seen in the markers alone, by how they jump. Which way is right is told
by how well a body fits: the error rises when labels change places and falls when they
change back. Where it does neither, two wrongs make a right.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.label_changes import follow_labels, label_owners
from ikns._kernels.body.marker_gate import THORAX, MarkerGate
from ikns.arrays import Array, Indices, Mask

#: A marker that was not seen for longer may have turned by more than a quarter, s.
_LONGEST = 0.1
#: A change of the error by this factor says which way is right; of a marker that comes
#: back after a gap the larger one, as it may add an error of its own.
_TOLD, _TOLD_AFTER_GAP = 2.0, 3.0
#: Frames of whose errors the median is taken.
_RECENT = 5


class LabelState(NamedTuple):
    """What a frame shows of K labels.

    Parameters
    ----------
    wrong : (K,) boolean array
        Whether each stands wrong.
    late : int
        Up to so many frames before this one were taken wrongly, as only this one tells.
    mended : (K,) boolean array
        What was to be said of these frames.
    """

    wrong: Mask
    late: int
    mended: Mask


class LabelWatch:
    """Notices, frame by frame, which of K labels are swapped.

    The first frame counts as right.
    """

    def __init__(self, n_labels: int) -> None:
        n = n_labels
        self._labels = np.arange(n)
        self._last, self._age = np.full((n, 3), np.nan), np.full(n, np.inf)
        #: Labels that ever changed places with each other have the same number.
        self._group = np.arange(n)
        #: Whose marker each carries, as far as is known.
        self._carried = np.arange(n)
        self._since = np.zeros(n, dtype=np.int64)
        #: Error of a frame in which each stood right, and wrong, when that was told.
        self._right, self._wrong = np.full((2, n), np.nan)
        self._frame = -1
        self._recent: deque[float] = deque(maxlen=_RECENT)

    def step(self, markers: Array, dt: float, error: float) -> LabelState:
        """Take the next frame.

        Parameters
        ----------
        markers : (K, 3) array
            m in the world, NaN where not seen.
        dt : float
            Time since the frame before, s; NaN for the first.
        error : float
            Of the pose found, m; NaN where there is none.
        """
        self._frame += 1
        back = self._age + dt > _LONGEST
        came = self._labels.copy()
        late, mended = 0, self.wrong
        if follow_labels(markers, dt, _LONGEST, self._last, self._age, came):
            own = self._merge(came != self._labels)
            late = self._decide(own, came, error, _TOLD)
        elif back.any():
            back &= np.isfinite(markers).all(axis=1)
            for number in np.unique(self._group[back]).tolist():
                own = self._group == number
                if own.sum() > 1:
                    late = self._decide(own, came, error, _TOLD_AFTER_GAP)
        if math.isfinite(error):
            self._recent.append(error)
        if late:
            mended = mended ^ own
        return LabelState(self.wrong, late, mended)

    @property
    def wrong(self) -> Mask:
        """Which labels stand wrong, (K,)."""
        return np.asarray(self._carried != self._labels)

    def _merge(self, changed: Mask) -> Mask:
        """Make one group of labels that changed places; return its labels."""
        joined = np.isin(self._group, self._group[changed])
        self._group[joined] = self._group[joined].min()
        return joined

    def _decide(self, own: Mask, came: Indices, error: float, told: float) -> int:
        """Update a group's state; return how many frames were taken wrongly."""
        was_wrong = bool(self.wrong[own].any())
        before = float(np.median(self._recent)) if self._recent else np.nan
        rose, fell = error > told * before, error * told < before
        if rose or fell:
            self._right[own], self._wrong[own] = sorted((before, error))
        elif not self._differs(came, own):
            # Back after a gap, in which they may have changed: as it was before then?
            middle = float(np.sqrt(self._right[own] * self._wrong[own]).max())
            rose, fell = error > middle and not was_wrong, error < middle and was_wrong
        carried = self._carried[came]
        if fell:
            self._carried[own] = np.flatnonzero(own)
        elif not rose or self._differs(carried, own):
            self._carried[own] = carried[own]
        elif self._differs(came, own):
            self._carried[own] = came[own]  # it had come back unnoticed
        elif not was_wrong:
            self._carried[own] = np.roll(np.flatnonzero(own), 1)  # in a gap
        # What rises was right before, what falls was wrong.
        late = 0
        if (rose and was_wrong) or (fell and not was_wrong):
            late = self._frame - int(self._since[own].max())
        self._since[own] = self._frame
        self._recent.clear()
        return late

    def _differs(self, carried: Indices, own: Mask) -> bool:
        return bool((carried[own] != np.flatnonzero(own)).any())


def label_changes(time: Array, markers: Array) -> tuple[bool, Indices]:
    """Follow the markers of a recording from label to label.

    Parameters
    ----------
    time : (T,) array
        s.
    markers : (T, M, 3) array
        m, NaN where not seen.

    Returns
    -------
    changed : bool
        Whether labels ever change places.
    owners : (T, M) integer array
        Which label of the first frame carried the marker that each one has.
    """
    owners = np.empty(markers.shape[:2], dtype=np.int64)
    # The kernel is compiled again for arrays that are read-only.
    own = (np.require(part, requirements=["C", "W"]) for part in (time, markers))
    changed = label_owners(*own, _LONGEST, owners)
    return bool(changed), owners


def exchanges(
    gate: MarkerGate, markers: Array, errors: Callable[[], Array], rate: float
) -> list[tuple[Indices, Indices]]:
    """Find the frames in which labels are swapped.

    Parameters
    ----------
    gate : MarkerGate
        Of the skeleton; labels of the static trial alone do not count.
    markers : (T, M, 3) array
        m in the world, NaN where not seen.
    errors : callable
        Returns those of the poses found, (T,) m, NaN where there is none; called only
        if a label ever changed places.
    rate : float
        Frames per s.

    Returns
    -------
    list of (frames, columns)
        Where the same labels stand wrong: numbers of frames, and the labels' columns.
    """
    columns = np.flatnonzero(gate.group >= THORAX)
    worn = np.ascontiguousarray(markers[:, columns])
    if not label_changes(np.arange(len(worn)) / rate, worn)[0]:
        return []
    watch, error = LabelWatch(len(columns)), errors()
    wrong = np.zeros(worn.shape[:2], dtype=bool)
    for i, frame in enumerate(worn):
        wrong[i], late, mended = watch.step(frame, 1 / rate if i else np.nan, error[i])
        if late:
            own = mended ^ wrong[i - 1]
            shown = np.isfinite(worn[i - late : i, own]).all(axis=(1, 2))
            hidden = np.asarray(~shown)
            wrong[i - late + _step(error[i - late : i], hidden) : i] = mended
    ways, way = np.unique(wrong, axis=0, return_inverse=True)
    way = way.reshape(-1)
    return [
        (np.flatnonzero(way == k), columns[own])
        for k, own in enumerate(ways)
        if own.any()
    ]


def _step(error: Array, hidden: Mask) -> int:
    """Return from which frame on errors (N,) are of the last ones' kind.

    Labels changed places while one was `hidden`, or before all: least squares.
    """
    with np.errstate(divide="ignore"):
        logs = np.log(error)
    logs = np.where(np.isfinite(logs), logs, np.nanmedian(logs))
    best, least = 0, float(np.sum((logs - logs.mean()) ** 2))
    for k in np.flatnonzero(hidden[1:]).tolist():
        left, right = logs[: k + 1], logs[k + 1 :]
        if abs(right.mean() - left.mean()) > np.log(_TOLD):
            squares = left.var() * len(left) + right.var() * len(right)
            if squares < least:
                best, least = k + 1, float(squares)
    return best
