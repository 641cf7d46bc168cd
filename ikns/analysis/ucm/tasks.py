"""Task variables: Jacobians of a skeleton's hands, or of any function of the joints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import ChainLike, as_chain, chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput


def chain_task(
    skeleton: Skeleton, chain: ChainLike, angles: ArrayLike, *, task: str = "position"
) -> Callable[[Array], Array]:
    """Jacobian of a chain's hands as a function of the chain's joints.

    Parameters
    ----------
    skeleton : Skeleton
    chain : str
        See :class:`ikns.Chain`.
    angles : (..., 18) array
        Joint angles of the whole body, rad. Those outside the chain stay there, such as
        the clavicle's: give their mean.
    task : {"position", "pose"}
        Of the hand in the thorax frame.

    Returns
    -------
    callable
        From postures (..., n) in chain order to Jacobians (..., k, n).

    Examples
    --------
    >>> task = chain_task(Skeleton.load(), "right_arm", np.full(18, 0.3))
    >>> task(np.zeros((5, 7))).shape
    (5, 3, 7)
    """
    if as_chain(chain).extrinsic:
        raise InvalidInput(
            f"the chain '{chain}' is extrinsic: its joints do not move its task, so "
            "there is no variance that would."
        )
    body = np.asarray(angles, dtype=np.float64)
    columns = [skeleton.joint_names.index(name) for name in chain_joints(chain)]
    if body.shape[-1:] != (len(skeleton.joint_names),):
        raise InvalidInput(
            f"expected angles (..., {len(skeleton.joint_names)}), found {body.shape}."
        )

    def jacobian(q: Array) -> Array:
        batch = np.broadcast_shapes(q.shape[:-1], body.shape[:-1])
        posture = np.array(np.broadcast_to(body, (*batch, body.shape[-1])))
        posture[..., columns] = q
        return skeleton.chain_jacobian(posture, chain, task=task)

    return jacobian


def numerical_task(
    function: Callable[[Array], ArrayLike], *, step: float = 6e-6
) -> Callable[[Array], Array]:
    """Jacobian of any function of the joints by central differences.

    Its error is ``step^2 f''' / 6`` of truncation and ``1e-16 f / step`` of rounding:
    with the default (cube root of rounding), for a function and joints of size one,
    some 1e-11 each.

    Parameters
    ----------
    function : callable
        From postures (..., n) to task variables (..., k).
    step : float
        Half of the difference, in the joints' unit.

    Returns
    -------
    callable
        From postures (..., n) to Jacobians (..., k, n).

    Raises
    ------
    InvalidInput
        When `step` is not positive, or, once called, the function does not keep the
        leading axes.

    Examples
    --------
    >>> task = numerical_task(lambda q: np.sin(q.sum(axis=-1, keepdims=True)))
    >>> task(np.zeros((4, 3))).round(6)[0]
    array([[1., 1., 1.]])
    """
    if not 0 < step < np.inf:
        raise InvalidInput(f"expected a positive step, found {step}.")

    def jacobian(q: Array) -> Array:
        posture = np.asarray(q, dtype=np.float64)
        moves = step * np.eye(posture.shape[-1])
        ahead, behind = posture[..., None, :] + moves, posture[..., None, :] - moves
        up, down = (np.asarray(function(side), dtype=float) for side in (ahead, behind))
        if up.ndim != ahead.ndim or up.shape[:-1] != ahead.shape[:-1]:
            raise InvalidInput(
                f"expected a function from {ahead.shape} to "
                f"({', '.join(map(str, ahead.shape[:-1]))}, k), found {up.shape}."
            )
        # Over the step that was taken: rounding makes it another than was asked for.
        taken = np.einsum("...jj->...j", ahead - behind)
        return np.swapaxes((up - down) / taken[..., None], -2, -1)

    return jacobian
