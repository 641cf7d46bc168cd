import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.motion.isb import isb_angles


@pytest.fixture(scope="module")
def skeleton():
    return Skeleton.load()


def pose(skeleton, **degrees):
    q = skeleton.neutral()
    for joint, angle in degrees.items():
        q[7 + skeleton.joint_names.index(joint)] = np.radians(angle)
    return q[None]


@pytest.mark.parametrize("side", ["right", "left"])
def test_known_poses_have_their_clinical_names(skeleton, side):
    abducted = isb_angles(
        skeleton, pose(skeleton, **{f"{side}_shoulder_abduction": 60})
    )
    # Closed forms; 1e-6 deg covers arccos near its edge (sqrt of rounding).
    assert np.degrees(abducted[f"{side}_elevation"]) == pytest.approx(60, abs=1e-6)
    assert abducted[f"{side}_plane_of_elevation"] == pytest.approx(0, abs=1e-7)
    assert abducted[f"{side}_axial_rotation"] == pytest.approx(0, abs=1e-7)
    forward = isb_angles(skeleton, pose(skeleton, **{f"{side}_shoulder_flexion": 50}))
    assert np.degrees(forward[f"{side}_elevation"]) == pytest.approx(50, abs=1e-6)
    plane = np.degrees(forward[f"{side}_plane_of_elevation"])
    assert plane == pytest.approx(90, abs=1e-6)


@pytest.mark.parametrize("side", ["right", "left"])
def test_forearm_and_wrist_angles_are_the_skeletons_own_but_for_the_zero(
    skeleton, side
):
    given = {"elbow_flexion": 70, "forearm_pronation": 20, "wrist_flexion": -15}
    angles = isb_angles(
        skeleton, pose(skeleton, **{f"{side}_{k}": v for k, v in given.items()})
    )
    # Rounding of degrees to radians and back.
    assert np.degrees(angles[f"{side}_elbow_flexion"]) == pytest.approx(70, abs=1e-9)
    assert np.degrees(angles[f"{side}_pronation"]) == pytest.approx(110, abs=1e-9)
    assert np.degrees(angles[f"{side}_carrying_angle"]) == pytest.approx(13, abs=1e-4)
    assert np.degrees(angles[f"{side}_wrist_flexion"]) == pytest.approx(-15, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_shoulder_angles_rebuild_the_rotation(skeleton, seed):
    rng = np.random.default_rng(seed)
    q = skeleton.neutral()
    q[7:] = rng.uniform(skeleton.lower, skeleton.upper)
    angles = isb_angles(skeleton, q[None])
    euler = [
        angles["right_plane_of_elevation"][0],
        -angles["right_elevation"][0],
        angles["right_axial_rotation"][0],
    ]
    rebuilt = Rotation.from_euler("YXY", euler).as_matrix()
    _, upper_arm = skeleton.link_in_thorax(q, "right_upper_arm")
    # arccos loses half the digits at its edges: sqrt(1e-16) = 1e-8.
    np.testing.assert_allclose(rebuilt, upper_arm, atol=1e-7)


def test_mirrored_poses_have_the_same_angles_on_both_sides(skeleton):
    rng = np.random.default_rng(3)
    values = dict(
        zip(
            ["shoulder_abduction", "shoulder_flexion", "shoulder_rotation"],
            rng.uniform(10, 60, 3),
            strict=True,
        )
    )
    both = {f"{s}_{k}": v for k, v in values.items() for s in ("right", "left")}
    angles = isb_angles(skeleton, pose(skeleton, **both))
    for name in ("plane_of_elevation", "elevation", "axial_rotation"):
        # Same closed form on mirrored numbers: rounding only.
        assert angles[f"left_{name}"] == pytest.approx(
            angles[f"right_{name}"], abs=1e-9
        )


def test_what_depends_on_an_unknown_joint_is_unknown(skeleton):
    angles = np.tile(skeleton.neutral()[7:] + 0.2, (3, 1))
    names = skeleton.joint_names
    angles[1, names.index("right_wrist_flexion")] = np.nan
    angles[2, names.index("right_elbow_flexion")] = np.nan
    found = isb_angles(skeleton, angles)
    lost = {
        1: {"right_wrist_flexion"},
        2: {"right_elbow_flexion", "right_carrying_angle", "right_pronation"},
    }
    for name, values in found.items():
        assert np.isnan(values).tolist() == [False, name in lost[1], name in lost[2]]
