"""Whether the body has a chain: its joints, its ends, and what they leave over."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.body.chains import Chain, ChainLike, as_chain, shipped_chains
from ikns.body.skeleton.skeleton import Skeleton
from ikns.errors import FileError, InvalidInput
from ikns.numerics.subspace import null_spaces

#: Postures, as shares of the way between the joints' limits, at which the freedom of a
#: chain is counted: the most that any shows is that of almost every other.
_SHARES = (0.31, 0.47, 0.62)


def check_chain(skeleton: Skeleton, chain: ChainLike, *, n_dof: int = 1) -> Chain:
    """Return a chain that the body has, or say what is wrong with it.

    Parameters
    ----------
    skeleton : Skeleton
    chain : Chain or str
    n_dof : int
        Degrees of freedom that are asked of it.

    Raises
    ------
    InvalidInput
        When a joint, an end or the base does not exist, an end does not depend on a
        joint or on the base, a task leaves nothing over, or less than `n_dof`.

    Examples
    --------
    >>> wrist = Chain("wrist", ("right_wrist_flexion",), ("right_knuckle",))
    >>> check_chain(Skeleton.load(), wrist)
    Traceback (most recent call last):
    ikns.errors.InvalidInput: chain 'wrist': its 1 joint leaves nothing over while ...
    """
    own = as_chain(chain)
    if shipped_chains().get(own.name) == own:
        return own
    name = f"chain '{own.name}'"
    unknown = [joint for joint in own.joints if joint not in skeleton.joint_names]
    if unknown:
        raise InvalidInput(
            f"{name}: the body has no joint {', '.join(unknown)}; it has "
            f"{', '.join(skeleton.joint_names)}."
        )
    for link in (own.base, *own.ends):
        try:
            skeleton.tree_link(link)
        except FileError:
            raise InvalidInput(
                f"{name}: expected the ends and the base to be links of the body, such "
                f"as right_knuckle, right_forearm or thorax, found '{link}'."
            ) from None
    J = np.array([_jacobian(skeleton, own, share) for share in _SHARES])
    if own.extrinsic:
        return own
    still = ~np.asarray(J).any(axis=(0, 1))
    if idle := [own.joints[j] for j in np.flatnonzero(still)]:
        raise InvalidInput(
            f"{name}: {' and '.join(own.ends)} {'do' if len(own.ends) > 1 else 'does'} "
            f"not depend on {', '.join(idle)}; leave "
            f"{'it' if len(idle) == 1 else 'them'} out."
        )
    left = len(own.joints) - int(null_spaces(_still(J, own))[1].max())
    if left < n_dof:
        joints = f"{len(own.joints)} joint{'s' * (len(own.joints) > 1)}"
        leaves = "leaves" if len(own.joints) == 1 else "leave"
        over = f"only {left} degree{'s' * (left > 1)} of freedom" if left else "nothing"
        raise InvalidInput(
            f"{name}: its {joints} {leaves} {over} over while the position of "
            f"{' and '.join(own.ends)} is held, expected {n_dof} or more; add joints."
        )
    return own


def _jacobian(skeleton: Skeleton, chain: Chain, share: float) -> Array:
    """Jacobian (6 E, n) of the poses of a chain's ends."""
    angles = skeleton.lower + share * (skeleton.upper - skeleton.lower)
    return skeleton.chain_jacobian(angles, chain)


def _still(J: Array, chain: Chain) -> Array:
    """Rows of the ends' positions, which is all that a map's gate holds."""
    rows = J.reshape(len(J), len(chain.ends), 6, -1)[:, :, :3]
    return rows.reshape(len(J), -1, J.shape[-1])
