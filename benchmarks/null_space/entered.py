"""Any entrant on real people: what it is told there, and its c of postures."""

import numpy as np

from ikns.body.chains import chain_joints
from ikns.nullspace.hinge_swivel import arm_swivel
from null_space.entrants import entrant
from null_space.methods import METHODS, Method, Signal, explored
from null_space.methods import own_movement as moved
from null_space.people import Arm, ArmTrial

Array = np.ndarray


def entered(name: str) -> Method:
    """Return the way from an arm's ordinary movement to an entrant's c.

    The places are those of :func:`null_space.methods.explored`; of other people an
    entrant knows what it brings along.
    """
    if name in METHODS:
        return METHODS[name]
    what = entrant(name)
    swivels = getattr(what, "reads", "joints") == "swivel"

    def read(arm: Arm, angles: Array) -> tuple[Array, Array]:
        if swivels:
            wrist, swivel = arm_swivel(arm.skeleton, angles, arm.chain)
            return wrist, swivel[:, None]
        hand = arm.skeleton.link_in_thorax(angles, f"{arm.side}_knuckle")[0]
        names = arm.skeleton.joint_names
        columns = [names.index(joint) for joint in chain_joints(arm.chain)]
        return hand, angles[:, columns]

    def method(arm: Arm, trials: list[ArmTrial], people: Array) -> Signal:
        postures, which = explored(arm, trials)
        X, y = read(arm, postures)
        x0, y0 = read(arm, moved(trials)[2])
        body = (
            {"skeleton": arm.skeleton, "chain": arm.chain}
            if getattr(what, "needs_body", False)
            else {}
        )
        made = what(**body).fit(X, y, groups=which, natural_X=x0, natural_y=y0)
        swivel = arm_swivel(arm.skeleton, postures, arm.chain)[1]
        c = made.control_signal(y, X)
        rising = np.mean((swivel - swivel.mean()) * (c - c.mean())) >= 0

        def signal(angles: Array, led: Array) -> Array:
            place, coordinate = read(arm, angles)
            found = np.asarray(made.control_signal(coordinate, place))
            return found if rising else 1 - found

        return signal

    return method
