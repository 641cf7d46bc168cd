"""Curves to follow: pseudo-random levels joined by minimum-jerk moves.

The paper draws three, T1 to T3, "pseudo-randomly" and shows them only as small
pictures. It describes their character: all begin flat, T1 is slow, T2 falls from 90 to
about 30 in less than 3 s, T3 lies between. All other numbers are ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.errors import InvalidInput

#: Peak speed of a minimum-jerk move over its mean speed (Flash and Hogan 1985).
PEAK = 1.875
#: Lowest and highest level, of 0 to 100: away from both ends, where c is clipped.
LOWEST, HIGHEST = 8.0, 92.0
#: Shortest and longest flat start, and rest between moves, s.
_FLAT, _REST = (1.0, 2.0), (0.3, 1.2)
#: Slowest move, as a share of the fastest.
_SLOWEST = 0.5
_TRIES = 1000


@dataclass(frozen=True)
class Character:
    """What profiles of one kind have in common, whatever the seed.

    Parameters
    ----------
    fastest : (float, float)
        Range of the peak speed of the fastest move other than the fall, 1/s.
    step : (float, float)
        Smallest and largest move.
    fall : tuple of float, optional
        Start level, end level, shortest and longest time (s) of a required fall.
    """

    fastest: tuple[float, float]
    step: tuple[float, float]
    fall: tuple[float, float, float, float] | None = None


#: T1 slow, T2 with the fall of the paper, T3 between: whatever the seeds, the fastest
#: move of T1 is slower than that of T3, and that slower than the fall of T2, whose peak
#: is 1.875 * 60 / 2.9 = 38.8 per second at least.
CHARACTERS = {
    "T1": Character(fastest=(14.0, 20.0), step=(15.0, 40.0)),
    "T2": Character(
        fastest=(22.0, 30.0), step=(15.0, 55.0), fall=(90.0, 30.0, 2.4, 2.9)
    ),
    "T3": Character(fastest=(24.0, 32.0), step=(20.0, 60.0)),
}


@dataclass(frozen=True, eq=False)
class Profile:
    """A curve of 0 to 100 over time: rests joined by minimum-jerk moves.

    Parameters
    ----------
    name : str
        Of the character.
    seed : int
        That it was drawn from.
    seconds : float
    levels : (K + 1,) array
        0 to 100.
    start, duration : (K,) array
        Of the moves, s; moves do not overlap.
    """

    name: str
    seed: int
    seconds: float
    levels: Array
    start: Array
    duration: Array

    def at(self, time: ArrayLike) -> Array:
        """Value at any time, s; constant before the first and after the last move."""
        s = self._share(time)
        way = s**3 * (10 - 15 * s + 6 * s**2)
        return np.asarray(self.levels[0] + way @ np.diff(self.levels))

    def speed(self, time: ArrayLike) -> Array:
        """Return the derivative of the value, 1/s."""
        s = self._share(time)
        return np.asarray(
            (30 * s**2 * (1 - s) ** 2) @ (np.diff(self.levels) / self.duration)
        )

    @property
    def peaks(self) -> Array:
        """Peak speed of each move, signed, 1/s, (K,)."""
        return np.asarray(PEAK * np.diff(self.levels) / self.duration)

    def _share(self, time: ArrayLike) -> Array:
        t = np.asarray(time, dtype=np.float64)[..., None]
        return np.clip((t - self.start) / self.duration, 0.0, 1.0)


def draw_profile(name: str, seed: int, *, seconds: float = 25.0) -> Profile:
    """Draw a profile of a character.

    Parameters
    ----------
    name : {"T1", "T2", "T3"}
    seed : int
        Same seed, same profile.
    seconds : float
        Duration, at least 12.

    Examples
    --------
    >>> profile = draw_profile("T2", seed=1)
    >>> bool(profile.peaks.min() < -38)  # the fall, per second
    True
    >>> bool(profile.at(-5.0) == profile.levels[0])
    True
    """
    if name not in CHARACTERS:
        raise InvalidInput(
            f"expected a profile of {', '.join(CHARACTERS)}, found '{name}'."
        )
    if not 12.0 <= seconds < np.inf:
        raise InvalidInput(f"seconds must be at least 12, found {seconds:g}.")
    character = CHARACTERS[name]
    # Profiles of one seed but different names are independent.
    rng = np.random.default_rng([seed, *name.encode()])
    for _ in range(_TRIES):
        profile = _drawn(name, character, seed, seconds, rng)
        if _fits(profile, character):
            return profile
    raise InvalidInput(
        f"no profile {name} of {seconds:g} s could be drawn; ask for a longer one."
    )


def _drawn(
    name: str, character: Character, seed: int, seconds: float, rng: np.random.Generator
) -> Profile:
    fastest = rng.uniform(*character.fastest)
    fall_at = rng.uniform(0.2, 0.7) * seconds if character.fall else np.inf
    levels = [rng.uniform(30.0, 70.0)]
    start: list[float] = []
    duration: list[float] = []
    now = rng.uniform(*_FLAT)
    fast_one = rng.integers(4)
    while now < seconds:
        before = levels[-1]
        if now > fall_at and character.fall:
            high, low, shortest, longest = character.fall
            if before == high:
                levels.append(low)
                duration.append(rng.uniform(shortest, longest))
                fall_at = np.inf
            else:
                levels.append(high)
                duration.append(PEAK * abs(high - before) / fastest)
        else:
            speed = fastest * rng.uniform(_SLOWEST, 1.0)
            speed = fastest if len(start) == fast_one else speed
            levels.append(_next_level(before, character, rng))
            duration.append(PEAK * abs(levels[-1] - before) / speed)
        start.append(now)
        now += duration[-1] + rng.uniform(*_REST)
    # The last move is dropped if it would end too late.
    if start[-1] + duration[-1] > seconds:
        levels, start, duration = levels[:-1], start[:-1], duration[:-1]
    return Profile(
        name, seed, seconds, np.array(levels), np.array(start), np.array(duration)
    )


def _next_level(before: float, character: Character, rng: np.random.Generator) -> float:
    """Draw a level within reach of a move, up or down."""
    step = rng.uniform(*character.step)
    way = rng.choice([-1.0, 1.0])
    if not LOWEST <= before + way * step <= HIGHEST:
        way = -way
    return float(np.clip(before + way * step, LOWEST, HIGHEST))


def _fits(profile: Profile, character: Character) -> bool:
    """Whether it has enough moves, a fast one, and the fall if one is required.

    A level clipped at its limit makes a move shorter, a start near 90 makes it tiny.
    """
    levels, peaks = profile.levels, np.abs(profile.peaks)
    steps = np.abs(np.diff(levels))
    falls = np.zeros(len(steps), dtype=bool)
    if character.fall is not None:
        falls = (levels[:-1] == character.fall[0]) & (levels[1:] == character.fall[1])
        if falls.sum() != 1:
            return False
    if len(steps) < 4 or steps.min() < 5.0 or np.ptp(levels) < 30.0:
        return False
    slowest, fastest = character.fastest
    return bool(slowest <= peaks[~falls].max() <= fastest)
