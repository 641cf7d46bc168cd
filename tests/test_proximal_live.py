"""The method proximal live: the formula, its gradient, and the same bits again."""

from functools import cache

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns._kernels.body.proximal_signal import proximal_signal
from ikns.body.chains import chain_joints, whole_arms
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.control import FrameSolver
from ikns.live.control.controller import Controller
from ikns.live.control.proximal import proximal_numbers
from ikns.live.control.settings import ControlSettings
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.readout import Readout

CHAINS = ["right_arm", "left_arm_clavicle", "both_arms"]


@cache
def readout(chain: str, n_points: int = 8) -> Readout:
    """Made of random numbers; fewer than five points have no field."""
    rng, arms = np.random.default_rng(n_points), len(whole_arms(chain))
    lower = rng.uniform(-1.5, -1.0, n_points)
    made = NullSpaceMap.from_arrays(
        rng.uniform([0.1, -0.4, -0.3], [0.5, 0.1, 0.4], (n_points, 3)),
        rng.normal(size=(n_points, 4 * arms)),
        lower,
        lower + rng.uniform(1.0, 2.0, n_points),
        interpolation="smooth",
    )
    start = Rotation.random(arms, random_state=1).as_matrix()
    return Readout("proximal", chain, made, start)


def kernel(body: Skeleton, one: Readout, angles: np.ndarray) -> tuple[float, bool]:
    gradient = np.empty(len(angles))
    place = body.chain_ends(angles, one.chain)[0].mean(axis=0)
    c, inside = proximal_signal(proximal_numbers(body, one), angles, place, gradient)
    return c, inside, gradient


@given(st.integers(0, 500), st.sampled_from(CHAINS), st.sampled_from([3, 8]))
@settings(max_examples=20, deadline=None)
def test_the_kernel_is_the_formula_and_its_gradient(seed, chain, n_points):
    body, one = Skeleton.load(), readout(chain, n_points)
    angles = 0.9 * np.random.default_rng(seed).uniform(body.lower, body.upper)
    c, inside, gradient = kernel(body, one, angles)
    expected, within = one.of_postures(body, angles[None])
    step = 1e-6
    ends = angles + step * np.concatenate([np.eye(18), -np.eye(18)])
    up, down = one.of_postures(body, ends)[0].reshape(2, 18)
    differences = (up - down) / (2 * step)
    # Half a turn from its reference a rotation vector jumps by a full one.
    turned = [
        body.link_in_thorax(ends, f"{side}_upper_arm")[1] for side in whole_arms(chain)
    ]
    far = [
        Rotation.from_matrix(start.T @ R).magnitude().max()
        for start, R in zip(one.reference, turned, strict=True)
    ]
    if max(far) > np.pi - 0.05 or np.isnan(c) or np.isnan(expected[0]):
        # A width that is not positive leaves no signal, in both.
        assert np.isnan(c) == np.isnan(expected[0]) or max(far) > np.pi - 0.05
        return
    assert inside == within[0]
    # Some 100 terms, of which the weights may be tens where they are extrapolated.
    scale = max(1.0, abs(float(expected[0])))
    assert abs(c - expected[0]) < 1e-10 * scale
    # Rounding over the step, 1e-10; third order near half a turn, where the rotation
    # vector's derivatives grow as 1 / 0.05, and where the width is small.
    size = max(1.0, float(np.abs(differences).max()), scale)
    np.testing.assert_allclose(gradient, differences, rtol=0, atol=1e-6 * size**2)


def test_frames_give_what_the_motion_gives_and_the_same_bits_again():
    subject = small_person.subject()
    recording = small_person.protocol().points.recording
    chosen, motion = subject.readout("proximal"), subject.motions[0]
    offline = chosen.control_signal(subject.skeleton, motion)[:200]
    markers = subject.skeleton.marker_set.pick(recording.labels, recording.markers)
    known = subject.skeleton, subject.null_space_map, subject.chain
    runs = []
    for _ in range(2):
        solver = FrameSolver(*known, readout=chosen)
        controller = Controller(solver, ControlSettings(method="proximal"))
        frames = [
            controller.frame(markers[i], i / 50, i / 50).solved for i in range(200)
        ]
        runs.append([(f.c[0], f.uncertainty[0], f.inside) for f in frames])
    np.testing.assert_array_equal(*runs)
    c, spread, inside = np.array(runs[0]).T
    seen = np.isfinite(c) & np.isfinite(offline)
    # Poses agree to the tolerance of the marker fit, 1e-6 rad or so.
    np.testing.assert_allclose(c[seen], offline[seen], rtol=0, atol=1e-4)
    assert np.isfinite(c).sum() >= seen.sum() > 0.8 * len(c)
    assert (inside[seen] == chosen.inside(subject.skeleton, motion)[:200][seen]).all()
    # The same from poses that are solved already, but for the start of the memory of
    # markers: theirs are at the recorded pose, to the tolerance of the fit.
    read, worth = FrameSolver(*known, readout=chosen).read(
        motion.q[:200], markers[:200], motion.time[:200], motion.believed("right_arm")
    )
    np.testing.assert_allclose(read[seen, 0], c[seen], rtol=0, atol=1e-4)
    np.testing.assert_allclose(worth[seen, 0], spread[seen], rtol=0.05)


def test_a_hidden_hand_leaves_proximal_certain_and_a_hidden_arm_does_not():
    """Pronation and wrist have no say: c needs the upper arm and the forearm."""
    subject = small_person.subject()
    solver = FrameSolver(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        readout=subject.readout("proximal"),
    )
    recording = small_person.protocol().points.recording
    worn = subject.skeleton.marker_set
    markers = worn.pick(recording.labels, recording.markers)
    arm = [m.link in ("right_upper_arm", "right_forearm") for m in worn.markers]
    whole = [solver.solve(frame).uncertainty[0] for frame in markers[:50]]
    dark = markers[50:75].copy()
    dark[:, arm] = np.nan
    hidden = [solver.solve(frame, 0.02).uncertainty[0] for frame in dark]
    assert hidden[-1] > 5 * np.nanmedian(whole)


def test_a_map_that_is_not_of_proximal_is_refused():
    body, one = Skeleton.load(), readout("right_arm")
    elbow = Readout("proximal", "right_arm", small_person.subject().null_space_map)
    with pytest.raises(InvalidInput, match="expected a smooth map of proximal"):
        proximal_numbers(body, elbow)
    assert len(proximal_numbers(body, one).flexion) == 1
    assert len(chain_joints("right_arm")) == 7
