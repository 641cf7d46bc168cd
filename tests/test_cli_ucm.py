"""``ikns ucm`` from files: repetitions of a reach, and a hand held at PCA points."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import small_person
from command_line import check_refused

from ikns.analysis.ucm import movement, normalize_time, variance_split
from ikns.body.chains import chain_joints
from ikns.cli import main
from ikns.numerics.derivative import slope
from ikns.recording.recording import Recording
from ikns.simulation.wander import minimum_jerk

RATE = 50.0
#: Reach of the test, rad, in chain order of the right arm.
START = np.radians([10.0, 20.0, -10.0, 80.0, 10.0, 5.0, 5.0])
END = np.radians([25.0, 60.0, -25.0, 40.0, 20.0, 5.0, -5.0])


def reach(offset: np.ndarray, seconds: float) -> np.ndarray:
    """Body configurations (T, 25) that rest, reach and rest, off by an offset."""
    skeleton = small_person.subject().skeleton
    share = minimum_jerk(round(seconds * RATE))
    share = np.r_[np.zeros(5), share, np.ones(5)][:, None]
    q = np.tile(skeleton.neutral(), (len(share), 1))
    # Not all the same share: the offset grows over the reach.
    arm = START + share * (END - START) + (0.5 + share) * offset
    q[:, skeleton.columns(chain_joints("right_arm")) + 1] = arm
    return q


def film(q: np.ndarray) -> Recording:
    skeleton = small_person.subject().skeleton
    markers = np.stack([skeleton.markers_in_world(row) for row in q])
    labels = skeleton.marker_set.labels
    return Recording(np.arange(len(q)) / RATE, markers, labels, "reach")


def offsets(n: int) -> np.ndarray:
    return 0.05 * np.random.default_rng(1).normal(size=(n, 7))


@pytest.fixture(scope="module")
def reaches(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Twelve simulated reaches whose joints vary independently, in a folder."""
    folder = tmp_path_factory.mktemp("reaches")
    return [
        small_person.write(folder, f"reach{i}", film(reach(offset, 0.7 + 0.02 * i)))
        for i, offset in enumerate(offsets(12))
    ]


def command(recordings: Sequence[Path], files: Path, *rest: str | Path) -> list[str]:
    paths = [*map(str, recordings), "--subject", str(files / "person")]
    return ["ucm", *paths, "--surrogates", "99", *map(str, rest)]


def test_repetitions_give_the_split_of_the_true_joint_angles(
    reaches: list[Path], files: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(command(reaches, files, "--json")) == 0
    found = json.loads(capfd.readouterr().out)
    assert found["design"] == "across trials"
    assert found["trials"] == 12
    rows = found["over_time"]
    assert [row["time_percent"] for row in rows] == list(range(101))
    skeleton = small_person.subject().skeleton
    columns = skeleton.columns(chain_joints("right_arm")) + 1
    trials = []
    for i, offset in enumerate(offsets(12)):
        q = reach(offset, 0.7 + 0.02 * i)
        time = np.arange(len(q)) / RATE
        hand = skeleton.hands_in_thorax(q)[0][:, 0]
        part = movement(time, np.linalg.norm(slope(hand, time), axis=1))
        assert np.ptp(time[part]) == pytest.approx(found["movement_s"][i])
        trials.append(normalize_time(q[part, 7:], time[part]))
    angles = np.stack(trials)
    J = skeleton.chain_jacobian(angles.mean(axis=0), "right_arm", task="position")
    true = variance_split(angles[..., columns - 7], J)
    for name, values in (("v_ucm_rad2", true.v_ucm), ("v_ort_rad2", true.v_ort)):
        mine = np.array([row[name] for row in rows])
        # The solver pulls joints a little to where they were, and the C3D file rounds
        # to micrometers; together this costs 1 % of a variance, 0.5 % of a deviation.
        np.testing.assert_allclose(mine, values, rtol=0.02)
    overall = found["overall"]
    assert overall["delta_vz_no_structure"] == pytest.approx(np.log(4 / 3) / 2)
    low, high = overall["delta_vz_interval"]
    assert low < overall["delta_vz"] < high
    # Joints vary independently, so surrogates look like the data.
    assert overall["p"] > 0.05


def test_the_table_tells_the_movement_in_steps_of_a_tenth(
    reaches: list[Path], files: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(command(reaches, files, "--task", "pose")) == 0
    lines = capfd.readouterr().out.splitlines()
    rows = [line.split() for line in lines]
    percent = [row[0] for row in rows if len(row) == 10 and row[0].isdigit()]
    assert percent == [str(p) for p in range(0, 101, 10)]
    assert any("dVz over the whole movement" in line for line in lines)


def test_one_recording_is_split_at_each_pca_point(
    files: Path, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    picture = tmp_path / "points.png"
    argv = command([files / "points.c3d"], files, "--task", "pose", "--figure", picture)
    assert main([*argv, "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    assert found["design"] == "within a trial"
    points = found["points"]
    assert [row["point"] for row in points] == list(range(1, len(points) + 1))
    split = [row for row in points if "delta_vz" in row]
    assert len(split) >= 8
    # The elbow swivels while the hand pose is held: 1 null direction against 6.
    assert min(row["v_ucm_rad2"] / row["v_ort_rad2"] for row in split) > 10
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_a_picture_is_written_in_the_format_of_its_name_and_not_overwritten(
    ending: str, reaches: list[Path], files: Path, tmp_path: Path, capfd
) -> None:
    picture = tmp_path / f"split.{ending}"
    argv = command(reaches[:9], files, "--figure", picture)
    if ending == "svg":
        assert main(argv) == 0
        first = picture.read_bytes()
        assert first.startswith(b"<?xml")
        check_refused(argv, tmp_path, capfd, names=picture)
        assert main([*argv, "--force"]) == 0
        assert picture.read_bytes() == first
    else:
        assert main(argv) == 0
        magic = {"png": b"\x89PNG", "pdf": b"%PDF"}[ending]
        assert picture.read_bytes().startswith(magic)


def test_what_lies_beside_a_truth_is_called_simulated(
    reaches: list[Path], files: Path, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for path in reaches[:8]:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "truth.json").write_text('{"simulated": true}')
    copies = sorted(tmp_path.glob("*.c3d"))
    assert main(command(copies, files)) == 0
    assert capfd.readouterr().out.startswith("Simulated subject")
    (tmp_path / "truth.json").write_text("[not JSON")
    assert main(command(copies, files)) == 0
    assert capfd.readouterr().out.startswith("Recorded subject")


def test_input_that_cannot_be_split_is_refused_in_one_sentence(
    reaches: list[Path],
    files: Path,
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    def refused(argv: list[str]) -> str:
        return check_refused(argv, tmp_path, capfd)

    assert "at least 8 trials for the 7 joints" in refused(command(reaches[:7], files))
    assert "RECORDINGS is required" in refused(command([], files))
    still = small_person.write(
        tmp_path, "still", film(reach(np.zeros(7), 0.7)[:5].repeat(8, 0))
    )
    sentence = refused(command([*reaches[:8], still], files))
    assert "still.c3d" in sentence
    assert "faster than 0.05 m/s" in sentence
    assert "given twice" in refused(command([*reaches, reaches[0]], files))
    same = [tmp_path / f"same{i}.c3d" for i in range(8)]
    for path in same:
        path.write_bytes(reaches[0].read_bytes())
    assert "constant" in refused(command(same, files))
    assert "at no PCA point was the hand held" in refused(command([still], files))
    assert "ends in .png, .svg or .pdf" in refused(
        command(reaches, files, "--figure", tmp_path / "split.jpg")
    )
    assert "onset-speed" in refused(command(reaches, files, "--onset-speed", "-1"))
    nowhere = tmp_path / "nowhere" / "split.png"
    assert "does not exist" in refused(command(reaches, files, "--figure", nowhere))
