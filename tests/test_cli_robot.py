"""``ikns robot``: a robot's own recording against its Jacobian."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused
from example_robot_data import robots_loader

from ikns.body.skeleton import Robot
from ikns.cli import main
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


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--frame", "tool"], "has no link 'tool'"),
        (["--frame", "panda_link0"], "from the base to 'panda_link0', found none"),
        (["--speed", "0"], "slower than 0 m/s, found none"),
        (["--figure", "robot.gif"], "expected a picture"),
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
        ("", "expected a header and two rows"),
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
