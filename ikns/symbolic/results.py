"""Results for a held hand: a sweep, a range."""

from __future__ import annotations

from dataclasses import dataclass

from ikns.arrays import Array


@dataclass(frozen=True, eq=False)
class Sweep:
    """The self-motion through a posture, as far as it goes both ways.

    Parameters
    ----------
    postures : (2 K + 1, n) array
        From one end to the other, the start in the middle, rad.
    length : float
        Joint-space length of the polygon through them, rad.
    stops : (tuple, tuple) of str
        What ended it, at the first posture and at the last: names of joint limits and
        of volumes that touch, or ``closed``, ``singular posture``, ``long``.
    solved, status
        Whether the optimizer met its tolerance on either side, and its report. Where it
        did not, the side ends at the last posture of the walk, up to 0.05 rad short.
    """

    postures: Array
    length: float
    stops: tuple[tuple[str, ...], tuple[str, ...]]
    solved: tuple[bool, bool]
    status: tuple[str, str]


@dataclass(frozen=True, eq=False)
class AvailableRange:
    """How far a direction can go while the hand is held.

    Parameters
    ----------
    lower, upper : float
        Least and greatest ``direction @ x``, rad; compare with m and M of a map.
    postures : (2, n) array
        Where they are, rad.
    stops : (tuple, tuple) of str
        What is active there: joint limits, volumes that touch, or ``turns back`` where
        the direction has its extreme between all limits.
    solved, status
        Whether the optimizer met its tolerance, and its report.
    freedom : int
        Degrees of freedom left with the hand held. With one the range is that of the
        curve through the start. With more it is the best of several starts: it may be
        too small, and may not be connected while the hand is held.
    """

    lower: float
    upper: float
    postures: Array
    stops: tuple[tuple[str, ...], tuple[str, ...]]
    solved: tuple[bool, bool]
    status: tuple[str, str]
    freedom: int
