"""The joint tree and its kernels against Pinocchio, on any tree of known joints."""

import numpy as np
import pinocchio as pin
import pytest

from ikns._kernels.body.tree import joint_axes, place_joints
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.body.skeleton.model import joint_tree

# A pose is a product of at most 20 transforms of a few meters, each exact to rounding:
# 20 * 3 * eps * 10 m = 1e-13.
EXACT = 1e-12


def any_joint(rng):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    kinds = [
        *(pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ),
        *(pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
        *(pin.JointModelFreeFlyer, pin.JointModelFreeFlyer),
        lambda: pin.JointModelRevoluteUnaligned(axis),
        lambda: pin.JointModelPrismaticUnaligned(axis),
    ]
    return kinds[rng.integers(len(kinds))]()


def any_model(rng, n):
    """A model of n joints, each on any of those before it or on the world."""
    model = pin.Model()
    for i in range(n):
        model.addJoint(
            int(rng.integers(i + 1)), any_joint(rng), pin.SE3.Random(), f"{i}"
        )
    return model


def any_configuration(model, rng):
    return pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))


@pytest.mark.parametrize("seed", range(20))
def test_poses_and_axes_of_any_tree_are_pinocchios(seed):
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    model = any_model(rng, 12)
    tree, turned = joint_tree(model)
    q, data = any_configuration(model, rng), model.createData()
    twists = pin.computeJointJacobians(model, data, q)
    rotation, translation = np.empty((12, 3, 3)), np.empty((12, 3))
    place_joints(tree, q, np.empty((2, len(q))), rotation, translation)
    for i in range(12):
        pose = data.oMi[i + 1]
        # A joint of the tree is the model's, turned until its axis is z.
        np.testing.assert_allclose(
            rotation[i], pose.rotation @ turned[i], rtol=0, atol=EXACT
        )
        np.testing.assert_allclose(translation[i], pose.translation, rtol=0, atol=EXACT)
    axes = np.empty((model.nv, 6))
    joint_axes(tree, rotation, translation, axes)
    np.testing.assert_allclose(axes, twists.T, rtol=0, atol=EXACT)


@pytest.mark.parametrize("seed", range(5))
def test_way_of_each_joint_to_the_root_is_its_support(seed):
    rng = np.random.default_rng(seed)
    model = any_model(rng, 8)
    tree, _ = joint_tree(model)
    for i in range(8):
        way, joint = [], i
        while joint >= 0:
            way.append(joint + 1)
            joint = int(tree.parent[joint])
        assert sorted(way) == sorted(list(model.supports[i + 1])[1:])
        assert tree.first_v[i] == model.idx_vs[i + 1]


def test_markers_and_hands_in_the_tree_are_where_the_skeleton_has_them():
    skeleton, rng = Skeleton.load(), np.random.default_rng(0)
    q = skeleton.integrate(skeleton.neutral(), rng.normal(size=skeleton.nv))
    n = len(skeleton.tree.kind)
    rotation, translation = np.empty((n, 3, 3)), np.empty((n, 3))
    place_joints(skeleton.tree, q, np.empty((2, len(q))), rotation, translation)
    joint, place = skeleton.tree_markers
    markers = np.einsum("mij,mj->mi", rotation[joint], place) + translation[joint]
    np.testing.assert_allclose(
        markers, skeleton.markers_in_world(q), rtol=0, atol=EXACT
    )
    joint, turn, shift = map(
        np.array, zip(*(skeleton.tree_link(f"{s}_knuckle") for s in SIDES), strict=True)
    )
    position, orientation = skeleton.hands_in_thorax(q)
    # Joint 0 is the thorax.
    hands = np.einsum("hij,hj->hi", rotation[joint], shift) + translation[joint]
    hands = (hands - translation[0]) @ rotation[0]
    np.testing.assert_allclose(hands, position, rtol=0, atol=EXACT)
    np.testing.assert_allclose(
        rotation[0].T @ rotation[joint] @ turn, orientation, rtol=0, atol=EXACT
    )
