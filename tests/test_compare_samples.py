"""The full comparison on planted cases: every value is known beforehand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import ortho_group

from ikns.analysis.compare import (
    Kinematics,
    chance_angles,
    chance_inside,
    compare_samples,
    learned_directions,
)
from ikns.analysis.compare.chance import random_subspaces
from ikns.errors import InvalidInput, NotEnoughData
from ikns.numerics.subspace import principal_angles

N, JOINTS = 300, 7
TIME = np.arange(2 * N) / 100
LABELS = np.repeat([0, 1], N)
#: Two whole periods of a sine: its mean is zero, its variance a half.
SWEEP = np.sin(np.linspace(0, 4 * np.pi, N, endpoint=False))
SLOPE = np.array([0.0, 0.03, 0.04])  # 50 mm of hand for each unit of the sweep
TURN = np.array([0.1, 0.0, 0.0])


def planted(angle, rng, *, k=6, across=0.0):
    """Two points at which joints move at this angle from the null space of one J.

    `across` adds independent motion of this size in all directions.
    """
    frame = ortho_group.rvs(JOINTS, random_state=rng)
    null, task = frame[: JOINTS - k], frame[JOINTS - k :]
    Z = np.cos(angle) * null[0] + np.sin(angle) * task[0]
    q = np.tile(np.outer(SWEEP, Z), (2, 1)) + rng.normal(size=JOINTS)
    q += across * rng.normal(size=q.shape)
    J = rng.normal(size=(k, k)) @ task
    c = np.tile(SWEEP, 2)
    return {
        "time": TIME,
        "q": q,
        "jacobians": np.tile(J, (len(q), 1, 1)),
        "position": c[:, None] * SLOPE / 2 + [0.3, 0.1, 0.2],
        "rotation": Rotation.from_rotvec(c[:, None] * TURN / 2).as_matrix(),
        "labels": LABELS,
        "directions": np.tile(Z, (2, 1)),
        "lower": np.full(2, -1.0),
        "upper": np.full(2, 1.0),
    }


def test_planted_angles_shares_and_leaks_come_out():
    angle = np.radians(25.0)
    case = planted(angle, np.random.default_rng(0))
    found = compare_samples(**case, resamples=50)
    assert found.null_dim == 1
    # Rounding of eigenvectors and of sums over 300 samples.
    for name in ("angles", "mean_posture_angles"):
        np.testing.assert_allclose(getattr(found, name)[:, 0], angle, atol=1e-9)
    # Motion on a line: its share inside another line is the squared cosine.
    np.testing.assert_allclose(found.inside, np.cos(angle) ** 2, atol=1e-9)
    np.testing.assert_allclose(found.inside_mean_posture, found.inside, atol=1e-12)
    # c goes from 0 to 1 while the sweep goes from -1 to 1.
    np.testing.assert_allclose(found.leak[:, 0], 0.05, atol=1e-9)
    np.testing.assert_allclose(found.turn[:, 0], 0.1, atol=1e-9)
    J, Z = case["jacobians"][0], case["directions"][0]
    rates = 2 * J @ Z  # c has the range 2
    np.testing.assert_allclose(found.kinematic_leak[:, 0], np.linalg.norm(rates[:3]))
    np.testing.assert_allclose(found.kinematic_turn[:, 0], np.linalg.norm(rates[3:]))
    np.testing.assert_allclose(found.curvature, 0, atol=1e-7)
    np.testing.assert_allclose(found.agreement, 1, atol=1e-12)
    np.testing.assert_allclose(found.concentration, 1, atol=1e-12)
    # The same at both points: so is their root mean square.
    pooled = {name: value for name, (value, _, _) in found.pooled.items()}
    assert pooled["angle"] == pytest.approx(angle)
    assert pooled["leak"] == pytest.approx(0.05)
    assert pooled["inside"] == pytest.approx(np.cos(angle) ** 2)


def test_a_direction_inside_a_larger_null_space_has_no_angle_to_it():
    case = planted(0.0, np.random.default_rng(1), k=3)
    found = compare_samples(**case, resamples=0)
    assert found.null_dim == 4
    np.testing.assert_allclose(found.angles, 0, atol=1e-7)
    np.testing.assert_allclose(found.inside, 1, atol=1e-12)
    assert np.isnan(found.angle_interval).all()


def test_two_directions_against_one_null_vector():
    rng = np.random.default_rng(2)
    case = planted(0.0, rng)
    null = case["directions"][0]
    other = rng.normal(size=JOINTS)
    other -= null * (other @ null)
    other /= np.linalg.norm(other)
    slow = np.cos(np.linspace(0, 6 * np.pi, N, endpoint=False))
    case["q"] = case["q"] + np.outer(np.tile(slow, 2), other)
    case["directions"] = np.tile([null, other], (2, 1, 1))
    case["lower"], case["upper"] = np.full((2, 2), -1.0), np.full((2, 2), 1.0)
    found = compare_samples(**case, resamples=20)
    # The null vector lies in the plane of both directions; the hand follows the first.
    np.testing.assert_allclose(found.angles, 0, atol=1e-7)
    np.testing.assert_allclose(found.leak, [[0.05, 0]] * 2, atol=1e-9)
    assert found.pooled["leak"][0] == pytest.approx(0.05 / np.sqrt(2))


def test_intervals_hold_the_planted_values_and_shrink_with_time():
    angle = np.radians(8.0)
    rng = np.random.default_rng(3)
    case = planted(angle, rng, across=0.05)
    case["directions"] = np.stack(
        [
            learned_directions(case["q"][own], case["directions"][:1])[0]
            for own in (LABELS == 0, LABELS == 1)
        ]
    )
    case["position"] = case["position"] + 0.005 * rng.normal(size=(2 * N, 3))
    found = compare_samples(**case, resamples=300)
    low, high = found.angle_interval.T
    assert ((low <= angle) & (angle <= high)).all()
    low, high = found.leak_interval[:, 0].T
    assert ((low <= 0.05) & (found.leak[:, 0] <= high)).all()
    half = {name: value[::8] for name, value in case.items() if len(value) == 2 * N}
    fewer = compare_samples(**(case | half), resamples=300)
    width, wider = (np.diff(each.leak_interval[:, 0]).mean() for each in (found, fewer))
    # An eighth of the independent samples: sqrt(8) = 2.8 times as wide, and wider yet
    # by Student's quantile.
    assert wider > 1.8 * width


@settings(max_examples=20)
@given(st.permutations(range(JOINTS)), st.integers(0, 2**32))
def test_neither_the_order_of_joints_nor_the_axes_of_the_thorax_matter(order, seed):
    rng = np.random.default_rng(seed)
    case = planted(0.3, rng, across=0.1)
    turn = Rotation.random(None, rng)
    other = case | {
        "q": case["q"][:, order],
        "jacobians": np.array(
            [
                np.vstack([turn.apply(J[:3, order].T).T, turn.apply(J[3:, order].T).T])
                for J in case["jacobians"][:1]
            ]
            * (2 * N)
        ),
        "directions": case["directions"][:, order],
        "position": turn.apply(case["position"]),
        "rotation": turn.as_matrix() @ case["rotation"] @ turn.inv().as_matrix(),
    }
    first, second = (compare_samples(**each, resamples=0) for each in (case, other))
    for name in (
        "angles",
        "mean_posture_angles",
        "inside",
        "leak",
        "turn",
        "kinematic_leak",
        "kinematic_turn",
        "agreement",
    ):
        # Rounding, some thousand operations deep.
        np.testing.assert_allclose(
            getattr(first, name), getattr(second, name), rtol=1e-7, atol=1e-9
        )


def test_the_same_seed_gives_the_same_intervals():
    case = planted(0.1, np.random.default_rng(4), across=0.1)
    first, again, other = (compare_samples(**case, seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(first.angle_interval, again.angle_interval)
    assert (first.angle_interval != other.angle_interval).any()


def test_straight_lines_depart_from_a_circle_by_its_chord():
    # One joint turns the hand about Z at a radius of half a meter; another does nothing
    # but move, and is the null space.
    case = planted(0.0, np.random.default_rng(5))
    q = np.stack([np.tile(SWEEP, 2), np.cos(7 * TIME)], axis=1)

    def pose(given):
        turned = Rotation.from_rotvec(np.outer(given[..., 0], [0, 0, 1]))
        shape = given.shape[:-1]
        position = turned.apply([0.5, 0, 0]).reshape(*shape, 3)
        return position, turned.as_matrix().reshape(*shape, 3, 3)

    def jacobian(given):
        angle = given[..., 0]
        column = 0.5 * np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
        return np.stack([column, np.zeros_like(column)], axis=-1)

    x, R = pose(q)
    found = compare_samples(
        **case
        | {
            "q": q,
            "jacobians": jacobian(q),
            "position": x,
            "rotation": R,
            "directions": np.tile([1.0, 0.0], (2, 1)),
        },
        kinematics=Kinematics(pose, jacobian),
        resamples=0,
    )
    # From the middle to either end by 1 rad: a chord.
    np.testing.assert_allclose(found.straight_leak, 2 * 0.5 * np.sin(0.5), rtol=1e-9)
    np.testing.assert_allclose(found.straight_turn, 1.0, rtol=1e-9)
    # 0.5 m/rad over a range of 2 rad; a central difference of 1e-5 rad errs by 1e-10.
    np.testing.assert_allclose(found.kinematic_leak[:, 0], 1.0, rtol=1e-9)
    np.testing.assert_allclose(found.kinematic_turn[:, 0], 2.0, rtol=1e-9)


def test_curvature_is_how_far_the_null_vector_turns_from_end_to_end():
    case = planted(0.0, np.random.default_rng(6))
    c = np.tile(SWEEP, 2)
    # Piecewise constant, so that averages over an end are exact.
    turn = np.where(c < -0.5, -0.2, np.where(c > 0.5, 0.3, 0.0))
    q = np.stack([c, 0.01 * np.cos(9 * TIME)], axis=1)
    J = np.stack([-np.sin(turn), np.cos(turn)], axis=1)[:, None]
    found = compare_samples(
        **case | {"q": q, "jacobians": J, "directions": np.tile([1.0, 0.0], (2, 1))},
        resamples=0,
    )
    np.testing.assert_allclose(found.curvature, 0.5, atol=1e-9)


# --- chance --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("d", "null_dim", "n"), [(1, 1, 7), (1, 4, 7), (4, 1, 7), (1, 3, 9), (1, 6, 7)]
)
def test_chance_in_closed_form_is_what_random_lines_show(d, null_dim, n):
    rng = np.random.default_rng(7)
    drawn = random_subspaces(d, n, 20000, rng)
    angles = principal_angles(drawn, np.eye(n)[:null_dim]).max(axis=1)
    below = [np.mean(angles < q) for q in chance_angles(d, null_dim, n)]
    # Shares of 20000 draws: standard errors 0.0015 and 0.0035.
    np.testing.assert_allclose(below, [0.05, 0.5], atol=0.011)


@pytest.mark.parametrize(("d", "null_dim", "n"), [(2, 3, 7), (3, 6, 7), (4, 6, 9)])
def test_chance_without_closed_form_is_what_random_subspaces_show(d, null_dim, n):
    drawn = random_subspaces(d, n, 20000, np.random.default_rng(8))
    angles = principal_angles(drawn, np.eye(n)[:null_dim]).max(axis=1)
    below = [np.mean(angles < q) for q in chance_angles(d, null_dim, n, seed=9)]
    # Now the quantiles come from 4000 draws too: 0.0034 and 0.0079, five of them.
    np.testing.assert_allclose(below, [0.05, 0.5], atol=0.04)


def test_random_subspaces_hold_their_share_of_the_variance():
    rng = np.random.default_rng(10)
    S = np.diag(rng.uniform(0.1, 2, 7))
    drawn = random_subspaces(3, 7, 20000, rng)
    inside = np.einsum("bri,ij,brj->b", drawn, S, drawn) / np.trace(S)
    # Mean 3/7; spread below 0.2, over 20000 draws 0.0014.
    assert inside.mean() == pytest.approx(3 / 7, abs=0.007)
    median, high = chance_inside(S, 3)
    assert np.mean(inside < high) == pytest.approx(0.95, abs=0.02)
    assert np.mean(inside < median) == pytest.approx(0.5, abs=0.04)


# --- what is refused -----------------------------------------------------------------


def constant_joint(case):
    case["q"] = np.array(case["q"])
    case["q"][:, 2] = 0.4


def straight_arm(case):
    case["jacobians"] = np.array(case["jacobians"])
    case["jacobians"][100:103, 5] = 0


BAD = {
    "nobody there": (
        lambda case: case.update(labels=np.full(2 * N, -1)),
        NotEnoughData,
        "found none",
    ),
    "rank loss": (straight_arm, InvalidInput, "rank 5 in 3 of 600 samples"),
    "a chain that does not reach the hand": (
        lambda case: case.update(jacobians=np.zeros((2 * N, 6, 7))),
        InvalidInput,
        "ends in the hand",
    ),
    "no null space": (
        lambda case: case.update(jacobians=np.tile(np.eye(7), (2 * N, 1, 1))),
        InvalidInput,
        "no null space",
    ),
    "a constant joint": (constant_joint, NotEnoughData, "the 3. of 7 constant"),
    "too few samples": (
        lambda case: case.update(labels=np.where(np.arange(2 * N) < 13, 1, 0)),
        NotEnoughData,
        "at least 14 samples of 7 joints at each PCA point, found 13 at point 2",
    ),
    "other joints": (
        lambda case: case.update(q=case["q"][:, :6]),
        InvalidInput,
        r"q \(N, 7\)",
    ),
    "not a number": (
        lambda case: case.update(position=case["position"] * np.nan),
        InvalidInput,
        "finite",
    ),
    "time that stands still": (
        lambda case: case.update(time=np.zeros(2 * N)),
        InvalidInput,
        "increasing time",
    ),
    "a label without a point": (
        lambda case: case.update(labels=LABELS + 1),
        InvalidInput,
        "below the 2 points",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_what_cannot_be_compared_is_refused_in_one_sentence(what):
    case = planted(0.1, np.random.default_rng(11))
    change, error, sentence = BAD[what]
    change(case)
    with pytest.raises(error, match=sentence) as caught:
        compare_samples(**case)
    assert str(caught.value).endswith(".")
    assert ". " not in str(caught.value).replace("3. of", "")
