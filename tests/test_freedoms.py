"""Several outputs: each reads its own motion, and what was not explored is refused.

Wishes are made in closed form, with scipy's rotations and the model's joint order: the
arm turns as one about the line from shoulder to wrist while the hand stays, or the
forearm turns while elbow and wrist stay. No Jacobian is in it.
"""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.calibration.report import points_report
from ikns.errors import InvalidInput, NotEnoughData
from ikns.nullspace.map import MapWarning, NullSpaceMap
from ikns.nullspace.map.dual import dual_rows
from ikns.simulation import simulate_protocol, virtual_subject

TURN = np.radians(20.0)
#: Carrying angle of the right forearm (urdf/README.md), rad.
CARRYING = -0.226893


def person(seed: int, hand_turn: float):
    """Ten points for 5 s, as in the protocol; a slow turn needs them."""
    return simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        hand_turn=hand_turn,
        static_seconds=1.2,
        free_seconds=0.1,
        rate=50,
        **small_person.TAME,
    )


def swivelled(skeleton: Skeleton, posture: np.ndarray, angle: float) -> np.ndarray:
    """Turn a right arm about the line from shoulder to wrist while the hand stays."""
    shoulder, upper = skeleton.link_in_thorax(posture, "right_upper_arm")
    wrist, hand = skeleton.link_in_thorax(posture, "right_hand")
    girdle = skeleton.link_in_thorax(posture, "right_clavicle")[1]
    line = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    moved = Rotation.from_rotvec(-angle * line) * Rotation.from_matrix(upper)
    columns = [skeleton.joint_names.index(j) for j in chain_joints("right_arm")]
    out = np.array(posture)
    first = (Rotation.from_matrix(girdle).inv() * moved).as_euler("XZY")
    out[columns[:3]] = first * [-1, 1, 1]
    forearm = moved * Rotation.from_euler("ZX", [posture[columns[3]], CARRYING])
    last = (forearm.inv() * Rotation.from_matrix(hand)).as_euler("YXZ")
    out[columns[4:]] = last * [1, 1, -1]
    return out


@pytest.mark.parametrize("seed", [1, 4])
def test_each_output_ignores_the_other_motion(seed: int) -> None:
    run = person(seed, TURN)
    subject = calibrate(run.static.recording, [run.points.recording], n_dof=2)
    skeleton, learned = subject.skeleton, subject.null_space_map
    columns = [skeleton.joint_names.index(j) for j in chain_joints("right_arm")]
    raised, turned = [], []
    for mean in learned.cluster_means_:
        posture = np.zeros(len(skeleton.joint_names))
        posture[columns] = mean
        ends = [swivelled(skeleton, posture, s * np.radians(30)) for s in (-1, 1)]
        hands = skeleton.hands_in_thorax(np.array([posture, *ends]))
        # What is called a held hand is one. The closed form has the generic axes; those
        # of the fitted body may be a degree off, 1.4 mm over a hand of 8 cm.
        np.testing.assert_allclose(hands[0][1:, 0], hands[0][[0, 0], 0], atol=1.4e-3)
        x = hands[0][0, 0]
        low, high = learned.control_signal(np.array(ends)[:, columns], x)
        raised.append(high - low)
        ends = np.repeat(mean[None], 2, axis=0)
        ends[:, 4] += [-TURN, TURN]
        low, high = learned.control_signal(ends, x)
        turned.append(high - low)
    up, turn = np.array(raised), np.array(turned)
    # The explored range is 70 deg, or what the shoulder allows, and 40 deg of turn.
    assert np.median(up[:, 0]) > 0.7
    assert np.median(turn[:, 1]) > 0.7
    # Rows are dual: pronation is not in c1 at all. A self-motion is bent, and over
    # 60 deg its mean direction leaves c2 a rest, asked to be at most 0.05.
    assert np.abs(turn[:, 0]).max() < 1e-9
    assert np.median(np.abs(up[:, 1])) <= 0.05


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_second_freedom_that_was_not_explored_is_refused(seed: int) -> None:
    run = person(seed, 0.0)
    with pytest.raises(NotEnoughData, match=r"2 degrees of freedom.*--n-dof"):
        calibrate(run.static.recording, [run.points.recording], n_dof=2)


def test_a_second_output_that_follows_the_first_is_refused() -> None:
    """A bent motion of one freedom spans two components, and is still one."""
    rng = np.random.default_rng(1)
    corners = 0.3 * np.array(list(np.ndindex(2, 2, 2)))
    s = rng.uniform(-1, 1, 8 * 200)
    q = np.zeros((len(s), 7))
    q[:, 1], q[:, 4] = s, 0.6 * s**2 + rng.normal(0, 0.01, len(s))
    learned = NullSpaceMap(8, n_dof=2)
    motions = lambda q: np.eye(7)[[1, 4]]  # noqa: E731
    with pytest.raises(NotEnoughData, match="at 6 of the 8 places or more, found them"):
        learned.fit(np.repeat(corners, 200, axis=0), q, motions=motions)

    q[:, 4] = rng.uniform(-1, 1, len(s))
    learned.fit(np.repeat(corners, 200, axis=0), q, motions=motions)
    from ikns.calibration.freedoms import check_freedoms

    assert check_freedoms(learned, q) == []
    q[:, 4] = 0.8 * s + 0.6 * q[:, 4]
    learned.fit(np.repeat(corners, 200, axis=0), q, motions=motions)
    (told,) = check_freedoms(learned, q)
    assert "outputs 1 and 2 move together (r 0.8" in told


@pytest.mark.parametrize("hidden", ["still", "small", "together"])
@pytest.mark.parametrize("short", [1, 2, 3])
def test_places_that_do_not_show_every_freedom_are_left_out_or_too_many(
    hidden: str, short: int
) -> None:
    """One rule, whatever a place lacks: six of eight places have to show both."""
    rng = np.random.default_rng(short)
    corners = 0.3 * np.array(list(np.ndindex(2, 2, 2)))
    wishes = rng.uniform(-1, 1, (2, 8, 100))
    lacks = rng.permutation(8)[:short]
    wishes[1, lacks] = {
        "still": np.zeros((short, 100)),
        "small": 0.1 * wishes[1, lacks],  # 0.2 rad are less than 15 deg
        "together": wishes[0, lacks] + 0.1 * wishes[1, lacks],
    }[hidden]
    q = np.zeros((800, 7))
    q[:, [1, 4]] = wishes.reshape(2, -1).T
    learned, x = NullSpaceMap(8, n_dof=2), np.repeat(corners, 100, axis=0)
    motions = lambda q: np.eye(7)[[1, 4]]  # noqa: E731
    if short == 3:
        with pytest.raises(NotEnoughData, match="found them at 5:"):
            learned.fit(x, q, motions=motions)
        return
    with pytest.warns(
        MapWarning, match=f"{short} of 8 places do not show 2 degrees of freedom"
    ):
        learned.fit(x, q, motions=motions)
    # Only a place without a direction is missing.
    lacks = lacks if hidden == "still" else lacks[:0]
    left, short = np.delete(corners, lacks, axis=0), len(lacks)
    rows = points_report(learned, rate=50.0)
    assert [row["point"] is None for row in rows].count(True) == short
    found = learned.centers_[np.lexsort(learned.centers_.T[::-1])]
    np.testing.assert_allclose(found, left, atol=1e-12)
    assert len(learned.cluster_means_) == len(learned.counts_) == 8 - short
    assert set(learned.labels_) - {-1} == set(range(8 - short))
    assert (learned.labels_ == -1).sum() == 100 * short
    # The rows of the others are the joints themselves.
    np.testing.assert_allclose(
        learned.directions_, np.tile(np.eye(7)[[1, 4]], (8 - short, 1, 1)), atol=1e-12
    )


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(0, 2))
def test_rows_are_dual_to_motions_within_the_span(seed: int, d: int, more: int) -> None:
    rng = np.random.default_rng(seed)
    span = np.linalg.qr(rng.normal(size=(7, d + more)))[0].T
    # Motions with most of them within the span, well apart.
    inside = np.linalg.qr(rng.normal(size=(d + more, d)))[0].T @ span
    motions = inside + 0.1 * rng.normal(size=(d, 7)) / np.sqrt(7)
    rows = dual_rows(span, motions)
    # Condition below 10: rounding of a few 1e-16 grows to less than 1e-12.
    np.testing.assert_allclose(rows @ motions.T, np.eye(d), atol=1e-12)
    np.testing.assert_allclose(rows @ span.T @ span, rows, atol=1e-12)


def test_motions_outside_the_span_or_of_another_shape_are_refused() -> None:
    assert np.isnan(dual_rows(np.eye(7)[:2], np.eye(7)[[0, 5]])).all()
    assert np.isnan(dual_rows(np.eye(7)[:1], np.eye(7)[:2])).all()
    x = np.repeat(0.3 * np.array(list(np.ndindex(2, 2, 2))), 20, axis=0)
    q = np.random.default_rng(2).normal(size=(len(x), 7)) * (np.arange(7) < 2)
    with pytest.raises(InvalidInput, match=r"motions \(2, 7\), found \(1, 7\)"):
        NullSpaceMap(8, n_dof=2).fit(x, q, motions=lambda q: np.eye(7)[:1])


def test_the_score_is_the_share_in_the_span_however_the_rows_lie() -> None:
    """Rows that are not orthogonal span the same plane, and explain the same."""
    rng = np.random.default_rng(3)
    x = np.repeat(0.3 * np.array(list(np.ndindex(2, 2, 2))), 60, axis=0)
    q = rng.normal(size=(len(x), 7)) * [1, 1, 0, 0, 0, 0, 0]
    skewed = np.array([np.eye(7)[0], (np.eye(7)[0] + np.eye(7)[1]) / np.sqrt(2)])
    learned = NullSpaceMap(8, n_dof=2).fit(x, q, motions=lambda q: skewed)
    assert (
        abs(float((learned.directions_[0, 0] * learned.directions_[0, 1]).sum())) > 0.5
    )
    # Everything moves in that plane: rounding.
    assert learned.score(x, q) == pytest.approx(1.0, abs=1e-12)


def test_the_report_numbers_the_places_that_the_map_has() -> None:
    learned = SimpleNamespace(
        all_centers_=np.eye(3),
        all_counts_=np.array(
            [50, 60, 70]
        ),  # all enough, but the second shows too little
        centers_=np.eye(3)[[0, 2]],
        n_components_=np.array([1, 1]),
        explained_variance_ratio_=np.array([[0.9, 0.1], [0.8, 0.2]]),
        lower_=np.zeros((2, 1)),
        upper_=np.ones((2, 1)),
    )
    rows = points_report(cast(Any, learned), rate=100.0)
    assert [row["point"] for row in rows] == [1, None, 2]
    assert [row.get("explained_variance") for row in rows] == [0.9, None, 0.8]
