"""Keypoints from video: held joints, a TRC file of OpenCap, no static trial."""

import csv
from pathlib import Path

import numpy as np
import pytest
import small_person

from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.scaled_body import length_sd_at_stature, scaled_body
from ikns.calibration.scaling import scale
from ikns.cli import main
from ikns.errors import InvalidInput, MarkerMismatch
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.recording import Recording

#: Labels that OpenCap writes besides those of the set.
OTHERS = ("midHip", "RKnee", "r_knee_study", "RHJC_study")


def keypoints(name: str, trial: str) -> Recording:
    """Keypoints of the small person at the places of a set, Y up, as video has them."""
    run = small_person.protocol()
    body = run.subject.skeleton.with_nominal_markers(MarkerSet.load(name))
    truth = {"static": run.static, "points": run.points}[trial].truth
    seen = np.array([body.markers_in_world(q) for q in truth.q])
    up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    return Recording(truth.time, seen @ up.T, body.marker_set.labels, f"{trial}.trc")


def write_trc(path: Path, recording: Recording) -> Path:
    """Write a TRC file with OpenCap's header, in meters, and markers of the legs."""
    labels = [*recording.labels, *OTHERS]
    n, m = len(recording.time), len(labels)
    legs = np.tile(recording.markers[:, :1], (1, len(OTHERS), 1)) - [0, 0.8, 0]
    values = np.concatenate([recording.markers, legs], axis=1)
    with path.open("w", newline="") as file:
        table = csv.writer(file, delimiter="\t", lineterminator="\n")
        table.writerow(["PathFileType  4", "(X/Y/Z) PostAugmentation"])
        table.writerow(
            "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate "
            "OrigDataStartFrame OrigNumFrames".split()
        )
        table.writerow([recording.rate, 60.0, n, m, "m", 60.0, 1, n])
        table.writerow(
            ["Frame#", "Time", *(cell for label in labels for cell in (label, "", ""))]
        )
        axes = [f"{axis}{k}" for k in range(1, m + 1) for axis in "XYZ"]
        table.writerow(["", "", *axes, ""])
        table.writerow([])
        for k, (time, row) in enumerate(zip(recording.time, values, strict=True)):
            cells = [f"{value:.7f}" for value in row.ravel()]
            table.writerow([k + 1, f"{time:.7f}", *cells])
    return path


@pytest.mark.parametrize("name", ["halpe26", "body25", "opencap"])
def test_shown_joints_are_those_of_the_person(name: str) -> None:
    skeleton, report = scale(
        Skeleton.load(), keypoints(name, "static"), marker_set=name
    )
    motion = MarkerIK(skeleton).track(keypoints(name, "points"))
    held = MarkerSet.load(name).held
    assert report.held == held == motion.held
    truth = small_person.protocol().points.truth
    for joint in ("elbow_flexion", "shoulder_rotation"):
        column = truth.joint_names.index(f"right_{joint}")
        error = np.degrees(motion.angles[:, column] - truth.q[:, 7 + column])
        # Without noise what is left is the clavicle, which here follows the arm by a
        # few degrees and is held, and segments some mm off.
        assert np.nanstd(error) < 3
    column = truth.joint_names.index("right_wrist_flexion")
    assert np.ptp(motion.q[:, 7 + column]) == 0


def test_a_trc_file_of_opencap_ends_in_joint_angles(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    paths = [
        write_trc(tmp_path / f"{trial}.trc", keypoints("opencap", trial))
        for trial in ("static", "points")
    ]
    words = ["calibrate", "--static", str(paths[0]), "--exploration", str(paths[1])]
    words += ["--marker-set", "opencap", "--max-hand-speed", "0.2", "--cutoff", "6"]
    assert main([*words, "--out", str(tmp_path / "ann")]) == 0
    out = capfd.readouterr().out
    held = "clavicle_protraction, clavicle_elevation, wrist_flexion, wrist_deviation"
    assert f"Held, as no marker shows them: {held}." in " ".join(out.split())
    angles = tmp_path / "motion.csv"
    words = ["ik", str(paths[1]), "--subject", str(tmp_path / "ann"), "--cutoff", "6"]
    assert main([*words, "--out", str(angles)]) == 0
    assert "held: no marker shows it" in capfd.readouterr().out
    assert len(angles.read_text().splitlines()) > 100


def test_a_body_from_stature_stands_in_for_a_static_trial() -> None:
    adult = small_person.protocol().subject.adult
    generic = Skeleton.from_anthropometry(adult.stature_m, adult.mass_kg, adult.sex)
    points = keypoints("halpe26", "points")
    subject = calibrate(
        None, [points], generic=generic, marker_set="halpe26", max_hand_speed=0.2
    )
    static = subject.report["static"]
    assert static["source"] is None
    assert static["lengths_m"] == generic.segment_lengths
    assert "no static trial" in subject.report["warnings"][0]
    fitted, report = scale(
        generic, keypoints("halpe26", "static"), marker_set="halpe26"
    )
    for name in ("right_upper_arm", "right_forearm"):
        assert static["length_sd_m"][name] > report.length_sd[name]
    assert fitted.marker_set.labels == subject.skeleton.marker_set.labels
    with pytest.raises(InvalidInput, match="a static trial, or a body from stature"):
        calibrate(None, [points], marker_set="halpe26")


def test_lengths_spread_as_people_of_one_stature_do() -> None:
    # ANSUR II, radiale-stylion at a given stature: 10.8 of 267.9 mm in men, 11.1 of
    # 241.3 in women, so 4.0 to 4.6 %; left and right differ by 1 % besides.
    sd = length_sd_at_stature({"right_forearm": 1.0})["right_forearm"]
    assert np.hypot(0.040, 0.01) < sd < np.hypot(0.046, 0.01)


def test_clusters_need_a_static_trial() -> None:
    run = small_person.protocol().points.recording
    kept, _ = scaled_body(Skeleton.load(), [run])
    assert "RUPA" not in kept.marker_set.labels
    assert {"RELB", "RSHO", "RFIN"} <= set(kept.marker_set.labels)
    labels = MarkerSet.load("ue_adl").labels
    cluster = Recording([0.0], np.ones((1, len(labels), 3)), labels)
    with pytest.raises(MarkerMismatch, match=r"static trial, which .* right_clavicle"):
        scaled_body(Skeleton.load(), [cluster], marker_set="ue_adl")


def test_the_joints_of_an_arm_without_keypoints_are_held() -> None:
    points = keypoints("halpe26", "points")
    right = points.select(
        [lab for lab in points.labels if lab[0] != "L" or "Hip" in lab]
    )
    _, report = scaled_body(Skeleton.load(), [right], marker_set="halpe26")
    assert {"left_elbow_flexion", "left_shoulder_rotation"} <= set(report.held)
    assert "right_elbow_flexion" not in report.held
