"""Shoulder coordinates against the skeleton, ISB's report, and central differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.analysis.compare import COORDINATES, shoulder_coordinates
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.motion.isb import isb_angles

SHOULDER = ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation")
SKELETON = Skeleton.load()
#: Away from gimbal lock of the internal angles (flexion 90 deg) and of ISB's (elevation
#: 0), where rates are not defined.
POSTURES = np.random.default_rng(0).uniform(
    np.radians([10, 15, -60]), np.radians([70, 75, 60]), (50, 3)
)


def body(shoulder, side):
    q = np.zeros((len(shoulder), len(SKELETON.joint_names)))
    columns = [SKELETON.joint_names.index(f"{side}_{joint}") for joint in SHOULDER]
    q[:, columns] = shoulder
    return q


@pytest.mark.parametrize("side", ["right", "left"])
def test_with_the_clavicle_at_rest_isb_is_what_the_report_says(side):
    # At zero clavicle angles the girdle has the thorax's axes.
    report = isb_angles(SKELETON, body(POSTURES, side))
    names = ("plane_of_elevation", "elevation", "axial_rotation")
    expected = np.stack([report[f"{side}_{name}"] for name in names], axis=1)
    ours = shoulder_coordinates("isb").from_internal(POSTURES)
    turns = (ours - expected) / (2 * np.pi)
    np.testing.assert_allclose(turns, turns.round(), atol=1e-9)


def test_the_rotation_vector_is_that_between_two_upper_arms():
    reference = POSTURES[0]
    ours = shoulder_coordinates("rotation_vector", reference).from_internal(POSTURES)
    rotation = SKELETON.link_in_thorax(body(POSTURES, "right"), "right_upper_arm")[1]
    between = rotation[0].T @ rotation
    cosine = (np.trace(between, axis1=1, axis2=2) - 1) / 2
    np.testing.assert_allclose(np.cos(np.linalg.norm(ours, axis=1)), cosine, atol=1e-12)


@pytest.mark.parametrize("name", COORDINATES)
def test_the_way_back_leads_to_the_same_rotation(name):
    there = shoulder_coordinates(name, [0.3, 0.5, 0.1])
    back = there.to_internal(there.from_internal(POSTURES))
    np.testing.assert_allclose(back, POSTURES, atol=1e-12)


@given(st.sampled_from(COORDINATES), st.integers(0, 49))
def test_rates_are_the_derivatives_of_the_way_back(name, posture):
    there = shoulder_coordinates(name, [0.3, 0.5, 0.1])
    q = POSTURES[posture]
    y, step = there.from_internal(q), 1e-5
    numeric = np.stack(
        [
            (there.to_internal(y + h) - there.to_internal(y - h)) / (2 * step)
            for h in step * np.eye(3)
        ],
        axis=1,
    )
    # Error of a central difference: step^2 / 6 times a third derivative of up to some
    # hundreds (elevation 10 deg), 1e-8; rounding 1e-16 / 1e-5.
    np.testing.assert_allclose(there.rates(q), numeric, atol=1e-7)


def test_rates_near_the_reference_do_not_divide_by_zero():
    there = shoulder_coordinates("rotation_vector", POSTURES[0])
    at, near = there.rates(POSTURES[0]), there.rates(POSTURES[0] + 1e-7)
    # Rates change by about as much as the posture.
    np.testing.assert_allclose(at, near, atol=1e-6)


def test_unknown_coordinates_are_refused():
    with pytest.raises(InvalidInput, match="internal, isb, rotation_vector"):
        shoulder_coordinates("euler")
