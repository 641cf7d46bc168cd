import numpy as np
import pytest
from example_robot_data import robots_loader

from ikns.body.skeleton import Robot
from ikns.errors import InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import mean_null_direction, principal_angles
from ikns.simulation import explore_null_space, reach_pose


@pytest.fixture(scope="module")
def panda():
    loader = robots_loader.PandaLoader()
    robot = Robot.load(loader.df_path, "panda_hand_tcp")
    return robot, np.array(loader.robot.q0)[: len(robot.joint_names)]


@pytest.mark.parametrize("task", ["pose", "position"])
def test_the_frame_stays_and_the_joints_move(panda, task):
    robot, start = panda
    time, q = explore_null_space(robot, start, seconds=2, task=task, seed=0)
    assert time.shape == (200,)
    assert q.shape == (200, 7)
    position, rotation = robot.pose(q)
    # Newton stops below 1e-10; a pose is a few rounded products away from that.
    np.testing.assert_allclose(position, np.tile(position[0], (200, 1)), atol=2e-10)
    if task == "pose":
        np.testing.assert_allclose(
            rotation, np.tile(rotation[0], (200, 1, 1)), atol=1e-9
        )
    assert np.ptp(q, axis=0).max() > 0.1
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()
    # A sample goes a tenth of the way to a posture some spreads of 0.5 rad away.
    assert np.abs(np.diff(q, axis=0)).max() < 0.3


def test_same_seed_same_motion(panda):
    robot, start = panda
    runs = [explore_null_space(robot, start, seconds=0.2, seed=4)[1] for _ in range(2)]
    np.testing.assert_array_equal(*runs)


def test_the_map_of_a_robot_finds_its_null_space(panda):
    robot, start = panda
    # Eight corners of a box around the first.
    rng = np.random.default_rng(2)
    position, rotation = robot.pose(start)
    corners = position + 0.1 * (2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1)
    starts = [reach_pose(robot, start, corner, rotation) for corner in corners]
    runs = [explore_null_space(robot, s, seconds=3, seed=rng)[1] for s in starts]
    q = np.concatenate(runs)
    learned = NullSpaceMap(n_points=8, radius=0.05).fit(robot.pose(q)[0], q)
    assert len(learned.centers_) == 8
    for place, run in zip(starts, runs, strict=True):
        at = np.linalg.norm(learned.centers_ - robot.pose(place)[0], axis=1).argmin()
        mean, _ = mean_null_direction(robot.jacobian(run))
        angle = principal_angles(learned.directions_[at], mean)
        # A component follows a curve that turns; both are means of the same curve, one
        # weighted by how far the joints went. The paper's notes give 1 to 6 deg.
        assert np.degrees(angle[0]) < 6


def test_no_null_space_is_refused():
    loader = robots_loader.UR5Loader()
    robot = Robot.load(loader.df_path, "tool0")
    with pytest.raises(InvalidInput, match="6 joints leave no null space"):
        explore_null_space(robot, [0.0, -1.5, 1.0, -1.0, 0.5, 0.0], seed=0)


def test_a_start_beyond_the_limits_is_refused(panda):
    robot, start = panda
    with pytest.raises(InvalidInput, match="within the limits"):
        explore_null_space(robot, start + 10, seed=0)


def test_a_pose_out_of_reach_is_refused(panda):
    robot, start = panda
    with pytest.raises(InvalidInput, match=r"cannot reach \[5\.0, 0\.0, 0\.0\] m"):
        reach_pose(robot, start, [5.0, 0.0, 0.0], np.eye(3))
