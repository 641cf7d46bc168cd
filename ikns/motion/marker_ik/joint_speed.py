"""How fast joints turn in ordinary movement: what a hidden one may have done since."""

from __future__ import annotations

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton

#: Root mean square rates over 0.1 s and 0.3 s, rad/s, of three people who reach, drink
#: and comb their hair (UE_ADLdatabase, tracked with MarkerIK), rounded up: shoulder 0.3
#: to 0.6, elbow flexion 0.8, pronation 1.1, wrist 0.4 to 0.6. The clavicle is held in
#: these recordings and counts as the shoulder.
SPEEDS = {
    "clavicle": 0.6,
    "shoulder": 0.6,
    "elbow": 0.8,
    "forearm": 1.1,
    "wrist": 0.6,
}
#: Of the thorax, m/s and rad/s: of a person who sits (assumption).
THORAX_SPEED = 0.2


def joint_speeds(skeleton: Skeleton) -> Array:
    """Ordinary rates of the degrees of freedom, (nv,) rad/s; m/s of the first three.

    >>> joint_speeds(Skeleton.load())[-3:].tolist()
    [1.1, 0.6, 0.6]
    """
    root = np.full(skeleton.nv - len(skeleton.joint_names), THORAX_SPEED)
    own = [SPEEDS[name.split("_")[1]] for name in skeleton.joint_names]
    return np.concatenate([root, own])
