"""Both designs on motions: what they split is what stands in the motion."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_person

from ikns.analysis.ucm import (
    across_trials,
    aligned_angles,
    movement,
    variance_split,
    within_trial,
)
from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.map import still_mask
from ikns.recording.files import read


def truth() -> tuple[Skeleton, Motion]:
    run = small_person.protocol()
    return run.subject.skeleton, run.points.truth


def repeated(n: int) -> list[Motion]:
    """The same path of the hand with joints off by a little in each trial."""
    motion, rng = truth()[1], np.random.default_rng(1)
    trials = []
    for _ in range(n):
        q = motion.q.copy()
        q[:, 7:] += 0.05 * rng.normal(size=18)
        trials.append(replace(motion, q=q))
    return trials


@pytest.mark.parametrize("task", ["position", "pose"])
def test_a_design_splits_the_chain_at_the_mean_posture_of_the_whole_body(task) -> None:
    skeleton, _ = truth()
    trials = repeated(9)
    angles = aligned_angles(trials, "right_arm", samples=11)
    columns = skeleton.columns(chain_joints("right_arm")) - 6
    J = skeleton.chain_jacobian(angles.mean(axis=0), "right_arm", task=task)
    expected = variance_split(angles[..., columns], J)
    found = across_trials(skeleton, trials, task=task, samples=11)
    np.testing.assert_allclose(found.v_ucm, expected.v_ucm, rtol=1e-12)
    np.testing.assert_allclose(found.v_ort, expected.v_ort, rtol=1e-12)


def test_a_swivelling_elbow_varies_where_a_held_pose_does_not_see() -> None:
    """The simulated swivel keeps the pose, but for drift of the hand."""
    skeleton, motion = truth()
    gate, points = still_mask(motion), small_person.protocol().points.point
    ratios = []
    for k in range(10):
        split = within_trial(skeleton, motion, gate & (points == k), task="pose")
        ratios.append(split.v_ucm / split.v_ort)
    # Swivels of 20 deg and more against a drift of 4 mm and 1.2 deg; over the range the
    # null direction turns, which is the most of V_ORT.
    assert min(ratios) > 10


def test_the_side_and_the_clavicle_follow_the_chain() -> None:
    skeleton, motion = truth()
    every = np.isfinite(motion.time)
    assert within_trial(skeleton, motion, every).n_joints == 7
    arm = within_trial(skeleton, motion, every, chain="right_arm_clavicle")
    assert arm.n_joints == 9
    assert within_trial(skeleton, motion, every, chain="left_arm").n_task == 3


def test_motions_that_cannot_be_split_are_refused() -> None:
    skeleton, motion = truth()
    with pytest.raises(NotEnoughData, match="at least 8 trials for the 7 joints .* 3"):
        across_trials(skeleton, repeated(3))
    assert np.isfinite(across_trials(skeleton, repeated(3), min_trials=3).v_ucm).all()
    q = motion.q.copy()
    q[:, 7 + skeleton.joint_names.index("right_wrist_deviation")] = 0.1
    held = replace(motion, q=q)
    with pytest.raises(NotEnoughData, match="right_wrist_deviation is constant"):
        within_trial(skeleton, held, motion.time >= 0)
    with pytest.raises(InvalidInput, match="which of"):
        within_trial(skeleton, motion, [True])
    with pytest.raises(NotEnoughData, match="empty selection"):
        within_trial(skeleton, motion, motion.time < 0)


@pytest.mark.parametrize("name", ["ADL001", "ADL005"])
def test_a_real_reach_lasts_as_long_as_its_authors_say(name: str, data: Path) -> None:
    folder = data / "ue_adl" / name
    static = read(folder / f"{name}_static.csv")
    skeleton, _ = scale(Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3)
    motion = MarkerIK(skeleton).track(read(folder / f"{name}FR1.csv"))
    cut = movement(motion.time, motion.hand_speed("right_arm"))
    with (folder / f"{name}FR1angles.csv").open() as file:
        frames = sum(1 for _ in file) - 1
    # They cut at 3 % of the peak speed of a finger, we at 0.05 m/s of the knuckles,
    # which is 5 to 10 %: a few frames at either end of 100 Hz.
    assert abs(np.ptp(motion.time[cut]) - frames / 100) < 0.2
