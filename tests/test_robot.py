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
    with pytest.raises(FileError, match=r"none\.urdf: no such file\."):
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


def planar(*mimics):
    """URDF of four links of 1 m in a plane; `mimics` are elements by joint."""
    links = "".join(f'<link name="l{k}"/>' for k in range(6))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/>'
        f'<child link="l{k + 1}"/><origin xyz="{min(k, 1)} 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-4" upper="4" effort="1" velocity="1"/>'
        f"{dict(mimics).get(k, '')}</joint>"
        for k in range(4)
    )
    tip = (
        '<joint name="tip" type="fixed"><parent link="l4"/><child link="l5"/>'
        '<origin xyz="1 0 0"/></joint>'
    )
    return f'<robot name="planar">{links}{joints}{tip}</robot>'


def planar_tip(angles):
    """Where four links of 1 m end, by the cosines and sines of their directions."""
    along = np.cumsum(angles, axis=-1)
    return np.stack([np.cos(along).sum(-1), np.sin(along).sum(-1)], axis=-1)


def test_a_joint_that_mimics_another_is_no_freedom():
    # In a row: joint 3 follows 2, which follows 0.
    robot = Robot(
        planar(
            (2, '<mimic joint="j0" multiplier="-0.5" offset="0.2"/>'),
            (3, '<mimic joint="j2" multiplier="2"/>'),
        ),
        "l5",
    )
    assert robot.joint_names == ("j0", "j1")
    q = np.random.default_rng(0).uniform(-1, 1, (20, 2))

    def tip(q):
        follower = 0.2 - 0.5 * q[:, 0]
        return planar_tip(np.stack([q[:, 0], q[:, 1], follower, 2 * follower], axis=1))

    np.testing.assert_allclose(robot.pose(q)[0][:, :2], tip(q), atol=1e-14)
    step = 1e-6
    numeric = np.stack(
        [
            (tip(q + step * unit) - tip(q - step * unit)) / (2 * step)
            for unit in np.eye(2)
        ],
        axis=2,
    )
    # Central differences: rounding 1e-16 over the step, its square below that.
    np.testing.assert_allclose(robot.jacobian(q)[:, :2], numeric, atol=1e-9)
    # Two freedoms for a place in the plane leave none.
    assert robot.null_spaces(q[0], task="position")[0].shape == (0, 2)
    assert Robot(planar(), "l5").null_spaces(np.ones(4), task="position")[0].shape == (
        2,
        4,
    )


def test_a_full_turn_of_a_leader_must_be_one_of_its_followers():
    half = Robot(planar((2, '<mimic joint="j0" multiplier="0.5"/>')), "l5")
    assert half.endless.tolist() == [False, True, True]
    # From -4 to 4 rad it is more than a turn.
    assert Robot(planar(), "l5").endless.all()


def test_a_joint_beside_the_way_leads_one_on_it():
    urdf = planar((1, '<mimic joint="side"/>')).replace(
        "</robot>",
        '<link name="branch"/><joint name="side" type="prismatic"><parent link="l0"/>'
        '<child link="branch"/><limit lower="0" upper="1" effort="1" velocity="1"/>'
        "</joint></robot>",
    )
    robot = Robot(urdf, "l5")
    assert robot.joint_names == ("j0", "side", "j2", "j3")
    q = np.array([0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(robot.pose(q)[0][:2], planar_tip(q), atol=1e-14)


@pytest.mark.parametrize(
    ("mimics", "says"),
    [
        ([(1, '<mimic joint="none"/>')], "'j1' to mimic a revolute .* found 'none'"),
        ([(1, '<mimic joint="tip"/>')], "'j1' to mimic a revolute .* found 'tip'"),
        ([(1, '<mimic joint="j1"/>')], "a loop at the joint 'j1'"),
        (
            [(1, '<mimic joint="j2"/>'), (2, '<mimic joint="j1"/>')],
            "a loop at the joint",
        ),
        ([(1, '<mimic joint="j0" multiplier="two"/>')], "multiplier of the mimic"),
        ([(1, '<mimic joint="j0" offset="nan"/>')], "offset of the mimic"),
    ],
)
def test_a_mimic_joint_that_follows_nothing_is_refused(mimics, says):
    with pytest.raises(FileError, match=says):
        Robot(planar(*mimics), "l5")


def test_a_chain_may_start_at_a_link():
    loader = robots_loader.PandaLoader()
    frame, base = ARMS["PandaLoader"], "panda_link2"
    whole = Robot.load(loader.df_path, frame)
    arm = Robot.load(loader.df_path, frame, base=base)
    assert arm.joint_names == whole.joint_names[-len(arm.joint_names) :]
    q = np.random.default_rng(0).uniform(-1, 1, len(whole.joint_names))
    model = loader.robot.model
    data, full = model.createData(), pin.neutral(model)
    for name, value in zip(whole.joint_names, q, strict=True):
        full[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, full)
    expected = data.oMf[model.getFrameId(base)].actInv(
        data.oMf[model.getFrameId(frame)]
    )
    position, rotation = arm.pose(q[-len(arm.joint_names) :])
    # As above, with one product more.
    np.testing.assert_allclose(position, expected.translation, atol=1e-13)
    np.testing.assert_allclose(rotation, expected.rotation, atol=1e-13)


@pytest.mark.parametrize(
    ("base", "says"),
    [
        ("l9", "has no link 'l9' to start from, but l0"),
        ("l5", "from the base to 'l1'|has no link 'l1' on 'l5'"),
        ("l1", "from the base to 'l1', found none"),
    ],
)
def test_a_chain_that_does_not_lead_to_the_frame_is_refused(base, says):
    with pytest.raises(InvalidInput, match=says):
        Robot(planar(), "l1", base=base)


def test_joints_that_slide_are_named() -> None:
    # Along an axis of the frame, and along none of them.
    kinds = {"rail": "1 0 0", "lift": "0.6 0.8 0", "turn": "0 0 1"}
    links = "".join(f'<link name="l{k}"/>' for k in range(4))
    joints = "".join(
        f'<joint name="{name}" type="{"revolute" if name == "turn" else "prismatic"}">'
        f'<parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k, (name, axis) in enumerate(kinds.items())
    )
    robot = Robot(f'<robot name="r">{links}{joints}</robot>', "l3")
    assert robot.joint_names == ("rail", "lift", "turn")
    assert robot.sliding == ("rail", "lift")
