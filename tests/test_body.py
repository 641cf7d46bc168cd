import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.body.anthropometry import segments
from ikns.body.model_file import SEGMENTS, resize_urdf, segment_lengths, urdf_folder
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput

URDF = (urdf_folder() / "upper_body.urdf").read_text()

factors = st.fixed_dictionaries({name: st.floats(0.7, 1.4) for name in SEGMENTS})
people = st.tuples(
    st.floats(1.4, 2.1), st.floats(40, 150), st.sampled_from(["female", "male"])
)


def inertias(urdf):
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    return [(i.mass, i.inertia) for i in list(model.inertias)[1:]]


def assert_physical(urdf):
    for mass, inertia in inertias(urdf):
        moments = np.linalg.eigvalsh(inertia)
        assert mass > 0
        assert moments[0] > 0
        # A body's moments obey the triangle inequality; the slack is the rounding of
        # nine digits in the file.
        assert moments[0] + moments[1] >= moments[2] * (1 - 1e-8)


def test_body_has_24_degrees_of_freedom():
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    assert model.nv == 24


def test_generic_inertias_are_physical():
    assert_physical(URDF)


def test_generic_mass_is_the_published_share_of_the_generic_person():
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    parts = [segments(1.7562, 85.5, "male"), segments(1.6285, 67.8, "female")]
    expected = np.mean(
        [
            p["trunk_head"].mass_kg
            + 2
            * sum(p[k].mass_kg for k in ("clavicle", "upper_arm", "forearm", "hand"))
            for p in parts
        ]
    )
    # Ten massless-by-intent links of 1 g, five a side, and six digits in the file.
    assert pin.computeTotalMass(model) == pytest.approx(expected + 0.010, abs=1e-3)


def test_shapes_are_primitives_without_mesh_files():
    robot = ET.fromstring(URDF)
    shapes = {child.tag for geometry in robot.iter("geometry") for child in geometry}
    assert shapes <= {"cylinder", "sphere", "box"}
    assert "package://" not in URDF


def test_left_side_mirrors_the_right():
    skeleton = Skeleton.load()
    rng = np.random.default_rng(0)
    q = skeleton.neutral()
    names = skeleton.joint_names
    for i, name in enumerate(names):
        if name.startswith("right"):
            q[7 + i] = rng.uniform(skeleton.lower[i], skeleton.upper[i])
            q[7 + names.index(name.replace("right", "left"))] = q[7 + i]
    hands, _ = skeleton.hands_in_thorax(q)
    # Same chain with mirrored numbers: rounding only.
    np.testing.assert_allclose(hands[1], hands[0] * [1, 1, -1], atol=1e-12)


def test_mujoco_sees_the_same_kinematics():
    model = mujoco.MjModel.from_xml_string(URDF)
    data = mujoco.MjData(model)
    skeleton = Skeleton.load()
    rng = np.random.default_rng(1)
    q = skeleton.neutral()
    q[7:] = rng.uniform(skeleton.lower, skeleton.upper)
    for i, name in enumerate(skeleton.joint_names):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]] = q[7 + i]
        assert joint.range == pytest.approx(
            [skeleton.lower[i], skeleton.upper[i]], abs=1e-6
        )
    mujoco.mj_kinematics(model, data)
    # An independent program on the same file: rounding, 10 joints deep. MuJoCo welds
    # links without a joint (and the root) to their parent.
    for link in ("right_upper_arm", "right_hand", "left_forearm"):
        position, rotation = skeleton.link_in_thorax(q, link)
        np.testing.assert_allclose(data.body(link).xpos, position, atol=1e-9)
        np.testing.assert_allclose(
            data.body(link).xmat.reshape(3, 3), rotation, atol=1e-9
        )


@settings(deadline=None, max_examples=20)
@given(factors)
def test_resizing_scales_lengths_and_keeps_inertias_physical(chosen):
    resized = resize_urdf(URDF, chosen)
    before, after = segment_lengths(URDF), segment_lengths(resized)
    for name, length in after.items():
        # Nine digits in the file.
        assert length == pytest.approx(before[name] * chosen[name], rel=1e-7)
    assert_physical(resized)


@settings(deadline=None, max_examples=20)
@given(people)
def test_any_adult_gets_a_valid_body(person):
    skeleton = Skeleton.from_anthropometry(*person)
    parts = segments(*person)
    assert_physical(skeleton.urdf)
    for name, length in skeleton.segment_lengths.items():
        expected = parts[name.split("_", 1)[1]].length_m
        assert length == pytest.approx(expected, rel=1e-7)


@settings(deadline=None, max_examples=10)
@given(people)
def test_center_of_mass_of_a_segment_is_where_the_table_says(person):
    skeleton = Skeleton.from_anthropometry(*person)
    model = pin.buildModelFromXML(skeleton.urdf, pin.JointModelFreeFlyer())
    upper_arm = model.inertias[model.getJointId("right_shoulder_rotation")]
    expected = segments(*person)["upper_arm"].com_m
    # The link's own frame hangs from the shoulder along -Y.
    np.testing.assert_allclose(upper_arm.lever, [0, -expected, 0], atol=1e-8)


def test_written_body_reads_back_the_same(tmp_path):
    skeleton = Skeleton.from_anthropometry(1.8, 80, "male")
    skeleton.write(tmp_path / "model.urdf")
    again = Skeleton.load(tmp_path / "model.urdf")
    assert again.urdf == skeleton.urdf


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"right_femur": 1.0}, "no link 'right_femur'"),
        ({"right_hand": 0.0}, "must be positive"),
        ({"right_hand": float("nan")}, "must be positive"),
    ],
)
def test_impossible_sizes_are_refused(given, said):
    with pytest.raises(InvalidInput, match=said):
        resize_urdf(URDF, given)
