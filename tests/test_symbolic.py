"""Symbolic kinematics against Pinocchio and the kernels."""

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from ikns.body.chains import chain_joints, shipped_chains
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.body.skeleton.model import joint_tree
from ikns.errors import InvalidInput
from ikns.symbolic import chain_jacobian, link_in_thorax, markers_in_world
from ikns.symbolic.kinematics import joint_frames

# A pose is a product of at most 12 transforms of less than 1 m (the body) or a few
# meters (any tree), each exact to rounding: 12 * 3 * eps * 10 m = 1e-13.
EXACT = 1e-12


@pytest.fixture(scope="module")
def skeleton():
    return Skeleton.load()


@pytest.fixture(scope="module")
def model(skeleton):
    return pin.buildModelFromXML(skeleton.urdf, pin.JointModelFreeFlyer())


def postures(skeleton, n, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        q = skeleton.integrate(skeleton.neutral(), rng.normal(size=skeleton.nv))
        q[7:] = rng.uniform(skeleton.lower, skeleton.upper)
        yield q


def test_links_are_where_pinocchio_puts_them_over_1000_postures(skeleton, model):
    data = model.createData()
    links = ("right_knuckle", "left_forearm")
    functions = [link_in_thorax(skeleton, link) for link in links]
    frames = [model.getFrameId(link) for link in links]
    worst = 0.0
    for q in postures(skeleton, 1000):
        pin.framesForwardKinematics(model, data, q)
        thorax = data.oMi[1]
        for function, index in zip(functions, frames, strict=True):
            position, rotation = function(q[7:])
            pose = thorax.actInv(data.oMf[index])
            worst = max(
                worst,
                np.abs(position.full().ravel() - pose.translation).max(),
                np.abs(rotation.full() - pose.rotation).max(),
            )
    assert worst < EXACT


def test_markers_are_where_pinocchio_puts_them_over_1000_postures(skeleton):
    function, none = markers_in_world(skeleton), np.zeros((24, 3))
    worst = max(
        np.abs(
            function(q, np.zeros(9), none).full() - skeleton.markers_in_world(q)
        ).max()
        for q in postures(skeleton, 1000, seed=1)
    )
    assert worst < EXACT


@pytest.mark.parametrize("chain", shipped_chains())
@pytest.mark.parametrize("task", ["pose", "position"])
def test_jacobians_are_pinocchios(skeleton, model, chain, task):
    function, data = chain_jacobian(skeleton, chain, task=task), model.createData()
    columns = skeleton.columns(chain_joints(chain))
    hands = {joint.split("_")[0]: None for joint in chain_joints(chain)}
    ends = [model.getFrameId(f"{side}_knuckle") for side in hands]
    for q in postures(skeleton, 1000 // (2 * len(shipped_chains())), seed=2):
        q[:7] = [0, 0, 0, 0, 0, 0, 1]  # the world is the thorax
        blocks = [
            pin.computeFrameJacobian(
                model, data, q, end, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )[: 6 if task == "pose" else 3, columns]
            for end in ends
        ]
        found = function(q[7:]).full()
        np.testing.assert_allclose(found, np.vstack(blocks), rtol=0, atol=EXACT)


def test_the_jacobian_is_the_derivative_of_the_hand(skeleton):
    angles = ca.SX.sym("angles", 18)
    position, _ = link_in_thorax(skeleton, "left_knuckle")(angles)
    derivative = ca.Function("d", [angles], [ca.jacobian(position, angles)])
    function = chain_jacobian(skeleton, "left_arm_clavicle", task="position")
    columns = skeleton.columns(chain_joints("left_arm_clavicle")) - 6
    for q in postures(skeleton, 20, seed=3):
        by_hand = derivative(q[7:]).full()[:, columns]
        np.testing.assert_allclose(function(q[7:]), by_hand, rtol=0, atol=EXACT)


def test_sizes_and_offsets_give_the_resized_skeleton(skeleton):
    rng = np.random.default_rng(4)
    sizes, offsets = rng.normal(0, 0.1, len(SEGMENTS)), rng.normal(0, 0.01, (24, 3))
    sized = skeleton.resized(dict(zip(SEGMENTS, np.exp(sizes), strict=True)))
    places = sized.marker_positions + offsets
    sized = sized.with_markers(sized.marker_set.at(places))
    function = markers_in_world(skeleton)
    for q in postures(skeleton, 20, seed=4):
        # A resized URDF is text of nine digits: 5e-10 of 0.5 m, six joints on the way.
        np.testing.assert_allclose(
            function(q, sizes, offsets), sized.markers_in_world(q), rtol=0, atol=2e-9
        )


def test_derivatives_by_size_are_those_of_the_scaling(skeleton):
    q, sizes, offsets = ca.SX.sym("q", 25), ca.SX.sym("s", 9), ca.SX.sym("o", 24, 3)
    markers = markers_in_world(skeleton)(q, sizes, offsets)
    slope = ca.Function(
        "d", [q, sizes, offsets], [ca.jacobian(ca.vec(markers.T), sizes)]
    )
    for at in postures(skeleton, 5, seed=5):
        by_size, _ = skeleton.size_jacobian(at)
        found = slope(at, np.zeros(9), np.zeros((24, 3))).full()
        np.testing.assert_allclose(found, by_size.reshape(72, 9), rtol=0, atol=EXACT)


@pytest.mark.parametrize("seed", range(5))
def test_joints_of_any_tree_are_pinocchios(seed):
    rng = np.random.default_rng(seed)
    pin.seed(seed)
    model, axis = pin.Model(), rng.normal(size=3)
    kinds = (
        pin.JointModelRX,
        pin.JointModelPZ,
        pin.JointModelFreeFlyer,
        lambda: pin.JointModelRevoluteUnaligned(axis / np.linalg.norm(axis)),
    )
    for i in range(10):
        kind = kinds[rng.integers(len(kinds))]()
        model.addJoint(int(rng.integers(i + 1)), kind, pin.SE3.Random(), f"{i}")
    tree, turned = joint_tree(model)
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    for i, (R, p) in enumerate(joint_frames(tree, ca.SX(q))):
        pose = data.oMi[i + 1]
        found, place = ca.DM(R).full(), ca.DM(p).full().ravel()
        np.testing.assert_allclose(found, pose.rotation @ turned[i], rtol=0, atol=EXACT)
        np.testing.assert_allclose(place, pose.translation, rtol=0, atol=EXACT)


def test_an_unknown_chain_or_task_is_refused(skeleton):
    with pytest.raises(InvalidInput, match="unknown chain 'leg'"):
        chain_jacobian(skeleton, "leg")
    with pytest.raises(InvalidInput, match="'pose' or 'position', not 'speed'"):
        chain_jacobian(skeleton, "right_arm", task="speed")
