"""Every command: a short table or one JSON object, and whole files.

The person is simulated once (tests/small_person.py).
"""

import gc
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_person
from command_line import calibrate, contents, one_sentence, read_csv
from rich.markup import render

import ikns
from ikns.cli import main
from ikns.cli.app import command_parser
from ikns.recording.recording import Recording

HEAVY = {
    "sklearn",
    "numba",
    "meshcat",
    "matplotlib",
    "casadi",
    "pylsl",
    "qtm_rt",
    "dynamixel_sdk",
    "serial",
}


# --- what is loaded, what is handed out ----------------------------------------------


@pytest.mark.parametrize(
    "line", ["import ikns", "from ikns.cli import main; main(['--help'])"]
)
def test_nothing_heavy_is_loaded_before_it_is_needed(line: str) -> None:
    code = f"import sys\n{line}\nprint(*sys.modules, file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert HEAVY.isdisjoint(done.stderr.split())


def test_what_runs_live_and_what_checks_needs_no_statistics() -> None:
    code = (
        "import sys, ikns.analysis.ucm, ikns.calibration.subject, ikns.cli.check, "
        "ikns.experiments.conduct, ikns.live.runtime; print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    slow = {"sklearn", "pandas", "scipy.stats", "scipy.signal", "scipy.optimize"}
    assert slow.isdisjoint(done.stdout.split())


def commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    yield name, command
    for part, below in getattr(command, "commands", {}).items():
        yield from commands(below, f"{name} {part}")


COMMANDS = dict(commands(command_parser(), "ikns"))


@pytest.mark.parametrize("name", COMMANDS)
def test_nothing_of_a_help_text_is_taken_for_markup(name: str) -> None:
    # Brackets would be, and vanish.
    command = COMMANDS[name]
    assert command.help
    for text in [command.help, *(getattr(p, "help", None) for p in command.params)]:
        assert render(text or "").plain == (text or "")


@pytest.mark.parametrize("name", COMMANDS)
def test_no_help_text_shows_a_type_of_python(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*name.split()[1:], "--help"]) == 0
    shown = capsys.readouterr().out
    assert "Usage: " in shown
    for word in ("<", ">", "list[", "float", "bool", "None"):
        assert word not in shown
    context = COMMANDS[name].make_context(name, [], resilient_parsing=True)
    rows = [part.get_help_record(context) or "" for part in COMMANDS[name].params]
    assert not any("<" in cell for row in rows for cell in row)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("scale --mass x", "expected a number for --mass, found x."),
        ("servo --id 1 --id 999", "expected a whole number from 0 to 252 for --id, "),
        ("calibrate --side=up", "expected right, left or both for --side, found up."),
        ("ik", "RECORDING is required; see `ikns ik --help`."),
        ("ik a b", "expected RECORDING only, found also b; see `ikns ik --help`."),
        ("demo --sede 1", "no option --sede (did you mean --seed?); see `ikns demo "),
        ("demo --out", "--out needs a value; see `ikns demo --help`."),
        (
            "demo --quick=1",
            "--quick takes no value; see `ikns demo",
        ),
        ("study dance", "(init, run, plan), found 'dance'; see `ikns study --help`."),
    ],
)
def test_a_wrong_line_is_told_what_was_expected_and_which_help_to_read(
    line: str, says: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(line.split()) == 2
    assert says in one_sentence(capfd.readouterr())


def test_every_public_name_exists() -> None:
    for name in ikns.__all__:
        assert getattr(ikns, name) is not None
    assert set(ikns.__all__) <= set(dir(ikns))


def test_a_function_is_found_though_its_module_has_the_same_name() -> None:
    code = "from ikns.live.warm_up import warm_up\nimport ikns\nikns.warm_up.__call__"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_command_called_from_python_leaves_its_garbage_collector_alone() -> None:
    threshold, frozen = gc.get_threshold(), gc.get_freeze_count()
    assert main(["--version"]) == 0
    assert gc.get_threshold() == threshold
    assert gc.get_freeze_count() <= frozen  # some of those may be gone


def test_the_version_is_that_of_the_project(capsys: pytest.CaptureFixture[str]) -> None:
    project = Path(__file__).parents[1] / "pyproject.toml"
    version = tomllib.loads(project.read_text())["project"]["version"]
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"ikns {version}\n"


# --- what the commands do ------------------------------------------------------------


def test_scale_writes_the_body_of_these_anthropometrics(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "model.urdf"
    person = ["--stature", "1.75", "--mass", "70", "--sex", "female"]
    assert main(["scale", *person, "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    expected = ikns.Skeleton.from_anthropometry(1.75, 70, "female")
    assert ikns.Skeleton.load(out).segment_lengths == expected.segment_lengths
    assert result["segment_lengths_m"] == expected.segment_lengths


def test_calibrate_writes_the_subject_that_the_library_makes(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "person"
    code = main(calibrate(files / "static.c3d", files / "points.c3d", out=out))
    text = capsys.readouterr()
    assert code == 0
    assert "PCA points of right_arm" in text.out
    assert text.err == ""
    found = ikns.Subject.load(out).null_space_map
    # A C3D file holds single precision: 1e-7 of a meter's place, and IK stops at 1e-5.
    np.testing.assert_allclose(
        found.centers_, small_person.subject().null_space_map.centers_, atol=1e-3
    )


def test_one_exploration_option_takes_several_files(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, half = small_person.protocol().points.recording, 587
    first = small_person.write(tmp_path, "first", small_person.cut(recording, 0, half))
    second = small_person.write(
        tmp_path, "second", small_person.cut(recording, half, len(recording.time))
    )
    out = tmp_path / "person"
    assert main(calibrate(files / "static.c3d", first, second, "--json", out=out)) == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["source"] for row in report["explorations"]] == [
        str(first),
        str(second),
    ]


def test_ik_writes_named_angles_in_degrees(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "motion.csv"
    argv = ["ik", "--subject", str(files / "person"), str(files / "free.c3d")]
    assert main([*argv, "--out", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    rows = read_csv(out)
    truth = small_person.protocol().free.truth
    assert result["frames"] == len(rows["time_s"]) == len(truth.time)
    elbow = np.degrees(truth.angles[:, truth.joint_names.index("right_elbow_flexion")])
    # 1.5 deg RMS is what the issue asks of well-seen joints; some frames are occluded.
    assert np.nanmedian(np.abs(rows["right_elbow_flexion_deg"] - elbow)) < 3
    quaternion = np.stack([rows[f"thorax_q{axis}"] for axis in "xyzw"])
    recording = small_person.protocol().free.recording
    thorax = recording.select(["C7", "T10", "CLAV", "STRN"]).markers
    shown = np.isfinite(thorax).all(axis=2).sum(axis=1) >= 3
    assert 0 < np.count_nonzero(~shown) < len(shown) / 5
    assert np.isnan(quaternion[:, ~shown]).all()
    length = np.linalg.norm(quaternion[:, shown], axis=0)
    np.testing.assert_allclose(length, 1, atol=1e-8)
    assert 0 < np.nanmedian(rows["residual_m"]) < 5e-3


def test_control_writes_what_the_live_loop_would_send(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "control.csv"
    argv = ["control", "--subject", str(files / "person"), str(files / "points.c3d")]
    figure = tmp_path / "c.png"
    assert main([*argv, "--out", str(out), "--figure", str(figure)]) == 0
    assert capsys.readouterr().err == ""
    assert figure.read_bytes().startswith(b"\x89PNG")
    rows = read_csv(out)
    measured = ["time_s", "c", "hand_speed_m_s", "inside", "residual_m"]
    assert list(rows) == [*measured, "c_uncertainty"]
    known = np.isfinite(rows["c"])
    assert known.mean() > 0.8
    assert ((rows["c"][known] >= 0) & (rows["c"][known] <= 1)).all()
    assert set(rows["inside"]) == {0.0, 1.0}
    np.testing.assert_allclose(np.diff(rows["time_s"]), 0.02, atol=1e-9)


def test_compare_has_one_row_a_point(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["compare", "--subject", str(files / "person"), str(files / "points.c3d")]
    assert main([*argv, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["points"]
    assert [row["point"] for row in rows] == list(range(1, 11))
    assert all(row["agreement"] > 0 for row in rows)  # signs agree
    assert main(argv) == 0
    assert "angle" in capsys.readouterr().out


def test_compare_tells_which_points_a_recording_did_not_visit(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = small_person.protocol()
    here = np.flatnonzero(run.points.point == 4)
    path = small_person.write(
        tmp_path, "one", small_person.cut(run.points.recording, here[0], here[-1])
    )
    argv = ["compare", "--subject", str(files / "person"), str(path), "--json"]
    assert main(argv) == 0
    rows = json.loads(capsys.readouterr().out)["points"]
    assert sum("angle_deg" in row for row in rows) == 1
    assert sum(row["samples"] == 0 for row in rows) == 9


def test_demo_runs_the_whole_line_and_says_that_it_is_simulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "--quick", "--seed", "2", "--out", str(out), "--json"]) == 0
    text = capsys.readouterr()
    result = json.loads(text.out)
    assert text.err == ""
    assert result["simulated"] is True
    assert result["same_sign_everywhere"] is True
    assert min(result["r_of_c_and_true_swivel"]) >= 0.98
    summary = json.loads((out / "summary.json").read_text())
    assert summary.items() <= result.items()
    page = (out / "report.html").read_text()
    assert "imulated" in page
    assert 'id="elbow-data"' in page
    assert "data:image/png" not in page  # pictures are sharp at every size
    # One page shows all three methods, and what a turned hand does to each.
    turned = {
        name: row["turned_hand"] for name, row in result["methods"]["methods"].items()
    }
    assert list(turned) == ["paper", "proximal", "intent"]
    # A wrist that stays leads the hand nowhere.
    assert turned["intent"] == 0 < 0.05 < turned["paper"]
    assert "Posture or intent" in page
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", page)
    assert len(ikns.read(out / "recordings" / "free.c3d").time) > 0
    ikns.Subject.load(out / "subject")
    before = contents(out)
    assert main(["demo", "--quick", "--out", str(out)]) == 2
    assert "--force" in one_sentence(capsys.readouterr())
    assert contents(out) == before


def test_ik_writes_no_number_for_what_was_not_seen(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = small_person.protocol().free.recording
    markers = recording.markers.copy()
    markers[10:20, [name[0] == "R" for name in recording.labels]] = np.nan
    markers[30:35] = np.nan
    markers[:, recording.labels.index("LFIN")] = np.nan
    hidden = small_person.write(
        tmp_path,
        "hidden",
        Recording(recording.time, markers, recording.labels, "hidden"),
    )
    out = tmp_path / "motion.csv"
    argv = ["ik", "--subject", str(files / "person"), str(hidden), "--out", str(out)]
    assert main([*argv, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    rows = read_csv(out)
    for name, values in rows.items():
        if name.endswith("_deg"):
            assert np.isnan(values[30:35]).all()
            if name.startswith("right"):
                assert np.isnan(values[10:20]).all()
            else:
                assert np.isfinite(values[10:20]).any() == ("wrist" not in name)
        if name.startswith("thorax"):
            assert np.isnan(values[30:35]).all()
            assert np.isfinite(values[10:20]).any()
    assert result["moved_deg"]["left_wrist_flexion"] is None
    assert result["moved_deg"]["left_elbow_flexion"] > 0
    assert main([*argv, "--force"]) == 0
    assert "never visible" in capsys.readouterr().out
