"""Where links other than the hands are in a motion, for chains that end in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ikns.body.chains import ChainLike, as_chain
from ikns.body.skeleton import Skeleton
from ikns.motion.motion import Motion
from ikns.numerics.derivative import slope


def with_ends(skeleton: Skeleton, motion: Motion, chain: ChainLike) -> Motion:
    """Return a motion that holds the ends of a chain.

    Velocities are by :func:`ikns.numerics.derivative.slope`, as those of hands.

    Parameters
    ----------
    skeleton : Skeleton
        Of the motion.
    motion : Motion
    chain : Chain or str
        Hands in the thorax frame are in every motion: then it is returned as it is.

    Examples
    --------
    >>> import ikns
    >>> arm = ikns.load_chain("right_arm")
    >>> elbow = ikns.Chain("right_elbow", arm.joints[:3], ("right_forearm",))
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, rate=25, n_points=1, quick=True
    ... )
    >>> motion = with_ends(run.subject.skeleton, run.static.truth, elbow)
    >>> motion.ends, motion.task_position(elbow).shape[1]
    ((('right_forearm', 'thorax'),), 3)
    """
    own = as_chain(chain)
    if own.hands is not None:
        return motion
    place, rotation = skeleton.chain_ends(motion.q, own)
    shown = motion.in_sight(own) & motion.believed(own)
    known = np.broadcast_to(shown[:, None, None], place.shape)
    velocity = slope(place, motion.time, known)
    for values in (place, rotation, velocity):
        values[~shown] = np.nan
    return replace(
        motion,
        ends=tuple((end, own.base) for end in own.ends),
        end_in_base=place,
        end_rotation_in_base=rotation,
        end_velocity_in_base=velocity,
    )
