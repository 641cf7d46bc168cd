"""``ikns convert``, ``ikns ik`` without a subject, and what readers repaired."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused, read_csv
from test_files_c3d import NAMES, POINTS, c3d_bytes

import ikns
from ikns.cli import main
from ikns.cli.repairs import repairs, tell
from ikns.recording.files.storage import read_storage

DOUBLED = c3d_bytes(labels=["RSHO", "RKNE", "RKNE"])
NOTE = (
    "2 markers are named RKNE, read as RKNE #1, RKNE #2; it is unclear which of them "
    "is meant"
)


def test_a_repair_is_told_once_whatever_the_number_of_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with repairs() as found:
        for name in ("one", "two", "three"):
            (tmp_path / f"{name}.c3d").write_bytes(DOUBLED)
            for _ in range(2):
                ikns.read(tmp_path / f"{name}.c3d")
    tell(found)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"ikns: note: {tmp_path}/one.c3d and 2 more: {NOTE}")
    assert err.count("\n") == 1


def test_a_command_tells_it_beside_its_result(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "two.c3d").write_bytes(DOUBLED)
    argv = ["convert", str(tmp_path / "two.c3d"), str(tmp_path / "two.trc"), "--json"]
    assert main(argv) == 0
    out, err = capfd.readouterr()
    assert NOTE in err
    result = json.loads(out)
    assert (result["kind"], result["frames"]) == ("markers", len(POINTS))
    assert result["names"] == ["RSHO", "RKNE #1", "RKNE #2"]
    found = ikns.read(tmp_path / "two.trc")
    # Singles of millimeters, and six decimals of them.
    np.testing.assert_allclose(found.markers, POINTS * 1e-3, rtol=2e-7, atol=1e-9)


def test_a_command_that_fails_says_only_why(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "two.c3d").write_bytes(DOUBLED)
    argv = ["convert", str(tmp_path / "two.c3d"), str(tmp_path / "two.mot")]
    assert "found .mot" in check_refused(argv, tmp_path, capfd)


def test_a_part_is_written_and_nothing_else_replaced(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source, target = tmp_path / "a.c3d", tmp_path / "b.csv"
    source.write_bytes(c3d_bytes(labels=[f"Ann:{name}" for name in NAMES]))
    argv = ["convert", str(source), str(target), "--subject-prefix", "ann"]
    assert main([*argv, "--from", "0.02", "--to", "0.06"]) == 0
    assert f"b.csv: {len(NAMES)} markers, 3 frames, 0.04 s" in capfd.readouterr().out
    assert ikns.read(target).labels == tuple(NAMES)
    check_refused(argv, tmp_path, capfd, names=target)
    check_refused([*argv[:2], str(source), "--force"], tmp_path, capfd)


def test_angles_need_no_map_and_go_to_other_programs(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    free = str(files / "free.c3d")
    names = [tmp_path / f"motion{ending}" for ending in (".csv", ".mot", ".trc")]
    outs = [word for name in names for word in ("--out", str(name))]
    static = ["--static", str(files / "static.c3d"), "--marker-set", "oxford24"]
    assert main(["ik", *static, free, *outs, "--json"]) == 0
    result = json.loads(capfd.readouterr().out)
    assert result["files"] == [str(name) for name in names]
    assert result["csv"] == str(names[0])
    # The simulated laboratory has Z up, OpenSim Y.
    assert any("Z is up in the laboratory" in note for note in result["notes"])
    table, angles = read_csv(names[0]), read_storage(names[1])
    assert angles.in_degrees
    # Frames that do not show all joints have empty cells in one file, and are left out
    # of the other. Ten digits of a time are printed.
    whole = [np.isfinite(table[f"{name}_deg"]) for name in angles.names[6:]]
    kept = np.all(whole, axis=0)
    np.testing.assert_allclose(angles.time, table["time_s"][kept], rtol=1e-8)
    assert kept.mean() > 0.8
    for name in angles.names[6:]:
        column = angles.values[:, angles.names.index(name)]
        # Nine digits in one file, ten in the other.
        own = table[f"{name}_deg"][kept]
        np.testing.assert_allclose(column, own, rtol=1e-8, atol=1e-8)
    # The same from Python; nine digits are printed.
    still = ikns.read(files / "static.c3d")
    skeleton, _ = ikns.scale(ikns.Skeleton.load(), still, marker_set="oxford24")
    elbow = skeleton.joint_names.index("right_elbow_flexion")
    moved = ikns.MarkerIK(skeleton).track(ikns.read(free)).angles[:, elbow]
    own = table["right_elbow_flexion_deg"]
    np.testing.assert_allclose(own, np.degrees(moved), rtol=1e-8)
    # Fitted markers stay as near to the recorded ones as the residual says.
    recorded, fitted = ikns.read(free), ikns.read(names[2])
    both = [label for label in fitted.labels if label in recorded.labels]
    apart = np.linalg.norm(
        fitted.select(both).markers - recorded.select(both).markers, axis=2
    )
    residual = np.sqrt(np.nanmean(apart**2, axis=1))
    told = table["residual_m"][kept]
    np.testing.assert_allclose(residual[kept], told, atol=1e-6)
    # Part of it has the times of the whole.
    part = tmp_path / "part.csv"
    argv = ["ik", *static, free, "--from", "0.5", "--to", "1", "--out", str(part)]
    assert main(argv) == 0
    time = read_csv(part)["time_s"]
    assert 0.5 <= time[0] < time[-1] <= 1
