"""Other coordinates of the shoulder, in which the same movement is more or less curved.

Principal components describe a self-motion only as far as it is straight in the joint
coordinates. The shoulder's rotation R, of the upper arm in the girdle, is written as

- ``internal``: the skeleton's own angles, ``R = Rx(-a) Rz(f) Ry(r)``;
- ``isb``: plane of elevation, elevation and axial rotation, ``R = Ry Rx(-) Ry`` (Wu et
  al. 2005; there in the thorax, here in the girdle, which differs by the clavicle);
- ``rotation_vector``: ``R = R0 exp(y)`` about a reference posture R0.

All three have the same angular velocity ``w = E(angles) rates``, with the rotation axes
as the columns of E. So rates convert with ``B = E_internal^-1 E_other``, and a Jacobian
J of internal angles becomes ``J B``. The left side is mirrored, as its joints are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.errors import InvalidInput

COORDINATES = ("internal", "isb", "rotation_vector")


@dataclass(frozen=True)
class Coordinates:
    """Three numbers for the rotation of a shoulder.

    Internal angles (..., 3), rad, convert to and from these coordinates; `rates` goes
    from them to B (..., 3, 3): internal rates are B times the rates of these
    coordinates.
    """

    name: str
    from_internal: Callable[[Array], Array]
    to_internal: Callable[[Array], Array]
    rates: Callable[[Array], Array]


def shoulder_coordinates(name: str, reference: ArrayLike = (0, 0, 0)) -> Coordinates:
    """Coordinates by name.

    Parameters
    ----------
    name : str
        One of :data:`COORDINATES`.
    reference : (3,) array
        Internal angles of the reference posture, rad, for the rotation vector.

    Examples
    --------
    >>> there = shoulder_coordinates("isb")
    >>> forward = there.from_internal(np.radians([20.0, 60.0, 0.0]))
    >>> np.degrees(there.to_internal(forward)).round(6) + 0.0
    array([20., 60.,  0.])
    """
    if name == "internal":
        return Coordinates(name, _same, _same, lambda q: _eye(q))
    if name == "isb":
        return Coordinates(name, _to_isb, _from_isb, _isb_rates)
    if name != "rotation_vector":
        raise InvalidInput(
            f"unknown coordinates '{name}', expected one of {', '.join(COORDINATES)}."
        )
    R0 = _rotation(np.asarray(reference, dtype=np.float64))

    def to_vector(q: Array) -> Array:
        return np.asarray((R0.inv() * _rotation(q)).as_rotvec())

    def from_vector(y: Array) -> Array:
        return _angles(R0 * Rotation.from_rotvec(y))

    def rates(q: Array) -> Array:
        spatial = R0.as_matrix() @ _left_jacobian(to_vector(q))
        return np.linalg.solve(_internal_axes(q), spatial)

    return Coordinates(name, _shaped(to_vector), _shaped(from_vector), rates)


def _shaped(convert: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """Let a conversion of rows (N, 3) take any (..., 3)."""

    def converted(given: Array) -> Array:
        array = np.asarray(given, dtype=np.float64)
        return convert(array.reshape(-1, 3)).reshape(array.shape)

    return converted


def _same(q: Array) -> Array:
    return np.array(q, dtype=np.float64)


def _eye(q: Array) -> Array:
    return np.zeros((*np.shape(q)[:-1], 3, 3)) + np.eye(3)


def _rotation(q: Array) -> Rotation:
    return Rotation.from_euler("XZY", np.asarray(q) * [-1.0, 1.0, 1.0])


def _angles(rotation: Rotation) -> Array:
    return np.asarray(rotation.as_euler("XZY") * [-1.0, 1.0, 1.0])


@_shaped
def _to_isb(q: Array) -> Array:
    first, middle, last = _rotation(q).as_euler("YXY").T
    # scipy turns the middle angle up, ISB's elevation is a turn about -X: half a turn
    # more on the outer two.
    first, last = (np.mod(angle, 2 * np.pi) - np.pi for angle in (first, last))
    return np.stack([first, middle, last], axis=1)


@_shaped
def _from_isb(y: Array) -> Array:
    return _angles(Rotation.from_euler("YXY", y * [1.0, -1.0, 1.0]))


def _isb_rates(q: Array) -> Array:
    axes = _axes("YXY", _to_isb(q) * [1.0, -1.0, 1.0], [1.0, -1.0, 1.0])
    return np.asarray(np.linalg.solve(_internal_axes(q), axes), dtype=np.float64)


def _internal_axes(q: Array) -> Array:
    signs = [-1.0, 1.0, 1.0]
    return _axes("XZY", np.asarray(q) * signs, signs)


def _axes(sequence: str, angles: Array, signs: list[float]) -> Array:
    """Axes about which three angles turn, in the girdle, as columns (..., 3, 3)."""
    flat = np.asarray(angles, dtype=np.float64).reshape(-1, 3)
    axes = np.eye(3)[["XYZ".index(letter) for letter in sequence]]
    first = Rotation.from_rotvec(flat[:, :1] * axes[0])
    second = first * Rotation.from_rotvec(flat[:, 1:2] * axes[1])
    columns = [
        np.broadcast_to(axes[0], flat.shape),
        first.apply(axes[1]),
        second.apply(axes[2]),
    ]
    made = np.stack(columns, axis=-1) * np.asarray(signs)
    return made.reshape(*np.shape(angles), 3)


def _left_jacobian(y: Array) -> Array:
    """From rates of a rotation vector (..., 3) to angular velocity, (..., 3, 3).

    ``1 + (1 - cos t) / t^2 [y] + (t - sin t) / t^3 [y]^2`` with ``t = |y|`` (Chirikjian
    2012, Stochastic models, information theory, and Lie groups 2, section 10.6).
    """
    t = np.linalg.norm(y, axis=-1)[..., None, None]
    small = t < 1e-4  # the next term of either series is 1e-9 of the first
    safe = np.where(small, 1.0, t)
    first = np.where(small, 0.5 - t**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - t**2 / 120, (safe - np.sin(safe)) / safe**3)
    cross = np.zeros((*y.shape, 3))
    cross[..., [2, 0, 1], [1, 2, 0]] = y
    cross[..., [1, 2, 0], [2, 0, 1]] = -y
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)
