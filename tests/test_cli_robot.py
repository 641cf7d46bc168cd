"""``ikns robot``: a robot's own recording against its Jacobian."""

import csv
import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused
from example_robot_data import robots_loader

from ikns.analysis.compare.from_robot import free_tasks
from ikns.body.skeleton import Robot
from ikns.cli import main
from ikns.errors import InvalidInput
from ikns.simulation import explore_null_space, reach_pose

FRAME = "panda_hand_tcp"


@pytest.fixture(scope="module")
def panda(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """URDF, and a simulated exploration at eight corners in degrees."""
    loader = robots_loader.PandaLoader()
    arm = Robot.load(loader.df_path, FRAME)
    start = np.array(loader.robot.q0)[:7]
    position, rotation = arm.pose(start)
    corners = position + 0.1 * (2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1)
    q = np.concatenate(
        [
            explore_null_space(
                arm, reach_pose(arm, start, c, rotation), seconds=1.5, rate=50, seed=k
            )[1]
            for k, c in enumerate(corners)
        ]
    )
    path = tmp_path_factory.mktemp("robot") / "angles.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time_s", *(f"{name}_deg" for name in arm.joint_names)])
        for i, row in enumerate(np.degrees(q)):
            writer.writerow([i / 50, *row])
    return loader.df_path, path


def argv(panda: tuple[str, Path], *more: str) -> list[str]:
    urdf, path = panda
    base = ["robot", urdf, str(path), "--frame", FRAME, "--points", "8"]
    return [*base, "--radius", "0.05", "--simulated", *more]


def test_the_learned_directions_lie_in_the_null_space(
    panda: tuple[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "robot.png"
    assert main(argv(panda, "--json", "--figure", str(picture))) == 0
    result = json.loads(capsys.readouterr().out)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert result["joints"] == [f"panda_joint{k}" for k in range(1, 8)]
    pose, position = result["comparisons"]
    assert [c["null_space_dimensions"] for c in (pose, position)] == [1, 4]
    # One in twenty random directions lies within 45 deg; a straight line through a
    # curve of a few ten degrees within some degrees of its mean (test_robot_...).
    assert pose["pooled"]["angle_deg"]["value"] < 10
    assert pose["pooled"]["inside"]["value"] > 0.9


def test_a_table_for_people(
    panda: tuple[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(argv(panda, "--task", "pose")) == 0
    out = capsys.readouterr().out
    assert "Simulated" in out
    assert "panda_hand_tcp" in out


def rewritten(
    panda: tuple[str, Path], folder: Path, change: Callable[[np.ndarray], np.ndarray]
) -> tuple[str, Path]:
    """The same robot with joints 1, 3, 5 and 7 continuous, and its angles changed."""
    urdf = folder / "endless.urdf"
    robot = ET.parse(panda[0])
    for joint in robot.iter("joint"):
        if joint.get("name") in {f"panda_joint{k}" for k in (1, 3, 5, 7)}:
            joint.set("type", "continuous")
    robot.write(urdf)
    header, *rows = panda[1].read_text().splitlines()
    table = np.array([row.split(",") for row in rows], dtype=float)
    table[:, 1:] = change(table[:, 1:])
    path = folder / "changed.csv"
    lines = [",".join(map(repr, row.tolist())) for row in table]
    path.write_text("\n".join([header, *lines]) + "\n")
    return str(urdf), path


def wrapped_from(start: float) -> Callable[[np.ndarray], np.ndarray]:
    """Every angle within the full turn from `start`, deg."""
    return lambda degrees: (degrees - start) % 360 + start


@pytest.mark.parametrize("start", [-180, 0, -90, 20])
def test_full_turns_change_nothing(
    panda: tuple[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    start: float,
) -> None:
    more = ["--json", "--task", "pose"]
    found = []
    for change in (wrapped_from(start), lambda degrees: degrees):
        words = argv(rewritten(panda, tmp_path, change), *more)
        assert main(words) == 0
        found.append(json.loads(capsys.readouterr().out)["comparisons"][0])
    a, b = (
        [np.array(point["direction"])[0] for point in each["points"]] for each in found
    )
    for one, other in zip(a, b, strict=True):
        # The same samples, shifted: sums of some hundred angles in another turn, and
        # signs that start from another mean.
        np.testing.assert_allclose(np.abs(one @ other), 1.0, atol=1e-9)
    leaks = [[point["leak_m"] for point in each["points"]] for each in found]
    np.testing.assert_allclose(*leaks, atol=1e-9)


def test_a_robot_that_is_redundant_in_position_only(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    urdf, path = six_joints(tmp_path)
    words = ["robot", urdf, str(path), "--frame", "tool0", "--points", "8"]
    assert main([*words, "--json", "--simulated"]) == 0
    result = json.loads(capfd.readouterr().out)
    (position,) = result["comparisons"]
    assert position["task"] == "position"
    assert position["null_space_dimensions"] == 3
    assert any("only the position is compared" in line for line in result["warnings"])
    said = check_refused([*words, "--task", "pose"], tmp_path, capfd, names=path)
    assert "no null space" in said


def test_a_robot_without_any_freedom_is_refused() -> None:
    robot = Robot(
        """<robot name="one"><link name="base"/><link name="arm"/><link name="tip"/>
        <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/>
        <axis xyz="0 0 1"/></joint><joint name="end" type="fixed"><parent link="arm"/>
        <child link="tip"/><origin xyz="1 0 0"/></joint></robot>""",
        "tip",
    )
    with pytest.raises(InvalidInput, match="not even of its position"):
        free_tasks(robot, np.zeros((1, 1)))


def six_joints(folder: Path) -> tuple[str, Path]:
    """A UR5 that holds its tool's place at eight places and turns it."""
    loader = robots_loader.UR5Loader()
    arm = Robot.load(loader.df_path, "tool0")
    start = np.array([0.0, -1.5, 1.0, -1.0, 0.5, 0.0])
    place, turn = arm.pose(start)
    corners = place + 0.05 * (2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1)
    runs = []
    for k, corner in enumerate(corners):
        posture = reach_pose(arm, start, corner, turn)
        runs.append(
            explore_null_space(
                arm, posture, seconds=1, rate=50, task="position", seed=k
            )[1]
        )
    path = folder / "ur5.csv"
    header = ",".join(["time_s", *(f"{name}_rad" for name in arm.joint_names)])
    q = np.concatenate(runs)
    table = np.column_stack([np.arange(len(q)) / 50, q])
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    return loader.df_path, path


def test_ten_points_of_a_robot_whose_z_points_up(
    panda: tuple[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Held places at the corners of a box and in the middle of its top and its bottom.
    arm = Robot.load(panda[0], FRAME)
    start = np.array(robots_loader.PandaLoader().robot.q0)[:7]
    place, turn = arm.pose(start)
    ends = [*(2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1), [0, 0, 1], [0, 0, -1]]
    corners = place + np.array(ends) * [0.08, 0.08, 0.12]
    postures = [reach_pose(arm, start, corner, turn) for corner in corners]
    q = np.repeat(postures, 20, axis=0)
    q += np.random.default_rng(0).normal(0, 1e-4, q.shape)
    path = tmp_path / "ten.csv"
    header = ",".join(["time_s", *(f"{name}_rad" for name in arm.joint_names)])
    table = np.column_stack([np.arange(len(q)) / 20, q])
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    words = ["robot", panda[0], str(path), "--frame", FRAME, "--task", "pose"]
    assert main([*words, "--points", "10", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["comparisons"]
    assert [point["point"] for point in found["points"]] == list(range(1, 11))


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--frame", "tool"], "has no link 'tool'"),
        (["--frame", "panda_link0"], "from the base to 'panda_link0', found none"),
        (["--from", "torso"], "has no link 'torso' to start from, but panda_link0"),
        (["--from", "panda_hand", "--frame", "panda_link1"], "'panda_link1' on 'panda"),
        (["--speed", "0"], "--speed must be above 0, found 0."),
        (["--figure", "robot.gif"], "expected a name that ends in .png"),
    ],
)
def test_bad_options_are_one_sentence(
    panda: tuple[str, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    more: list[str],
    says: str,
) -> None:
    assert says in check_refused(argv(panda, *more), tmp_path, capfd)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "expected a header and at least 2 rows"),
        ("time_s,panda_joint1_rad\n0,zero\n", "cannot be read as a table"),
        ("time_s,panda_joint1_rad\n0,0\n1,0\n", "found none for panda_joint2"),
        ("a,b\n1\n2,3\n", "cannot be read as a table"),
    ],
)
def test_bad_tables_are_one_sentence(
    panda: tuple[str, Path],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    text: str,
    says: str,
) -> None:
    path = tmp_path / "angles.csv"
    path.write_text(text)
    words = ["robot", panda[0], str(path), "--frame", FRAME]
    assert says in check_refused(words, tmp_path, capfd, names=path)


def test_time_that_stands_still_is_refused(
    panda: tuple[str, Path], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    names = ",".join(f"panda_joint{k}_rad" for k in range(1, 8))
    path = tmp_path / "angles.csv"
    path.write_text(f"time_s,{names}\n" + ("1" + ",0" * 7 + "\n") * 3)
    words = ["robot", panda[0], str(path), "--frame", FRAME]
    assert "time_s that increases" in check_refused(words, tmp_path, capfd, names=path)
