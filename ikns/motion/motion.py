"""A motion: joints and hands over time."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import SIDES, chain_joints, chain_sides

__all__ = ["Motion"]


@dataclass(frozen=True, eq=False)
class Motion:
    """Joints and hands over time.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    q : (T, nq) array
        Configuration of the skeleton; the last ``len(joint_names)`` columns are the
        joint angles in radians, before them stands the pose of the thorax in the world
        (meters and a unit quaternion x, y, z, w) where the skeleton has one.
    v : (T, nv) array
        Velocity of `q` in the tangent space, m/s and rad/s.
    joint_names : tuple of str
        Names of the last columns of `q` and `v`.
    hand_in_thorax : (T, 2, 3) array
        Hand positions, meters; the side axis follows :data:`~ikns.body.chains.SIDES`.
    hand_rotation_in_thorax : (T, 2, 3, 3) array
        Hand orientations.
    hand_velocity_in_thorax : (T, 2, 3) array
        Velocity of the hand positions as seen from the thorax, m/s.
    residual : (T,) array
        Root mean square distance of the seen markers from the model's, meters.
    iterations : (T,) integer array
        Iterations that the solver took.
    converged : (T,) boolean array
        Whether the solver met its tolerance.
    held : tuple of str
        Joints that the markers could not observe; they stayed at their prior.
    """

    time: NDArray[np.float64]
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    joint_names: tuple[str, ...]
    hand_in_thorax: NDArray[np.float64]
    hand_rotation_in_thorax: NDArray[np.float64]
    hand_velocity_in_thorax: NDArray[np.float64]
    residual: NDArray[np.float64]
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]
    held: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                frozen = value.view()
                frozen.flags.writeable = False
                object.__setattr__(self, field.name, frozen)

    @property
    def angles(self) -> NDArray[np.float64]:
        """Joint angles, (T, len(joint_names)) radians."""
        return self.q[:, -len(self.joint_names) :]

    def chain_angles(self, chain: str) -> NDArray[np.float64]:
        """Joint angles of a chain, (T, n) radians in chain order."""
        return self.angles[:, self._columns(chain)]

    def chain_velocities(self, chain: str) -> NDArray[np.float64]:
        """Joint velocities of a chain, (T, n) rad/s in chain order."""
        return self.v[:, -len(self.joint_names) :][:, self._columns(chain)]

    def task_position(self, chain: str) -> NDArray[np.float64]:
        """Where the task happens: the hand, or the midpoint of both, (T, 3) m."""
        return self.hand_in_thorax[:, self._sides(chain)].mean(axis=1)

    def hand_speed(self, chain: str) -> NDArray[np.float64]:
        """Speed of the chain's fastest hand relative to the thorax, (T,) m/s."""
        velocity = self.hand_velocity_in_thorax[:, self._sides(chain)]
        return np.linalg.norm(velocity, axis=2).max(axis=1)

    def _columns(self, chain: str) -> list[int]:
        return [self.joint_names.index(name) for name in chain_joints(chain)]

    def _sides(self, chain: str) -> list[int]:
        return [SIDES.index(side) for side in chain_sides(chain)]
