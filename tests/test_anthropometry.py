"""Lengths, masses and inertias of a person follow the published tables."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.body.anthropometry import (
    LIMB_SEGMENTS,
    SEXES,
    expected_lengths,
    length_uncertainty,
    normalize_sex,
    row,
    sample_adults,
    segments,
    shoulder_joints,
    table,
)
from ikns.errors import IknsError, InvalidInput

statures = st.floats(1.2, 2.3)
masses = st.floats(25.0, 250.0)
sexes = st.sampled_from(SEXES)


def test_upper_arm_center_of_mass_lies_57_7_percent_from_the_shoulder():
    arm = segments(1.75, 70.0, "male")["upper_arm"]
    assert (arm.proximal, arm.distal) == ("SJC", "EJC")
    assert arm.com_m / arm.length_m == pytest.approx(0.5772, abs=1e-12)  # exact data


@pytest.mark.parametrize(
    ("sex", "stature", "mass", "lengths"),
    [
        ("male", 1.741, 73.0, {"upper_arm": 281.7, "forearm": 268.9, "hand": 86.2}),
        ("female", 1.735, 61.9, {"upper_arm": 275.1, "forearm": 264.3, "hand": 78.0}),
    ],
)
def test_the_mean_subject_has_the_published_lengths(sex, stature, mass, lengths):
    body = segments(stature, mass, sex)
    for name, millimeters in lengths.items():
        # Only arithmetic: the stature is the one that the fractions are of.
        assert 1000 * body[name].length_m == pytest.approx(millimeters, rel=1e-12)
        fraction = row("de_leva", name, sex=sex)["mass"]
        assert body[name].mass_kg == pytest.approx(mass * fraction, rel=1e-12)


@given(statures, masses, sexes)
def test_every_inertia_could_belong_to_a_body(stature, mass, sex):
    for part in segments(stature, mass, sex).values():
        moments = part.inertia_kg_m2
        assert min(moments) > 0
        assert 2 * max(moments) < sum(moments)  # triangle inequality
        assert part.mass_kg > 0
        assert 0 < part.com_m < part.length_m


@given(statures, masses, sexes)
def test_upper_body_and_legs_weigh_the_whole_person(stature, mass, sex):
    body = segments(stature, mass, sex)
    total = body["trunk_head"].mass_kg + 2 * sum(
        body[name].mass_kg for name in LIMB_SEGMENTS
    )
    legs = sum(row("de_leva", n, sex=sex)["mass"] for n in ("thigh", "shank", "foot"))
    total += 2 * mass * legs
    assert total == pytest.approx(mass, rel=14 * 0.00005)  # as the table's own sum


@given(statures, masses, sexes, st.floats(0.6, 1.7))
def test_trunk_and_both_girdles_are_de_levas_trunk_and_head(stature, mass, sex, share):
    length = share * expected_lengths(stature, sex)["clavicle"]
    body = segments(stature, mass, sex, lengths={"clavicle": length})
    girdle, rest = body["clavicle"], body["trunk_head"]
    joints = shoulder_joints(stature, sex)
    start, reach = joints["sternoclavicular"], joints["glenohumeral"]
    toward = (reach - start) / np.linalg.norm(reach - start)
    at = start + girdle.com_m * toward
    # Bodies as (mass, up, sideways, moments about front-back, vertical, side-to-side).
    front_back, long, vertical = girdle.inertia_kg_m2
    whole = [(rest.mass_kg, -rest.com_m, 0.0, rest.inertia_kg_m2)]
    whole += [
        (girdle.mass_kg, at[1], side * at[2], (front_back, vertical, long))
        for side in (-1, 1)
    ]
    pieces = []
    scale = stature / table("de_leva")["subjects"][sex]["stature_mm"]
    above = row("de_leva", "trunk_cervicale", sex=sex)["length_mm"]
    above -= row("de_leva", "trunk", sex=sex)["length_mm"]
    for name, top in (("trunk", 0.0), ("head_cervicale", None)):
        r = row("de_leva", name, sex=sex)
        top = above + r["length_mm"] if top is None else top
        size = scale * r["length_mm"]
        sagittal, transverse, longitudinal = r["gyration"]
        moments = [
            mass * r["mass"] * (k * size) ** 2
            for k in (sagittal, longitudinal, transverse)
        ]
        pieces.append(
            (mass * r["mass"], scale * top - r["com"] * size, 0.0, tuple(moments))
        )
    # Sums of a few products of doubles, far from cancelling.
    np.testing.assert_allclose(_joined(whole), _joined(pieces), rtol=1e-9)


def _joined(bodies):
    """Mass, height and moments about the common center, by the definition."""
    mass = sum(b[0] for b in bodies)
    up = sum(b[0] * b[1] for b in bodies) / mass
    moments = np.zeros(3)
    for m, y, z, own in bodies:
        y = y - up
        moments += np.array(own) + m * np.array([y**2 + z**2, z**2, y**2])
    return np.array([mass, up, *moments])


@given(statures, masses, sexes, st.floats(0.6, 1.8))
def test_a_known_length_moves_center_and_inertia_but_not_mass(
    stature, mass, sex, share
):
    before = segments(stature, mass, sex)
    known = {"forearm": share * before["forearm"].length_m}
    after = segments(stature, mass, sex, lengths=known)
    assert after["hand"] == before["hand"]
    old, new = before["forearm"], after["forearm"]
    assert new.mass_kg == old.mass_kg
    # Products of doubles only.
    assert new.com_m == pytest.approx(share * old.com_m, rel=1e-12)
    expected = share**2 * np.array(old.inertia_kg_m2)
    np.testing.assert_allclose(new.inertia_kg_m2, expected, rtol=1e-12)


@given(sexes, statures)
def test_clavicle_runs_from_sternum_to_shoulder_joint(sex, stature):
    joints = shoulder_joints(stature, sex)
    reach = joints["glenohumeral"] - joints["sternoclavicular"]
    length = expected_lengths(stature, sex)["clavicle"]
    assert length == pytest.approx(np.linalg.norm(reach), rel=1e-12)  # same arithmetic
    # Outward, backward, the joint under the acromion and nearer to the midline.
    assert reach[2] > abs(reach[0]) > 0 > reach[0]
    assert joints["acromion"][1] > joints["glenohumeral"][1]
    assert joints["acromion"][2] > joints["glenohumeral"][2] > 0


def test_clavicle_of_the_mean_man_agrees_with_a_published_model():
    # The model of Holzbaur et al. 2005 has 147.2 mm between the two joints for a man of
    # 1.70 m; its shoulder is the narrower of the two that we average over, by the
    # stated sd of .0036 of stature each way; two of them.
    length = expected_lengths(1.70, "male")["clavicle"]
    assert length == pytest.approx(0.1472, abs=2 * 0.0036 * 1.70)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: segments(175, 70, "F"), "did you give centimeters"),
        (lambda: segments(1.1, 70, "F"), "expected 1.2 to 2.3 m"),
        (lambda: segments(math.nan, 70, "F"), "stature is nan"),
        (lambda: segments("tall", 70, "F"), "expected a number"),
        (lambda: segments(1.75, 70_000, "F"), "did you give grams"),
        (lambda: segments(1.75, math.inf, "F"), "mass is inf"),
        (lambda: segments(1.75, 70, "unknown"), "expected 'female' or 'male'"),
        (lambda: segments(1.75, 70, None), "expected 'female' or 'male'"),
        (lambda: segments(1.75, 70, "F", lengths={"hand": 80}), "millimeters"),
        (lambda: segments(1.75, 70, "F", lengths={"hand": math.nan}), "gives nan m"),
        (lambda: segments(1.75, 70, "F", lengths={"thigh": 0.4}), "names 'thigh'"),
        (lambda: expected_lengths(17.5, "M"), "stature is 17.5 m"),
        (lambda: length_uncertainty("X"), "sex is 'X'"),
        (lambda: shoulder_joints(1.75, "M", biacromial=400), "millimeters"),
        (lambda: table("anny"), "expected one of ansur2, de_leva"),
        (lambda: row("de_leva", "elbow", sex="M"), "no row 'elbow'"),
        (lambda: row("de_leva", "hand", sex=""), "sex is ''"),
        (lambda: sample_adults(-1, seed=0), "n is -1"),
        (lambda: sample_adults(2.5, seed=0), "n is 2.5"),
        (lambda: sample_adults(2, seed=None), "seed is None"),
        (lambda: sample_adults(2, seed=-3), "seed is -3"),
        (lambda: sample_adults(2, seed=0, sex="both"), "sex is 'both'"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(ask, words):
    with pytest.raises(InvalidInput, match=words) as caught:
        ask()
    assert isinstance(caught.value, IknsError)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("word", ["female", "F", "f", " Female "])
def test_sex_may_be_a_word_or_a_letter(word):
    assert normalize_sex(word) == "female"
    assert segments(1.7, 60, word) == segments(1.7, 60, "female")


def test_importing_the_tables_brings_nothing_heavy():
    heavy = ("pandas", "scipy", "sklearn", "numba", "matplotlib", "pinocchio")
    code = (
        "import sys, ikns.body.anthropometry;"
        f"print([m for m in {heavy} if m in sys.modules])"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert out.stdout.strip() == "[]"
