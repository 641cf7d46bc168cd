import numpy as np
import pytest

from ikns.body import SEGMENTS
from ikns.errors import FileError, InvalidInput, MarkerMismatch
from ikns.marker_set import MarkerSet
from ikns.motion import CHAINS, SIDES
from ikns.skeleton import Skeleton

# Central differences with step h: truncation h^2/6 |f'''| ~ 1e-12 / 6 * 1 m and
# rounding eps / h * 2 m = 4e-10, so 1e-8 leaves a factor of twenty.
STEP, TOLERANCE = 1e-6, 1e-8


@pytest.fixture(scope="module")
def skeleton():
    return Skeleton.load()


def any_pose(skeleton, seed):
    rng = np.random.default_rng(seed)
    q = skeleton.integrate(skeleton.neutral(), rng.normal(0, 1, skeleton.nv))
    q[7:] = rng.uniform(skeleton.lower, skeleton.upper)
    return q


def central_difference(function, skeleton, q):
    columns = [
        (
            function(skeleton.integrate(q, STEP * axis))
            - function(skeleton.integrate(q, -STEP * axis))
        )
        / (2 * STEP)
        for axis in np.eye(skeleton.nv)
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("seed", range(4))
def test_marker_jacobian_is_the_derivative_of_the_markers(skeleton, seed):
    q = any_pose(skeleton, seed)
    positions, jacobian = skeleton.marker_jacobian(q)
    np.testing.assert_array_equal(positions, skeleton.markers_in_world(q))
    numeric = central_difference(skeleton.markers_in_world, skeleton, q)
    np.testing.assert_allclose(jacobian, numeric, atol=TOLERANCE)


@pytest.mark.parametrize("seed", range(3))
def test_size_jacobian_is_the_derivative_by_log_size(skeleton, seed):
    q = any_pose(skeleton, seed)
    by_size, by_position = skeleton.size_jacobian(q)
    # Nine digits in the resized file limit the step from below: 1e-9 m / 1e-4 = 1e-5.
    h = 1e-4
    for s, name in enumerate(SEGMENTS):
        ahead = skeleton.resized({name: np.exp(h)}).markers_in_world(q)
        behind = skeleton.resized({name: np.exp(-h)}).markers_in_world(q)
        numeric = (ahead - behind) / (2 * h)
        np.testing.assert_allclose(by_size[:, :, s], numeric, atol=2e-5)
    shift = np.array([0.01, -0.02, 0.03])
    moved = skeleton.with_markers(
        skeleton.marker_set.at(skeleton.marker_positions + shift)
    )
    change = moved.markers_in_world(q) - skeleton.markers_in_world(q)
    # Linear in the place: rounding only.
    np.testing.assert_allclose(by_position @ shift, change, atol=1e-12)


@pytest.mark.parametrize("chain", CHAINS)
def test_chain_jacobian_is_the_derivative_of_the_hand(skeleton, chain):
    q = any_pose(skeleton, 7)
    sides = [
        i for i, s in enumerate(SIDES) if any(j.startswith(s) for j in CHAINS[chain])
    ]
    columns = skeleton.columns(CHAINS[chain])
    jacobian = skeleton.chain_jacobian(q, chain)
    position = central_difference(
        lambda p: skeleton.hands_in_thorax(p)[0][sides], skeleton, q
    )[..., columns]
    turn = central_difference(
        lambda p: skeleton.hands_in_thorax(p)[1][sides], skeleton, q
    )[..., columns]
    rotation = skeleton.hands_in_thorax(q)[1][sides]
    for i in range(len(sides)):
        np.testing.assert_allclose(
            jacobian[6 * i : 6 * i + 3], position[i], atol=TOLERANCE
        )
        skew = np.einsum("abn,cb->acn", turn[i], rotation[i])
        angular = np.stack([skew[2, 1], skew[0, 2], skew[1, 0]])
        np.testing.assert_allclose(
            jacobian[6 * i + 3 : 6 * i + 6], angular, atol=TOLERANCE
        )
    only = skeleton.chain_jacobian(q, chain, task="position")
    np.testing.assert_array_equal(only[:3], jacobian[:3])


def test_thorax_pose_does_not_change_what_the_thorax_sees(skeleton):
    q = any_pose(skeleton, 1)
    moved = q.copy()
    moved[:7] = skeleton.neutral()[:7]
    for here, there in zip(
        skeleton.hands_in_thorax(q), skeleton.hands_in_thorax(moved), strict=True
    ):
        np.testing.assert_array_equal(here, there)


def test_swivel_is_the_angle_by_which_the_elbow_is_turned_about_its_line(skeleton):
    q = skeleton.neutral()
    for name, angle in {"elbow_flexion": 90, "shoulder_flexion": 20}.items():
        for side in SIDES:
            index = skeleton.joint_names.index(f"{side}_{name}")
            q[7 + index] = np.radians(angle)
    start = skeleton.swivel(q)
    right_out = q.copy()
    right_out[7 + skeleton.joint_names.index("right_shoulder_abduction")] += 0.3
    lifted = skeleton.swivel(right_out)
    # The carrying angle leaves both arms alike but not at zero.
    assert start[0] == pytest.approx(start[1], abs=1e-12)
    assert lifted[0] > start[0] + 0.1
    assert lifted[1] == start[1]


def test_unknown_names_are_refused_with_a_sentence(skeleton):
    with pytest.raises(InvalidInput, match="no joint right_knee"):
        skeleton.columns(("right_knee",))
    with pytest.raises(FileError, match="no link 'pelvis'"):
        skeleton.link_in_thorax(skeleton.neutral(), "pelvis")
    with pytest.raises(InvalidInput, match="task must be"):
        skeleton.chain_jacobian(skeleton.neutral(), "right_arm", task="force")
    with pytest.raises(InvalidInput, match="unknown chain"):
        skeleton.chain_jacobian(skeleton.neutral(), "tail")


@pytest.mark.parametrize(
    "text", ["", "<robot", "<robot name='a'><link name='thorax'/></robot>"]
)
def test_files_that_are_no_body_are_refused(text, tmp_path):
    path = tmp_path / "body.urdf"
    path.write_text(text)
    with pytest.raises(FileError):
        Skeleton.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileError, match="nowhere.urdf"):
        Skeleton.load(tmp_path / "nowhere.urdf")


def test_a_marker_on_an_unknown_link_is_refused(skeleton):
    other = MarkerSet.load("oxford24")
    lost = other.markers[0].__class__("TAIL", "tail", (0, 0, 0), (0.01, 0.01, 0.01))
    with pytest.raises(MarkerMismatch, match="TAIL sits on link 'tail'"):
        skeleton.with_markers(MarkerSet("odd", (lost,)))
