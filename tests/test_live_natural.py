"""Ordinary movement in the live calibration, and points that were half explored."""

import json

import numpy as np
import pytest
import small_person
from test_cli_calibrate_live import RATE, film, live

from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.cli import main
from ikns.live.calibration import Judge, ProtocolStep, TargetPoints, paper_steps
from ikns.live.calibration.natural_verdict import half_explored, judge_natural
from ikns.live.calibration.point_verdict import judge_point
from ikns.recording.recording import Recording

STEP = [ProtocolStep(f"point_{k:02d}", "point", 1.5) for k in range(1, 11)]


def movement() -> Recording:
    """Six seconds of ordinary movement of the small person."""
    return small_person.another_day().free.recording


def point(k: int, share: float = 1.0, seconds: float = 3.2) -> Recording:
    """What is seen of a point, or of the first share of it, as slow as asked for."""
    trial = small_person.protocol().points
    (rows,) = np.nonzero(trial.point == k)
    stop = rows[0] + round(share * len(rows))
    part = small_person.cut(trial.recording, rows[0], stop)
    time = np.arange(len(part.time)) * seconds / len(part.time)
    return Recording(time, part.markers, part.labels, part.source)


def test_movement_over_the_work_space_is_kept():
    found = judge_natural(
        movement(), small_person.subject().skeleton, chain="right_arm"
    )
    assert found.keep
    assert found.values["moving_s"] > 3
    assert found.values["reaches"] >= 1
    assert sorted(found.values["span_cm"])[1] > 10


def test_a_hand_in_one_place_is_no_ordinary_movement():
    found = judge_natural(point(0), small_person.subject().skeleton, chain="right_arm")
    assert not found.keep
    assert not found.usable
    assert "expected at least half of the time" in found.reason


def test_a_place_is_half_explored_next_to_others_only():
    usual = {f"point_{k:02d}": (-0.6, 0.6) for k in range(1, 4)}
    assert half_explored((-0.6, 0.1), dict(list(usual.items())[:2])) == ""
    assert half_explored((-0.6, 0.55), usual) == ""  # 4 % short
    assert half_explored((-0.2, 1.0), usual) == ""  # as wide, about another posture
    assert "40 deg, at other points 69 deg" in half_explored((-0.6, 0.1), usual)
    assert "to the upper end" in half_explored((-0.6, 0.1), usual)
    assert "to the lower end" in half_explored((-0.1, 0.6), usual)


def test_a_half_explored_point_is_asked_for_once_more():
    run = small_person.protocol()
    judge = Judge(Skeleton.load(), chain="right_arm")
    static, _, natural, *_ = paper_steps(natural_seconds=6)
    for step, recording in ((static, run.static.recording), (natural, movement())):
        found = judge.judge(step, recording)
        assert found.keep, found.reason
        judge.accept(step, found)
    assert judge.explored is not None  # without a free exploration: where it moved
    for k in range(3):
        judge.accept(STEP[k], judge.judge(STEP[k], point(k)))
    # The first part of 1.5 s is at one end of the swivel; nowhere else is it as narrow.
    part = next(k for k in range(3, 10) if _narrow(judge, k))
    again = judge.judge(STEP[part], point(part, 0.45))
    assert again.keep
    assert "goes no farther" in again.reason
    # A second shows no whole sweep, whatever the place.
    brief = Judge(Skeleton.load(), chain="right_arm")
    brief.skeleton, brief.places, brief._ends = (
        judge.skeleton,
        judge.places,
        judge._ends,
    )
    assert (
        "The elbow covered" not in brief.judge(STEP[part], point(part, 0.45, 1)).reason
    )


def _narrow(judge: Judge, k: int) -> bool:
    found = judge.judge(STEP[k], point(k, 0.45))
    assert "ends_deg" in found.values or not found.usable
    return not found.keep and "The elbow covered" in found.reason


def test_the_short_protocol_takes_movement_and_two_places(tmp_path, capfd):
    played = ["static", "free", "point_01", "point_07"]
    out = tmp_path / "new"
    argv = live(film(tmp_path / "film.c3d", played), out, "--auto", "--short")
    seconds = argv.index("--free-seconds")
    moving = argv[seconds + 1]
    del argv[seconds : seconds + 2]
    zero = argv.index("--natural-seconds")
    argv[zero + 1] = moving
    assert main([*argv, "--json"]) == 0, capfd.readouterr().err
    said = json.loads(capfd.readouterr().out)
    assert [
        take["step"] for take in said["takes"] if take["outcome"] == "accepted"
    ] == [*("static", "natural", "point_01", "point_02")]
    assert len(said["points"]) == 2
    assert said["methods"]["natural_posture"]["frames"] > 2 * RATE
    folder = tmp_path / "new-recordings"
    by_hand = ["calibrate", "--short", "--static", str(folder / "static.c3d")]
    by_hand += ["--natural", str(folder / "natural.c3d"), "--exploration"]
    by_hand += [str(folder / "point_01.c3d"), "--exploration"]
    by_hand += [str(folder / "point_02.c3d"), "--out", str(tmp_path / "other")]
    assert main(by_hand) == 0
    one, two = (Subject.load(tmp_path / name) for name in ("new", "other"))
    assert one.readout("intent").table() == two.readout("intent").table()


def test_two_points_lie_above_and_below_the_middle():
    rng = np.random.default_rng(0)
    explored = rng.uniform([0.1, -0.4, 0.0], [0.5, 0.2, 0.3], (4000, 3))
    two = TargetPoints(explored, 2).positions
    # The nearest of 4000 points in 72 liters is within 5 cm.
    assert np.allclose(two[0], [0.3, 0.2, 0.15], atol=0.05)
    assert np.allclose(two[1], [0.3, -0.4, 0.15], atol=0.05)
    assert len(TargetPoints(explored, 1).positions) == 1


@pytest.mark.parametrize("seconds", [0.0, 5.0])
def test_only_the_short_protocol_goes_without_free_exploration(
    seconds, tmp_path, capfd
):
    argv = ["calibrate", "--live", "--source", "replay:x.c3d", "--free-seconds", "0"]
    argv += ["--natural-seconds", str(seconds), "--out", str(tmp_path / "new")]
    assert main(argv) == 2
    assert "only --short works without free exploration" in capfd.readouterr().err


def test_a_straight_arm_is_sent_back_nearer():
    run = small_person.protocol()
    skeleton = small_person.subject().skeleton
    straight = judge_point(run.static.recording, skeleton, chain="right_arm")
    assert not straight.keep
    assert straight.values["elbow_deg"] < 35  # it hangs, a little bent
    bent = judge_point(point(0), skeleton, chain="right_arm")
    assert bent.values["elbow_deg"] > 45
    assert "straight" not in bent.reason
