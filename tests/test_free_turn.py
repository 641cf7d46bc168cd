"""Markers on skin that turns by an angle of its own: forearm clusters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.motion.marker_ik.pose import LIMIT, PRIOR
from ikns.motion.marker_ik.visibility import visible_segments

#: First letters of the labels of either cluster.
FOREARMS = ("RLAR", "LLAR")


@pytest.fixture(scope="module")
def body() -> Skeleton:
    whole = Skeleton.load(marker_set="ue_adl")
    return whole.with_markers(whole.marker_set.without_static())


def posture(body: Skeleton, rng: np.random.Generator) -> np.ndarray:
    q = body.neutral()
    # Away from limits, straight elbows and the shoulder's gimbal lock.
    arm = rng.uniform(-1, 1, (2, 9)) * [0, 0, 0.8, 0.8, 0.8, 0.6, 0.8, 0.6, 0.3]
    q[7:] = (arm + [0, 0, 0, 0, 0, 1.2, 0, 0, 0]).ravel()
    return body.integrate(q, np.r_[rng.normal(0, 0.5, 6), np.zeros(18)])


def seen_with_skin(
    body: Skeleton, q: np.ndarray, turns: tuple[float, float]
) -> np.ndarray:
    """Markers of a pose whose forearm skin turned by so much against the bone, rad."""
    turned = q.copy()
    for side, turn in zip(("right", "left"), turns, strict=True):
        turned[7 + body.joint_names.index(f"{side}_forearm_pronation")] += turn
    markers = body.markers_in_world(q)
    on_skin = [label.startswith(FOREARMS) for label in body.marker_set.labels]
    markers[on_skin] = body.markers_in_world(turned)[on_skin]
    return markers


def test_ue_adl_lets_the_forearm_clusters_turn():
    free = {m.label for m in MarkerSet.load("ue_adl").markers if m.free_turn}
    assert free == {f"{side}LAR{k}" for side in "RL" for k in (1, 2, 3, 4)}
    assert not any(m.free_turn for m in MarkerSet.load("oxford24").markers)


def test_a_set_with_a_free_turn_is_read_as_it_was_written(tmp_path):
    worn = MarkerSet.load("ue_adl")
    worn.write(tmp_path / "set.toml")
    again = MarkerSet.load(tmp_path / "set.toml")
    assert [m.free_turn for m in again.markers] == [m.free_turn for m in worn.markers]


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.floats(-1.4, 1.4), st.floats(-1.4, 1.4))
def test_turned_skin_changes_no_joint(body, seed, right, left):
    rng = np.random.default_rng(seed)
    q = posture(body, rng)
    seen = seen_with_skin(body, q, (right, left))
    free = [name not in body.marker_set.held for name in body.joint_names]
    off = np.r_[np.zeros(6), rng.normal(0, 0.05, 18) * free]
    # Frame after frame of the same markers, so that the pull to the pose before ends:
    # what is left shrinks by a factor of ten or more a frame.
    solver, pose = MarkerIK(body), MarkerIK(body).solve(seen, body.integrate(q, off))
    for _ in range(5):
        pose = solver.solve(seen, pose.q)
    assert pose.converged
    # Ten times the tolerance of the solver's steps, and so much on a lever of 0.5 m.
    assert np.abs(body.difference(q, pose.q)).max() < 1e-4
    np.testing.assert_allclose(turned_markers(body, pose.q, seen), seen, atol=5e-5)


@settings(deadline=None, max_examples=8)
@given(st.integers(0, 10**6), st.floats(0, 0.02), st.floats(0, 0.3))
def test_a_frame_is_solved_to_the_minimum_of_the_cost(body, seed, noise, hidden):
    rng = np.random.default_rng(seed)
    before = posture(body, rng)
    seen = seen_with_skin(body, before, tuple(rng.uniform(-1, 1, 2)))
    seen += rng.normal(0, noise, seen.shape)
    seen[rng.random(len(seen)) < hidden] = np.nan
    # With errors of centimeters a frame takes up to 70 steps, turned or not.
    pose = MarkerIK(body, max_iterations=300).solve(seen, before)
    assert pose.converged
    weight = np.array([m.weight for m in body.marker_set.markers])
    columns = np.setdiff1d(np.arange(24), body.columns(body.marker_set.held))

    def cost(q):
        square = ((turned_markers(body, q, seen) - seen) ** 2).sum(axis=1)
        moved = body.difference(before, q)
        beyond = np.maximum(q[7:] - body.upper, 0) + np.minimum(q[7:] - body.lower, 0)
        return (
            np.nansum(weight * square)
            + PRIOR**2 * moved @ moved
            + LIMIT**2 * beyond @ beyond
        )

    # A step of the solver that is left (1e-5) times a Hessian below 2 * 100 m^2; h^2
    # times third derivatives of that size.
    h = 1e-5
    for column in columns:
        step = h * np.eye(24)[column]
        there, back = body.integrate(pose.q, step), body.integrate(pose.q, -step)
        assert abs(cost(there) - cost(back)) / (2 * h) < 2e-3


def test_no_cluster_shows_pronation_without_the_hand(body):
    q = posture(body, np.random.default_rng(1))
    markers = body.markers_in_world(q)[None]
    on_hand = [m.link == "right_hand" for m in body.marker_set.markers]
    markers[:, on_hand] = np.nan
    known = dict(
        zip(body.joint_names, visible_segments(body, markers).known[0], strict=True)
    )
    assert known["right_elbow_flexion"]
    assert known["left_forearm_pronation"]
    assert not known["right_forearm_pronation"]


def test_clusters_turn_about_the_pronation_axis_only(body):
    rng = np.random.default_rng(2)
    q = posture(body, rng)
    seen = body.markers_in_world(q) + rng.normal(
        0, 0.05, (len(body.marker_set.labels), 3)
    )
    placed, plain = turned_markers(body, q, seen), body.markers_in_world(q)
    free = np.array([m.free_turn for m in body.marker_set.markers])
    np.testing.assert_array_equal(placed[~free], plain[~free])
    # The best turn: no other is nearer, and distances within a cluster are kept.
    right = [k for k, label in enumerate(body.marker_set.labels) if "RLAR" in label]
    spans = [
        np.linalg.norm(p[right][:, None] - p[right][None], axis=2)
        for p in (placed, plain)
    ]
    np.testing.assert_allclose(*spans, atol=1e-12)
    best = np.sum((placed[right] - seen[right]) ** 2)
    for turn in np.linspace(-3, 3, 61):
        other = seen_with_skin(body, q, (turn, 0.0))
        assert np.sum((other[right] - seen[right]) ** 2) >= best - 1e-12
