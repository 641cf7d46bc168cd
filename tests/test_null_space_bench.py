"""Virtual people of the benchmark, and what enters it."""

import importlib
import sys
from pathlib import Path

import numpy as np
import other_body
import pytest
from scipy.interpolate import CubicSpline

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

# Imported by name: the benchmarks are no package of ours.
virtual_people = importlib.import_module("null_space.virtual_people")
entrants = importlib.import_module("null_space.entrants")
arms = importlib.import_module("null_space.virtual_arm")
sys.path.remove(str(ROOT / "benchmarks"))

Array = np.ndarray


@pytest.fixture(scope="module")
def person() -> object:
    return virtual_people.draw_virtual(3)


@pytest.fixture(scope="module")
def postures() -> Array:
    easy = np.radians([25, 35, 15, 80, 40, -5, 5])
    return easy + 0.3 * np.random.default_rng(0).normal(size=(12, 7))


def test_pose_is_that_of_the_body(person, postures) -> None:
    """Written twice: once with markers and differences, once with axes and levers."""
    at = arms.pose(person.arm, postures)
    _, knuckle, hand = other_body.place(person.arm, postures)
    np.testing.assert_allclose(at.knuckle, knuckle, atol=1e-12)
    np.testing.assert_allclose(at.hand, hand, atol=1e-12)
    # Central differences with steps of 1e-6.
    J = other_body.hand_jacobian(person.arm, postures)
    np.testing.assert_allclose(at.jacobian, J, atol=1e-8)


def test_posture_is_found_for_wrist_and_swivel(person, postures) -> None:
    at = arms.pose(person.arm, postures)
    q = arms.posed(person.arm, at.wrist, at.swivel + 0.2, postures[:, 4:])
    found = arms.pose(person.arm, q)
    np.testing.assert_allclose(found.wrist, at.wrist, atol=1e-8)
    np.testing.assert_allclose(arms.wrapped(found.swivel - at.swivel), 0.2, atol=1e-7)
    np.testing.assert_array_equal(q[:, 4:], postures[:, 4:])


def test_forearm_and_wrist_turn_a_hand_back(person, postures) -> None:
    turned = postures + [0, 0, 0, 0, 0.2, -0.1, 0.1]
    goal = arms.pose(person.arm, postures).hand
    found = arms.pose(person.arm, arms.oriented(person.arm, turned, goal)).hand
    # Damped steps leave a hundredth of an angle each, ten of them nothing.
    np.testing.assert_allclose(found, goal, atol=1e-6)


def test_walk_holds_the_hand_while_the_elbow_turns(person, postures) -> None:
    arm = person.arm
    found = arms.walk(arm, postures, farthest=0.5)
    held = [way for way in found.ways if isinstance(way, CubicSpline)]
    assert len(held) >= 6
    for k, way in enumerate(found.ways):
        if way is None:
            continue
        turn = np.linspace(-0.5, 0.5, 21)
        at = arms.pose(arm, way(turn))
        # A cubic spline through steps of 2 deg.
        np.testing.assert_allclose(
            arms.wrapped(at.swivel - found.start[k]), turn, atol=1e-4
        )
        off = np.broadcast_to(found.position[k], at.knuckle.shape)
        np.testing.assert_allclose(at.knuckle, off, atol=1e-4)


def test_a_turned_hand_leaves_the_elbow_and_the_natural_swivel_is_kept(person) -> None:
    rng = np.random.default_rng(1)
    at = virtual_people.rests(person, rng.uniform(-0.1, 0.1, (4, 3)), rng)
    q = arms.pose(person.arm, virtual_people.naturally(person, at))
    wanted = person.natural(q.wrist, q.hand_axis) + at.off
    # Six rounds: the swivel moves the hand's axis a little, and that the swivel less.
    np.testing.assert_allclose(q.swivel, wanted, atol=np.radians(0.5))
    for kind in virtual_people.TURNS:
        rows, place = virtual_people.turning(person, at, kind)
        elbow = arms.pose(person.arm, rows).centers[:, 4]
        for k in range(4):
            spread = np.ptp(elbow[place == k], axis=0)
            np.testing.assert_allclose(spread, 0, atol=1e-12)


def toy(seed: int) -> dict[str, Array]:
    """Ten places; q moves along one direction, by 0.6 either way, with the wrist's way.

    A swivel is the first joint.
    """
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-0.15, 0.15, (10, 3)) + [0.3, -0.2, 0.2]
    groups = np.repeat(np.arange(10), 60)
    c = rng.uniform(0, 1, 600)
    c[::60], c[1::60] = 0.0, 1.0
    z = np.array([0.8, 0.3, -0.3, 0.0, 0.2, 0.2, 0.3])
    X = centers[groups] + 1e-3 * rng.normal(size=(600, 3))
    y = 1.2 * (c[:, None] - 0.5) * z / np.linalg.norm(z) + 1e-4 * rng.normal(
        size=(600, 7)
    )
    return {"X": X, "y": y, "groups": groups, "c": c}


@pytest.mark.parametrize("name", [n for n in entrants.SHIPPED if n != "Jacobian"])
def test_what_ships_reads_a_motion_along_one_direction(name: str) -> None:
    data = toy(4)
    what = entrants.SHIPPED[name]
    y = data["y"][:, :1] if what.reads == "swivel" else data["y"]
    made = what().fit(
        data["X"],
        y,
        groups=data["groups"],
        natural_X=data["X"][::7],
        natural_y=y[::7],
    )
    found = made.control_signal(y, data["X"])
    rising = np.corrcoef(found, data["c"])[0, 1] > 0
    error = (found if rising else 1 - found) - data["c"]
    # Noise of 1e-4 of a range of 1.2; an autoencoder only comes near.
    assert np.sqrt(np.mean(error**2)) < (0.05 if name == "autoencoder" else 0.01)


def test_an_entrant_is_found_by_name_or_refused_in_a_sentence() -> None:
    assert entrants.entrant("intent") in entrants.PACKAGE
    assert entrants.entrant("swivel") is entrants.SHIPPED["swivel"]
    assert entrants.entrant("collections:OrderedDict").__name__ == "OrderedDict"
    for wrong in ("swivle", "no_such_module:Class", "collections:Nothing", ""):
        with pytest.raises(SystemExit, match="give module:Class, or one of"):
            entrants.entrant(wrong)
