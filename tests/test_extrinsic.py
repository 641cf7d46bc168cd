"""Joints that a task leaves alone: planted, found, and left alone by the task."""

import json
from functools import cache

import numpy as np
import small_person

import ikns
from ikns.calibration.subject import Subject
from ikns.cli import main
from ikns.live.control import FrameSolver
from ikns.recording.recording import Recording

#: The left elbow swings along this direction, rad, several times a second, so that
#: every place of the right hand shows the whole range.
RESTING = ikns.extrinsic_chain(
    "resting_arm", ikns.load_chain("left_arm").joints[:4], "right_arm"
)
PLANTED = np.array([0.8, 0.0, -0.6, 0.0])
WIDTH, RATE = 0.25, 4.0


@cache
def planted(*, swing: bool) -> tuple[Recording, np.ndarray]:
    """Markers without noise of the small person, whose left elbow swings as well."""
    run = small_person.protocol()
    body, truth = run.subject.skeleton, run.points.truth
    q = np.array(truth.q)
    phase = np.sin(2 * np.pi * RATE * truth.time) * swing
    columns = [7 + body.joint_names.index(joint) for joint in RESTING.joints]
    q[:, columns] = q[:1, columns] + WIDTH * phase[:, None] * PLANTED
    markers = np.array([body.markers_in_world(pose) for pose in q])
    return Recording(truth.time, markers, body.marker_set.labels, "planted"), phase


def test_a_planted_swing_of_the_resting_elbow_is_found(tmp_path, capsys):
    run, (recording, phase) = small_person.protocol(), planted(swing=True)
    static = small_person.write(tmp_path, "static", run.static.recording)
    points = small_person.write(tmp_path, "points", recording)
    (tmp_path / "resting.toml").write_text(RESTING.toml())
    argv = ["calibrate", "--static", static, "--exploration", points, "--json"]
    argv += ["--chain", tmp_path / "resting.toml", "--out", tmp_path / "person"]
    assert main([*map(str, argv)]) == 0, capsys.readouterr().err
    report = json.loads(capsys.readouterr().out)
    assert report["chain"] == "resting_arm"
    assert set(report["methods"]["without"]) == {"proximal", "intent"}
    person = Subject.load(tmp_path / "person")
    assert person.chain == RESTING
    learned = person.null_space_map
    # Marker places are known to the static trial's mean noise, 1 mm over the root of 60
    # frames, on segments whose markers are some 50 mm apart: axes are 3e-3 rad off, and
    # with them what a turn about them looks like; five such errors in four joints.
    sign = np.sign(learned.directions_[:, 0] @ PLANTED)
    assert len(set(sign)) == 1
    tolerance = 5 * 3e-3 * np.sqrt(4)
    assert np.abs(sign[0] * learned.directions_[:, 0] - PLANTED).max() < tolerance
    width = learned.upper_ - learned.lower_
    # The swing's ends lie between two samples: 1 - cos of half a step less.
    missed = 1 - np.cos(np.pi * RATE / 50)
    np.testing.assert_allclose(width, 2 * WIDTH, rtol=missed + tolerance)
    # c follows the swing wherever the hand is, reaches included.
    motion = ikns.MarkerIK(person.skeleton).track(recording, chain=RESTING)
    c = person.readout().control_signal(person.skeleton, motion)
    off = c - (1 + sign[0] * phase) / 2
    assert np.abs(off).max() < missed + tolerance
    # Live, frame by frame, it is the same.
    solver = FrameSolver(person.skeleton, learned, person.chain)
    markers = person.skeleton.marker_set.pick(recording.labels, recording.markers)
    live = [solver.solve(frame, 0.02).c[0] for frame in markers[:60]]
    # Poses agree to the tolerance of the marker fit, 1e-6 rad or so.
    np.testing.assert_allclose(live, c[:60], atol=1e-4)
    # The same reaches with the left arm at rest: c stays where it is.
    still = ikns.MarkerIK(person.skeleton).track(planted(swing=False)[0], chain=RESTING)
    c = person.readout().control_signal(person.skeleton, still)
    hand = np.ptp(still.task_position(RESTING), axis=0)
    assert np.linalg.norm(hand) > 0.3
    assert np.ptp(c) < missed + tolerance
