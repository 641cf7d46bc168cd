"""How simulated people hold an arm while they mean nothing."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import FileError, InvalidInput
from ikns.simulation import posture_habits as module
from ikns.simulation import simulate_protocol, virtual_subject
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual import habitual_posture
from ikns.simulation.habitual_places import habitual_somewhere, natural_swivel
from ikns.simulation.places import BOX_HIGH, BOX_LOW, box_points, comfortable_posture
from ikns.simulation.posture_habits import (
    PostureHabits,
    draw_hands,
    draw_posture_habits,
    draw_reaches,
    habit_people,
    habit_terms,
)
from ikns.simulation.protocol_body import RESTING, both_arms

Array = np.ndarray
RANGE = np.radians(70.0)
#: Mean change of the hinge swivel a reach, of the range, of the people that the file is
#: from (benchmarks/posture_habits.py).
REAL = 0.14


def constant(swivel: float, rest: float = 0.0) -> PostureHabits:
    """One swivel everywhere."""
    return PostureHabits(
        np.r_[swivel, np.zeros(27)], np.zeros((1, 6)), np.zeros(1), 0.0, rest
    )


def hinge_by_hand(arm: ArmKinematics, angles: Array) -> float:
    """Swivel by the formula, from link poses alone; a left arm mirrored first."""
    p, R = arm.skeleton.link_in_thorax(angles, f"{arm.side}_upper_arm")
    w = arm.skeleton.link_in_thorax(angles, f"{arm.side}_hand")[0]
    flip = np.array([1.0, 1.0, arm.outward])
    z = R[:, 2] * (1 if arm.side == "right" else np.array([-1, -1, 1]))
    n = (w - p) * flip / np.linalg.norm(w - p)
    f = np.array([0.925, -0.174, 0.337])
    f /= np.linalg.norm(f)
    d = np.array([0, -1.0, 0]) + f[1] * f
    d /= np.linalg.norm(d)
    axis = np.cross(f, n)
    K = np.cross(axis, np.eye(3)).T
    turn = np.eye(3) + K + K @ K / (1 + f @ n)  # the least rotation from f to n
    u, e = turn @ d, np.cross(n, z)
    return float(np.arctan2(e @ np.cross(u, n), e @ u))


@pytest.fixture(scope="module")
def arms() -> dict[str, ArmKinematics]:
    skeleton = virtual_subject(3).skeleton
    return {side: ArmKinematics(skeleton, side) for side in ("right", "left")}


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_terms_are_all_products_of_two(seed: int) -> None:
    """A random quadratic in six numbers is a sum of the terms: 28 of them suffice."""
    rng = np.random.default_rng(seed)
    w, axis = rng.uniform(-0.4, 0.6, (60, 3)), rng.normal(size=(60, 3))
    z = np.hstack([w, axis])
    A, b, c = rng.normal(size=(6, 6)), rng.normal(size=6), rng.normal()
    y = np.einsum("ni,ij,nj->n", z, A, z) + z @ b + c
    terms = habit_terms(w, axis)
    assert terms.shape == (60, 28)
    left = y - terms @ np.linalg.lstsq(terms, y, rcond=None)[0]
    # 60 equations of order 10, condition 1e4: rounding of 1e-11.
    np.testing.assert_allclose(left, 0, atol=1e-9)


def test_people_turn_the_elbow_as_much_as_those_they_were_drawn_from() -> None:
    """Mean over 40 people, and the spread between them."""
    rng = np.random.default_rng(0)
    change = []
    for person in range(40):
        habits = draw_posture_habits(person)
        place, hands = draw_reaches(rng, 25)
        # An arm of 0.55 m, with the shoulder where a right one is.
        w = 0.55 * place + [-0.02, -0.02, 0.17]
        # The long axis of the hand at its zero is -Y.
        swivel = habits.swivel(w, -hands[..., 1])
        swivel += habits.rest * rng.normal(size=swivel.shape)
        change.append(np.abs(np.diff(swivel, axis=1)).mean() / RANGE)
    # Within 20 %, as was asked; between arms it spreads by 0.03, so 40 leave 0.005.
    assert np.mean(change) == pytest.approx(REAL, rel=0.2)
    assert 0.02 < np.std(change) < 0.08


def test_rough_field_is_no_quadratic_and_as_large_as_said() -> None:
    rng = np.random.default_rng(1)
    w, axis = rng.uniform(-0.2, 0.6, (3000, 3)), rng.normal(size=(3000, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    people = habit_people()
    size = np.sqrt(people.residual**2 - people.rest**2)
    left, whole = [], []
    for seed in range(10):
        habits = draw_posture_habits(seed)
        rough = habits.swivel(w, axis) - habit_terms(w, axis) @ habits.coefficients
        terms = habit_terms(w, axis)
        rest = rough - terms @ np.linalg.lstsq(terms, rough, rcond=None)[0]
        left.append(np.mean(rest**2))
        whole.append(np.mean(rough**2))
    # Mean squares of 48 waves spread by a fifth; ten people, by 0.07.
    assert np.sqrt(np.mean(whole)) == pytest.approx(size, rel=0.15)
    assert np.mean(left) > 0.5 * np.mean(whole)


@pytest.mark.parametrize("side", ["right", "left"])
def test_posture_has_the_natural_swivel_and_the_hand_at_its_place(
    arms: dict[str, ArmKinematics], side: str
) -> None:
    arm = arms[side]
    sitting = both_arms(arm.skeleton, RESTING)
    goal = arm.shoulder(sitting) + [0.38, -0.15, 0.05 * arm.outward]
    known = arm.put(sitting, RESTING)
    rotation = arm.hand(known)[1]
    for swivel in np.radians([30.0, 50.0]):
        posture = habitual_posture(
            arm,
            sitting,
            goal,
            rotation,
            habits=constant(swivel),
            scatter=0.1,
            girdle_rest=np.zeros(2),
        )
        body = arm.put(sitting, posture)
        # Least squares ends at steps of 1e-9.
        assert hinge_by_hand(arm, body) == pytest.approx(swivel + 0.1, abs=1e-4)
        # The hand's turn settles in three rounds.
        np.testing.assert_allclose(arm.hand(body)[0], goal, atol=2e-3)


def test_place_out_of_reach_is_refused(arms: dict[str, ArmKinematics]) -> None:
    arm = arms["right"]
    sitting = both_arms(arm.skeleton, RESTING)
    with pytest.raises(InvalidInput, match="does not reach"):
        habitual_posture(
            arm,
            sitting,
            arm.shoulder(sitting) + [1.2, 0.0, 0.0],
            np.eye(3),
            habits=constant(0.8),
            scatter=0.0,
            girdle_rest=np.zeros(2),
        )


@pytest.mark.parametrize("side", ["right", "left"])
def test_natural_swivel_is_that_of_the_habits(
    arms: dict[str, ArmKinematics], side: str
) -> None:
    arm = arms[side]
    sitting = both_arms(arm.skeleton, RESTING)
    settings = {"wrist": np.zeros(3), "girdle_rest": np.zeros(2)}
    place = arm.shoulder(sitting) + [0.4, -0.1, 0.1 * arm.outward]
    wanted = np.radians(52.0)
    swivel = natural_swivel(arm, sitting, place, habits=constant(wanted), **settings)
    posture = comfortable_posture(arm, sitting, place, swivel=swivel, **settings)
    # Each of four rounds leaves a small share of what was off.
    assert hinge_by_hand(arm, arm.put(sitting, posture)) == pytest.approx(
        wanted, abs=np.radians(0.1)
    )


def test_somewhere_is_in_the_box_or_its_hand_was_turned_back(
    arms: dict[str, ArmKinematics],
) -> None:
    arm = arms["right"]
    sitting = both_arms(arm.skeleton, RESTING)
    lengths = arm.skeleton.segment_lengths
    size = sum(lengths[f"right_{part}"] for part in ("upper_arm", "forearm", "hand"))
    rng = np.random.default_rng(5)
    for _ in range(5):
        place = habitual_somewhere(
            arm,
            sitting,
            habits=draw_posture_habits(5),
            girdle_rest=np.zeros(2),
            rng=rng,
        )
        share = (place.position - arm.shoulder(sitting)) / size
        # A hand that cannot be turned as drawn leaves its place, by less than itself.
        assert (share > BOX_LOW - 0.2).all()
        assert (share < BOX_HIGH + 0.2).all()


def test_drawn_hands_are_rotations_and_reaches_can_be_done() -> None:
    wrists, hands = draw_reaches(7, 50)
    far = np.linalg.norm(wrists, axis=2)
    assert ((far > 0.27) & (far < 0.97)).all()
    some = draw_hands(7, wrists[:, 1])
    for R in (hands, some[:, None]):
        np.testing.assert_allclose(
            R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-9
        )
        assert (np.linalg.det(R) > 0).all()


def test_people_hold_the_hand_4_to_6_cm_off_the_box() -> None:
    """Mean over two people of ten places: 4.8 cm, less what is sought nearer."""
    off = []
    for seed in (1, 2):
        run = simulate_protocol(
            virtual_subject(seed), seed=seed, free_seconds=0.1, quick=True, rate=25
        )
        arm = ArmKinematics(run.subject.skeleton, "right")
        sitting = both_arms(arm.skeleton, RESTING)
        (ideal,) = box_points([arm], sitting, n=10)
        off += np.linalg.norm(run.places - ideal, axis=1).tolist()
        assert run.habits is not None
        assert run.settings["habits"] is True
    # Chi with three degrees of freedom: 20 places leave 0.45 cm.
    assert 0.035 < np.mean(off) < 0.06


def test_damaged_file_of_people_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = module._PEOPLE.read_text()
    broken = tmp_path / "people.toml"
    monkeypatch.setattr(module, "_PEOPLE", broken)
    for wrong in ("", text.replace("mean_rad", "mean"), text[:400], "\x00"):
        broken.write_text(wrong)
        habit_people.cache_clear()
        with pytest.raises(FileError, match="cannot be read"):
            habit_people()
    habit_people.cache_clear()
