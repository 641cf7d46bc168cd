"""Checks of a split's input: trials, joints, and the task's Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.arrays import Array
from ikns.errors import InvalidInput, NotEnoughData

#: A joint that moves less than this share of its largest angle is constant but for
#: rounding, which leaves 1e-16.
_CONSTANT = 1e-12


def check_trials(angles: Array) -> NDArray[np.bool_]:
    """Which trials (N, ...) have every joint known."""
    if angles.ndim < 2 or angles.shape[-1] < 2:
        raise InvalidInput(
            f"expected joint angles (trials, ..., n) of at least 2 joints, found an "
            f"array {angles.shape}."
        )
    if not angles.size:
        raise NotEnoughData(
            f"expected joint angles of some trials, found an empty selection "
            f"{angles.shape}."
        )
    if np.isinf(angles).any():
        raise InvalidInput("joint angles must be finite or NaN, found infinity.")
    return np.asarray(np.isfinite(angles).all(axis=-1))


def check_joints(
    angles: Array, seen: NDArray[np.bool_], names: Sequence[str] | None
) -> None:
    """Refuse joints that are the same in all trials at all times."""
    n = angles.shape[-1]
    if names is not None and len(names) != n:
        raise InvalidInput(f"expected {n} joint names, found {len(names)}.")
    known = seen[..., None]
    high = np.where(known, angles, -np.inf).max(axis=0)
    low = np.where(known, angles, np.inf).min(axis=0)
    size = np.where(known, np.abs(angles), 0.0).max(axis=0)
    still = (high - low <= _CONSTANT * size).reshape(-1, n).all(axis=0)
    if still.any():
        called = range(n) if names is None else names
        which = [str(joint) for joint, same in zip(called, still, strict=True) if same]
        raise NotEnoughData(
            f"expected joints that vary from trial to trial, but joint "
            f"{', '.join(which)} is constant; leave it out with its column of the "
            "Jacobian."
        )


def mean_jacobian(
    jacobian: ArrayLike | Callable[[Array], Array],
    angles: Array,
    mean: Array,
    seen: NDArray[np.bool_],
    *,
    at: str,
) -> Array:
    """Jacobians (..., k, n) of the mean postures, or the mean over trials."""
    if at not in ("mean", "visited"):
        raise InvalidInput(f"at must be 'mean' or 'visited', not {at!r}.")
    n, batch = angles.shape[-1], mean.shape[:-1]
    shapes = {(), batch, seen.shape}
    if callable(jacobian):
        asked = mean if at == "mean" else angles
        jacobian, shapes = jacobian(asked), {asked.shape[:-1]}
    J = np.asarray(jacobian, dtype=np.float64)
    if J.ndim < 2 or J.shape[-1] != n or J.shape[:-2] not in shapes or not J.shape[-2]:
        each = "".join(f"{size}, " for size in batch)
        raise InvalidInput(
            f"expected Jacobians (k, {n}), ({each}k, {n}) or "
            f"({len(seen)}, {each}k, {n}), found an array {J.shape}."
        )
    if J.ndim == angles.ndim + 1:
        weight = (seen / np.maximum(np.count_nonzero(seen, axis=0), 1))[..., None, None]
        return np.where(seen[..., None, None], J * weight, 0.0).sum(axis=0)
    return np.broadcast_to(J, (*batch, *J.shape[-2:]))
