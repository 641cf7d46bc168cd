"""Reading marker files: real recordings, and what is refused whatever the format."""

import re
import subprocess
import sys

import numpy as np
import pytest

from ikns.errors import FileError, RecordingWarning
from ikns.recording.files import read

TASKS = [f"{task}{side}1" for task in "ACDF" for side in "LR"] + ["_static"]

#: Frames, markers, frames per second. Frames of `stoop` are in its file names; the
#: others were counted by ezc3d. In `plugin_gait` 239 points are stored, of which 42 are
#: unnamed and 80 are angles, forces, moments and powers.
C3D = {
    "box_lift/markers_analogs.c3d": (580, 51, 100),
    "plugin_gait/Movement_trial.c3d": (323, 239 - 42 - 80, 120),
    "shoulder_kinova/example.c3d": (800, 33, 100),
    "stoop/neu_t169_f250f350.c3d": (350 - 250 + 1, 38, 50),
    "stoop/stoop1_t169_f620f800.c3d": (800 - 620 + 1, 38, 50),
    "stoop/stoop2_t169_f1395f1590.c3d": (1590 - 1395 + 1, 38, 50),
    "stoop/stoop3_t169_f2101f2300.c3d": (2300 - 2101 + 1, 38, 50),
}


def refused(path):
    """Return the complaint about a file, after checking that it is one sentence."""
    with pytest.raises(FileError) as refusal:
        read(path)
    message = str(refusal.value)
    assert message.startswith(f"{path}: ")
    assert message.endswith(".")
    assert "\n" not in message
    return message


def distance(recording, first, second):
    """Return the mean distance of two markers, matched without subject prefix."""
    names = [label.rsplit(":", 1)[-1] for label in recording.labels]
    gap = recording.markers[:, names.index(first)]
    gap = gap - recording.markers[:, names.index(second)]
    return np.nanmean(np.linalg.norm(gap, axis=1))


@pytest.mark.parametrize("name", C3D)
def test_every_c3d_recording_has_its_frames_markers_and_rate(data, name):
    frames, markers, rate = C3D[name]
    recording = read(data / name)
    assert recording.markers.shape == (frames, markers, 3)
    assert recording.rate == pytest.approx(rate, rel=1e-9)
    assert len(set(recording.labels)) == markers
    # In no file is a marker named that is not seen in a single frame.
    assert not np.isnan(recording.markers).all(axis=(0, 2)).any()


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("person", ["ADL001", "ADL005"])
def test_every_nexus_recording_has_its_frames_markers_and_rate(data, person, task):
    path = data / "ue_adl" / person / f"{person}{task}.csv"
    numbered = re.findall(r"^(\d+),\d", path.read_text("utf-8-sig"), re.MULTILINE)
    recording = read(path)
    assert recording.markers.shape == (len(numbered), 49, 3)
    assert recording.rate == pytest.approx(100, rel=1e-9)
    # Frame 1 is at 0 s: the static trials were cut out of longer ones. One rounding
    # of the division each.
    expected = (np.array(numbered, dtype=float) - 1) / 100
    np.testing.assert_allclose(recording.time, expected, rtol=1e-15)
    assert all(label.startswith(f"{person}:") for label in recording.labels)
    # The ten landmarks are taken off after the static trial, nothing else is missing.
    never = np.isnan(recording.markers).all(axis=(0, 2)).sum()
    assert never == (0 if task == "_static" else 10)


@pytest.mark.parametrize(
    ("name", "first", "second", "shortest", "longest"),
    [
        # Biacromial breadth of adults: 365 +- 18 and 416 +- 19 mm (ANSUR II), with the
        # markers up to 3 cm inside of the acromial tips. Elbows are 55 to 80 and wrists
        # 45 to 65 mm wide, to which two marker radii of 7 mm add.
        ("stoop/neu_t169_f250f350.c3d", "RSHO", "LSHO", 0.30, 0.46),
        ("plugin_gait/Movement_trial.c3d", "RSHO", "LSHO", 0.30, 0.46),
        ("shoulder_kinova/example.c3d", "EPI_med", "EPI_lat", 0.055, 0.095),
        ("shoulder_kinova/example.c3d", "ULNA", "RADIUS", 0.045, 0.08),
        ("box_lift/markers_analogs.c3d", "EPICm", "EPICl", 0.055, 0.095),
        # Head to toe of somebody who stands.
        ("stoop/neu_t169_f250f350.c3d", "LFHD", "LTOE", 1.4, 1.9),
    ],
)
def test_people_in_c3d_files_have_human_size(
    data, name, first, second, shortest, longest
):
    assert shortest < distance(read(data / name), first, second) < longest


@pytest.mark.parametrize(
    ("person", "forearms"),
    [("ADL001", (0.235, 0.255)), ("ADL005", (0.265, 0.260))],
)
def test_forearms_are_as_long_as_the_tape_measure_says(data, person, forearms):
    recording = read(data / "ue_adl" / person / f"{person}_static.csv")
    for side, tape in zip("LR", forearms, strict=True):
        # The tape ends at skin landmarks, the markers stand beside them: 3 cm.
        length = distance(recording, f"{side}LEP", f"{side}SPR")
        assert length == pytest.approx(tape, abs=0.03)


def test_two_recordings_of_one_rigid_elbow_agree(data):
    """The C3D of `box_lift` and its TRC file, whose columns are separated by commas.

    They are two trials of one person, so only distances within a segment compare; skin
    moves them by some millimeters.
    """
    recording = read(data / "box_lift" / "markers_analogs.c3d")
    with pytest.warns(RecordingWarning) as told:
        printed = read(data / "box_lift" / "markers.trc")
    notes = " ".join(str(warning.message) for warning in told)
    assert "separated by commas" in notes
    assert "says 652 frames, found 93" in notes
    for first, second in [("EPICl", "EPICm"), ("STYLr", "STYLu"), ("ASISl", "ASISr")]:
        expected = distance(printed, first, second)
        assert distance(recording, first, second) == pytest.approx(expected, abs=0.005)


@pytest.mark.parametrize(
    "name",
    [
        "ue_adl/ADL001/ADL001AL1angles.csv",
        "ue_adl/participants.csv",
        "stoop/qIK_stoop1.csv",
        "stoop/markerError_stoop1.csv",
    ],
)
def test_tables_that_are_no_nexus_export_are_refused(data, name):
    assert "expected a Vicon Nexus export" in refused(data / name)


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv", ".C3D"])
def test_missing_empty_and_folder_are_refused(tmp_path, suffix):
    path = tmp_path / f"trial{suffix}"
    assert ": no such file." in refused(path)
    path.touch()
    assert ": this file is empty." in refused(path)
    path.unlink()
    path.mkdir()
    assert "this is a folder; give one recording" in refused(path)


@pytest.mark.parametrize("name", ["trial.mat", "trial"])
def test_unknown_endings_are_refused(tmp_path, name):
    assert "ends in .c3d, .trc, .csv" in refused(tmp_path / name)


def test_a_name_that_no_file_can_have_is_refused():
    with pytest.raises(FileError, match="not a file name"):
        read("trial\0.c3d")


def test_reading_loads_no_compiled_reader(data):
    path = data / "stoop" / "neu_t169_f250f350.c3d"
    script = (
        f"import sys; from ikns.recording.files import read; read({str(path)!r}); "
        "print(sorted({'ezc3d', 'scipy', 'pinocchio', 'numba'} & set(sys.modules)))"
    )
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == "[]"
