import numpy as np
import pinocchio as pin
import pytest
from example_robot_data import robots_loader

from ikns.body.skeleton import Robot, Skeleton
from ikns.errors import FileError, InvalidInput

#: A revolute arm, one with continuous joints, one on a torso that slides.
ARMS = {
    "PandaLoader": "panda_hand_tcp",
    "KinovaLoader": "j2s6s200_end_effector",
    "TiagoLoader": "wrist_ft_tool_link",
}


def pose_by_pinocchio(loader, robot, q):
    """Frame and its Jacobian (world-aligned) from the loader's own model."""
    model = loader.robot.model
    data = model.createData()
    full = pin.neutral(model)
    for name, value in zip(robot.joint_names, q, strict=True):
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:  # cosine and sine
            full[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            full[joint.idx_q] = value
    index = model.getFrameId(robot.frame)
    J = pin.computeFrameJacobian(
        model, data, full, index, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )
    pin.framesForwardKinematics(model, data, full)
    columns = [model.joints[model.getJointId(n)].idx_v for n in robot.joint_names]
    return data.oMf[index], J[:, columns]


@pytest.fixture(scope="module", params=ARMS)
def arm(request):
    loader = getattr(robots_loader, request.param)()
    return loader, Robot.load(loader.df_path, ARMS[request.param])


def test_pose_and_jacobian_are_those_of_pinocchio(arm):
    loader, robot = arm
    rng = np.random.default_rng(0)
    q = rng.uniform(-1, 1, (50, len(robot.joint_names)))
    position, rotation = robot.pose(q)
    jacobian = robot.jacobian(q)
    for i in range(len(q)):
        pose, J = pose_by_pinocchio(loader, robot, q[i])
        # A handful of products of rotations, each rounded at 1e-16; arms of a meter.
        np.testing.assert_allclose(position[i], pose.translation, atol=1e-13)
        np.testing.assert_allclose(rotation[i], pose.rotation, atol=1e-13)
        np.testing.assert_allclose(jacobian[i], J, atol=1e-13)
    np.testing.assert_array_equal(robot.jacobian(q, task="position"), jacobian[:, :3])


def test_limits_are_those_of_the_urdf(arm):
    loader, robot = arm
    model = loader.robot.model
    for name, lower, upper in zip(
        robot.joint_names, robot.lower, robot.upper, strict=True
    ):
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            assert (lower, upper) == (-np.inf, np.inf)
        else:
            assert lower == model.lowerPositionLimit[joint.idx_q]
            assert upper == model.upperPositionLimit[joint.idx_q]


def test_null_space_moves_the_frame_only_to_second_order():
    loader = robots_loader.PandaLoader()
    robot = Robot.load(loader.df_path, "panda_hand_tcp")
    q = np.array(loader.robot.q0)[:7]
    basis, rank = robot.null_spaces(q)
    assert rank == 6
    moved = [
        np.linalg.norm(robot.pose(q + h * basis[0])[0] - robot.pose(q)[0])
        for h in (1e-2, 1e-3)
    ]
    # Quadratic: a tenth of the step, a hundredth of the motion, within the third order.
    assert moved[1] < moved[0] / 90


def test_the_arm_of_a_skeleton_is_a_robot_too():
    body = Skeleton.load()
    robot = Robot(body.urdf, "right_knuckle")
    q = np.random.default_rng(1).uniform(-0.5, 0.5, (20, 18))
    own = [body.joint_names.index(name) for name in robot.joint_names]
    position, rotation = body.link_in_thorax(q, "right_knuckle")
    np.testing.assert_array_equal(robot.pose(q[:, own])[0], position)
    np.testing.assert_array_equal(robot.pose(q[:, own])[1], rotation)
    # The same joints, in the order of the file.
    assert set(robot.joint_names) == {n for n in body.joint_names if "right" in n}


def test_a_frame_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(InvalidInput, match=r"has no link 'tool', but .*thorax"):
        Robot(Skeleton.load().urdf, "tool")


def test_a_path_without_joints_is_refused():
    with pytest.raises(InvalidInput, match="from the base to 'thorax', found none"):
        Robot(Skeleton.load().urdf, "thorax")


def test_a_floating_joint_on_the_way_is_refused():
    urdf = """<robot name="ship"><link name="sea"/><link name="ship"/>
      <joint name="swim" type="floating"><parent link="sea"/><child link="ship"/>
      </joint></robot>"""
    with pytest.raises(InvalidInput, match="found joint 'swim'"):
        Robot(urdf, "ship")


@pytest.mark.parametrize("text", ["", "<robot", "<robot name='x'/>", "hello"])
def test_what_is_no_urdf_is_refused(text):
    with pytest.raises(FileError, match="URDF"):
        Robot(text, "tool")


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"none\.urdf: cannot be read"):
        Robot.load(tmp_path / "none.urdf", "tool")


def test_joint_vectors_of_the_wrong_length_are_refused():
    robot = Robot(Skeleton.load().urdf, "right_knuckle")
    with pytest.raises(
        InvalidInput, match=r"positions \(\.\.\., 9\) of right_clavicle"
    ):
        robot.pose(np.zeros(7))


def test_an_unknown_task_is_refused():
    robot = Robot(Skeleton.load().urdf, "right_knuckle")
    with pytest.raises(InvalidInput, match="task must be"):
        robot.jacobian(np.zeros(9), task="tool")
