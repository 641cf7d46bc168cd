"""Postures at a PCA point: along Z, and with the hand held."""

from functools import cache

import numpy as np
import pytest
import small_person
from scipy.spatial.transform import Rotation

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import (
    HOLD_TOLERANCE,
    posture_at_point,
    postures_along,
    self_motion,
)

CHAIN = "right_arm"


@cache
def person() -> tuple[Skeleton, NullSpaceMap]:
    made = small_person.subject()
    return made.skeleton, made.null_space_map


def hand(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    position, rotation = person()[0].hands_in_thorax(q)
    return position[..., 0, :], rotation[..., 0, :, :]


def chain_of(q: np.ndarray) -> np.ndarray:
    names = person()[0].joint_names
    return q[..., [names.index(joint) for joint in chain_joints(CHAIN)]]


@pytest.mark.parametrize("point", range(10))
def test_the_arm_stands_at_its_point_in_the_middle_of_the_range(point: int) -> None:
    body, learned = person()
    q = posture_at_point(body, learned, CHAIN, point)
    # The last step is below 1e-8 rad, and Newton's next would square it.
    np.testing.assert_allclose(hand(q)[0], learned.centers_[point], atol=1e-8)
    middle = (learned.lower_[point, 0] + learned.upper_[point, 0]) / 2
    along = chain_of(q) @ learned.directions_[point, 0]
    assert along == pytest.approx(middle, abs=1e-8)
    assert ((q >= body.lower) & (q <= body.upper)).all()


@pytest.mark.parametrize("point", range(10))
def test_the_sweep_holds_the_hand_while_the_elbow_moves(point: int) -> None:
    body, learned = person()
    q = posture_at_point(body, learned, CHAIN, point)
    sweep = self_motion(body, learned, CHAIN, point, q)
    place, rotation = hand(sweep)
    turn = Rotation.from_matrix(rotation @ hand(q)[1].T).magnitude()
    # Each component is corrected until it is below HOLD_TOLERANCE.
    assert (
        np.linalg.norm(place - hand(q)[0], axis=1).max() < np.sqrt(3) * HOLD_TOLERANCE
    )
    assert turn.max() < np.sqrt(3) * HOLD_TOLERANCE
    assert (sweep == q).all(axis=1).any()
    # No step is longer than 0.05 rad but for its correction, second order in it.
    steps = np.linalg.norm(np.diff(sweep, axis=0), axis=1)
    assert steps.max() < 0.055
    c = chain_of(sweep) @ learned.directions_[point, 0]
    ends = learned.lower_[point, 0], learned.upper_[point, 0]
    assert (np.diff(c) > 0).all()
    # The last step is cut to end there, and corrected: second order in 0.05 rad.
    np.testing.assert_allclose(c[[0, -1]], ends, atol=0.05**2)
    elbow = body.link_in_thorax(sweep[[0, -1]], "right_forearm")[0]
    assert np.linalg.norm(np.diff(elbow, axis=0)) > 0.02


def test_nothing_sweeps_where_the_range_is_empty() -> None:
    body, learned = person()
    still = NullSpaceMap.from_arrays(
        learned.centers_,
        0 * learned.directions_,
        0 * learned.lower_,
        0 * learned.upper_,
    )
    q = posture_at_point(body, still, CHAIN, 0)
    np.testing.assert_array_equal(self_motion(body, still, CHAIN, 0, q), [q])


@pytest.mark.parametrize("chain", ["right_arm_clavicle", "both_arms", "left_arm"])
def test_other_chains_sweep_with_their_hands_held(chain: str) -> None:
    body = Skeleton.load()
    names, sides = chain_joints(chain), (-1.0 if chain == "left_arm" else 1.0)
    places = np.array([0.35, -0.15, 0.15]) + 0.1 * np.array(list(np.ndindex(2, 2, 2)))
    places[:, 2] *= 0.0 if chain == "both_arms" else sides
    places[:, 2] += 0.01 * np.arange(8)
    z = np.array([1.0 if "rotation" in name or "abd" in name else 0 for name in names])
    z /= np.linalg.norm(z)
    learned = NullSpaceMap.from_arrays(
        places, np.tile(z, (8, 1)), np.full(8, 0.0), np.full(8, 0.8)
    )
    q = posture_at_point(body, learned, chain, 2)
    sweep = self_motion(body, learned, chain, 2, q)
    assert len(sweep) > 3
    acting = [
        s for s, side in enumerate(("right", "left")) if any(side in n for n in names)
    ]
    hands = body.hands_in_thorax(sweep)[0][:, acting]
    away = np.linalg.norm(hands - body.hands_in_thorax(q)[0][acting], axis=-1)
    assert away.max() < np.sqrt(3) * HOLD_TOLERANCE


def test_postures_along_z_have_the_signal_that_was_asked() -> None:
    body, learned = person()
    q = posture_at_point(body, learned, CHAIN, 3)
    c = np.array([-0.2, 0.0, 0.5, 1.0])
    ghosts = postures_along(body, learned, CHAIN, 3, q, c)
    z = learned.directions_[3, 0]
    away = chain_of(ghosts) - chain_of(q)
    np.testing.assert_allclose(away, (away @ z)[:, None] * z, atol=1e-12)
    lower, upper = learned.lower_[3, 0], learned.upper_[3, 0]
    signal = (chain_of(ghosts) @ z - lower) / (upper - lower)
    np.testing.assert_allclose(signal, c, atol=1e-12)
    others = [k for k, n in enumerate(body.joint_names) if n not in chain_joints(CHAIN)]
    np.testing.assert_array_equal(ghosts[:, others], np.tile(q[others], (4, 1)))
