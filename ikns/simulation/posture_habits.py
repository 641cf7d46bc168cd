"""How a simulated person holds an arm without meaning anything by it.

Real people turn the elbow with every reach, each in a way of their own. A simulated one
has a swivel for every wrist center and direction of the hand: a quadratic drawn from
mean and covariance of real people, and a rough field that no quadratic is, plus a
little scatter from rest to rest. Hand poses come from real reaches' distribution.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.errors import FileError
from ikns.nullspace.posture_terms import MIDDLE, UNIT, quadratic_terms

_PEOPLE = Path(__file__).with_name("posture_habits.toml")
#: Share of the diagonal in the covariance: 14 arms do not determine 28 coefficients.
_SHRINKAGE = 0.05
#: The rough field: waves, and how far it is alike, m and sine of the hand's direction
#: (assumptions: a quadratic over a work space of 0.5 m cannot follow).
_WAVES, _ALIKE, _ALIKE_AXIS = 48, 0.15, 0.5
#: The wrist's distance from the shoulder, in arm lengths: an arm bent by 150 deg
#: reaches a quarter, one bent by 25 deg 0.975.
_NEAREST, _FARTHEST = 0.27, 0.97
_SHAPES = ("middle", "share", "pose_mean", "pose_covariance")


class HabitPeople(NamedTuple):
    """What ``posture_habits.toml`` holds of real people.

    Parameters
    ----------
    mean, covariance : (28,) and (28, 28) arrays
        Of the coefficients of :func:`habit_terms`, rad.
    residual, rest : float
        What a person's quadratic leaves, and the scatter from rest to rest within it,
        root mean squares, rad.
    middle : (3, 3) array
        Mean orientation of a right hand in the thorax frame.
    share, pose_mean, pose_covariance : (K,), (K, 12) and (K, 12, 12) arrays
        Kinds of reaches: the wrist from the shoulder, in arm lengths, and the rotation
        vector from `middle`, rad, at the start and at the end.
    """

    mean: Array
    covariance: Array
    residual: float
    rest: float
    middle: Array
    share: Array
    pose_mean: Array
    pose_covariance: Array


@cache
def habit_people() -> HabitPeople:
    """Return the population that ships with the package.

    Made by ``benchmarks/posture_habits_people.py``.

    Raises
    ------
    FileError
        When the file is damaged.
    """
    try:
        table = tomllib.loads(_PEOPLE.read_text(encoding="utf-8"))
        of = {name: np.array(table[name], dtype=np.float64) for name in _SHAPES}
        cov = np.array(table["covariance_rad2"], dtype=np.float64)
        cov += _SHRINKAGE * (np.diag(np.diag(cov)) - cov)
        mean = np.array(table["mean_rad"], dtype=np.float64)
        k = len(of["share"])
        shapes = [mean.shape, cov.shape, *(of[name].shape for name in _SHAPES)]
        if shapes != [(28,), (28, 28), (3, 3), (k,), (k, 12), (k, 12, 12)]:
            raise ValueError(f"arrays {shapes}")
        # Written with six digits; a rotation needs all.
        u, _, vt = np.linalg.svd(of["middle"])
        of["middle"] = u @ vt
        return HabitPeople(
            mean, cov, float(table["residual_rad"]), float(table["rest_rad"]), **of
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise FileError(f"{_PEOPLE}: cannot be read: {error!r}.") from None


def habit_terms(wrist_in_thorax: ArrayLike, hand_axis: ArrayLike) -> Array:
    """Quadratic terms (..., 28) of a wrist center and the hand's long axis.

    As :func:`ikns.nullspace.posture_terms.quadratic_terms`, with six dimensions:
    ``(w - middle) / 0.2 m`` (..., 3), and a unit vector from wrist to knuckle (..., 3);
    thorax frame, of a left arm mirrored to the right.
    """
    w = np.asarray(wrist_in_thorax, dtype=np.float64) - MIDDLE
    axis = UNIT * np.asarray(hand_axis, dtype=np.float64)
    return quadratic_terms(np.concatenate([w, axis], axis=-1))


@dataclass(frozen=True, eq=False)
class PostureHabits:
    """Hinge swivel of one person who means nothing, for every pose of the hand.

    Parameters
    ----------
    coefficients : (28,) array
        Of :func:`habit_terms`, rad.
    waves : (K, 6) array
        Of the rough field, rad/m along the wrist's and rad along the hand's axes.
    phases : (K,) array
        rad.
    rough : float
        Root mean square of the rough field, rad.
    rest : float
        Scatter from rest to rest, rad.
    """

    coefficients: Array
    waves: Array
    phases: Array
    rough: float
    rest: float

    def swivel(self, wrist_in_thorax: ArrayLike, hand_axis: ArrayLike) -> Array:
        """Swivel at wrist centers (..., 3) m and long axes of the hand (..., 3), rad.

        Of :func:`ikns.nullspace.hinge_swivel.hinge_swivel`; both of a left arm mirrored
        to the right. Without the scatter from rest to rest.
        """
        smooth = habit_terms(wrist_in_thorax, hand_axis) @ self.coefficients
        pose = np.concatenate(
            np.broadcast_arrays(wrist_in_thorax, hand_axis), axis=-1, dtype=np.float64
        )
        rough = np.cos(pose @ self.waves.T + self.phases).sum(axis=-1)
        size = self.rough * np.sqrt(2 / max(len(self.phases), 1))
        return np.asarray(smooth + size * rough)


def draw_posture_habits(seed: int | np.random.Generator) -> PostureHabits:
    """Draw a person's habits.

    >>> habits = draw_posture_habits(0)
    >>> round(float(np.degrees(habits.rest)), 1)
    1.9
    """
    rng, people = np.random.default_rng(seed), habit_people()
    alike = np.repeat([_ALIKE, _ALIKE_AXIS], 3)
    return PostureHabits(
        rng.multivariate_normal(people.mean, people.covariance),
        rng.normal(size=(_WAVES, 6)) / alike,
        rng.uniform(0, 2 * np.pi, _WAVES),
        float(np.sqrt(max(people.residual**2 - people.rest**2, 0.0))),
        people.rest,
    )


def draw_reaches(seed: int | np.random.Generator, n: int) -> tuple[Array, Array]:
    """Draw hand poses at both ends of natural reaches of a right arm.

    Returns
    -------
    wrists : (n, 2, 3) array
        From the shoulder, in lengths of upper arm and forearm together.
    rotations : (n, 2, 3, 3) array
        Of the hand in the thorax frame.
    """
    rng, people = np.random.default_rng(seed), habit_people()
    found = np.empty((0, 12))
    while len(found) < n:
        kinds = rng.choice(
            len(people.share), size=n, p=people.share / people.share.sum()
        )
        rows = np.array(
            [
                rng.multivariate_normal(people.pose_mean[k], people.pose_covariance[k])
                for k in kinds
            ]
        )
        far = np.linalg.norm(rows.reshape(n, 2, 6)[:, :, :3], axis=2)
        possible = ((far > _NEAREST) & (far < _FARTHEST)).all(axis=1)
        found = np.vstack([found, rows[possible]])
    pose = found[:n].reshape(n, 2, 6)
    return pose[..., :3], _turned(pose[..., 3:])


def draw_hands(seed: int | np.random.Generator, wrists: ArrayLike) -> Array:
    """Draw orientations of a right hand with its wrist at places.

    Parameters
    ----------
    seed : int or Generator
    wrists : (n, 3) array
        From the shoulder, in lengths of upper arm and forearm together.

    Returns
    -------
    (n, 3, 3) array
        Drawn from real reaches' distribution at this place: kinds of reaches in
        proportion to how likely each is to end there, and within a kind as the
        orientation goes with the place.
    """
    rng, people = np.random.default_rng(seed), habit_people()
    w = np.asarray(wrists, dtype=np.float64)
    mean, cov = people.pose_mean[:, 6:], people.pose_covariance[:, 6:, 6:]
    off = w[:, None] - mean[:, :3]
    inverse = np.linalg.inv(cov[:, :3, :3])
    far = np.einsum("nki,kij,nkj->nk", off, inverse, off)
    size = np.linalg.slogdet(cov[:, :3, :3])[1]
    level = np.log(people.share) - 0.5 * (far + size)
    weight = np.exp(level - level.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    turns = []
    for i, row in enumerate(weight):
        k = rng.choice(len(row), p=row)
        gain = cov[k, 3:, :3] @ inverse[k]
        spread = cov[k, 3:, 3:] - gain @ cov[k, :3, 3:]
        turns.append(rng.multivariate_normal(mean[k, 3:] + gain @ off[i, k], spread))
    return _turned(np.reshape(turns, (-1, 3)))


def _turned(vectors: Array) -> Array:
    """Orientations from rotation vectors (..., 3) off the mean one."""
    turn = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return np.asarray((habit_people().middle @ turn).reshape(*vectors.shape, 3))
