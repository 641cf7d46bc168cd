import numpy as np
import pinocchio as pin
import pytest

from ikns.body.chains import SIDES, chain_joints, chain_sides, shipped_chains
from ikns.body.joint_axes import TILTS
from ikns.body.marker_set import MarkerSet
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.errors import FileError, InvalidInput, MarkerMismatch

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


@pytest.mark.parametrize("chain", shipped_chains())
def test_chain_jacobian_is_the_derivative_of_the_hand(skeleton, chain):
    q = any_pose(skeleton, 7)
    sides = [
        i
        for i, s in enumerate(SIDES)
        if any(j.startswith(s) for j in chain_joints(chain))
    ]
    columns = skeleton.columns(chain_joints(chain))
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


# A pose is a product of a dozen transforms of up to a meter, each exact to rounding,
# and a Jacobian's column is one more: 1e-14.
EXACT = 1e-12


class Pinocchio:
    """What Pinocchio says of one configuration, with the thorax at the origin."""

    def __init__(self, urdf):
        self.model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
        self.data = self.model.createData()

    def pose(self, q, link):
        pin.forwardKinematics(self.model, self.data, self._at_origin(q))
        frame = self.model.getFrameId(link)
        pose = pin.updateFramePlacement(self.model, self.data, frame)
        return pose.translation.copy(), pose.rotation.copy()

    def jacobian(self, q, chain):
        """Pose Jacobian of the chain's hands, one below the other."""
        names = list(self.model.names)[2:]
        columns = [6 + names.index(joint) for joint in chain_joints(chain)]
        return np.vstack(
            [
                pin.computeFrameJacobian(
                    self.model,
                    self.data,
                    self._at_origin(q),
                    self.model.getFrameId(f"{side}_knuckle"),
                    pin.LOCAL_WORLD_ALIGNED,
                )[:, columns]
                for side in chain_sides(chain)
            ]
        )

    def _at_origin(self, q):
        at_origin = pin.neutral(self.model)
        at_origin[7:] = q[-18:]
        return at_origin


def with_a_slide(skeleton):
    """The body with a clavicle that is raised along an axis, not turned about it."""
    turns = 'name="right_clavicle_elevation" type="revolute"'
    assert turns in skeleton.urdf
    urdf = skeleton.urdf.replace(turns, turns.replace("revolute", "prismatic"))
    return Skeleton(urdf, skeleton.marker_set)


@pytest.mark.parametrize("change", [lambda body: body, with_a_slide])
def test_hands_links_and_jacobians_are_pinocchios(skeleton, change):
    body = change(skeleton)
    oracle, rng = Pinocchio(body.urdf), np.random.default_rng(5)
    # Beyond the joints' limits too.
    q = rng.uniform(-4, 4, (40, 25))
    links = ("thorax", "right_clavicle", "left_forearm", "right_hand", "left_knuckle")
    for link in links:
        found = body.link_in_thorax(q, link)
        for i, row in enumerate(q):
            for mine, true in zip(found, oracle.pose(row, link), strict=True):
                np.testing.assert_allclose(mine[i], true, rtol=0, atol=EXACT)
    position, rotation = body.hands_in_thorax(q)
    for h, side in enumerate(SIDES):
        p, R = body.link_in_thorax(q, f"{side}_knuckle")
        np.testing.assert_array_equal(position[:, h], p)
        np.testing.assert_array_equal(rotation[:, h], R)
    for chain in shipped_chains():
        true = [oracle.jacobian(row, chain) for row in q]
        found = body.chain_jacobian(q, chain)
        np.testing.assert_allclose(found, true, rtol=0, atol=EXACT)
        only = body.chain_jacobian(q, chain, task="position")
        linear = found.reshape(40, -1, 2, 3, found.shape[2])[:, :, 0]
        np.testing.assert_array_equal(only, linear.reshape(only.shape))


def test_a_batch_is_its_configurations(skeleton):
    rng = np.random.default_rng(2)
    q = rng.uniform(-1, 1, (2, 3, 25))
    q.flags.writeable = False  # as a motion's are
    for ask in (
        skeleton.hands_in_thorax,
        lambda p: skeleton.link_in_thorax(p, "right_hand"),
        lambda p: (skeleton.chain_jacobian(p, "both_arms"),),
        lambda p: (skeleton.swivel(p),),
        lambda p: skeleton.null_spaces(p, "right_arm"),
    ):
        for together, angles, one in zip(
            ask(q), ask(q[..., 7:]), ask(q[1, 2]), strict=True
        ):
            assert together.shape[:2] == (2, 3)
            np.testing.assert_array_equal(together, angles)
            np.testing.assert_array_equal(together[1, 2], one)
        assert ask(q[:, :0])[0].shape[:2] == (2, 0)


def test_markers_of_a_batch_are_those_of_its_configurations(skeleton):
    q = np.stack([[any_pose(skeleton, 3 * i + j) for j in range(3)] for i in range(2)])
    tilts = [(joint, component) for joint, component, _ in TILTS]
    for ask in (
        lambda p: (skeleton.markers_in_world(p),),
        skeleton.marker_jacobian,
        skeleton.size_jacobian,
        lambda p: (skeleton.tilt_jacobian(p, tilts),),
    ):
        for together, one in zip(ask(q), ask(q[1, 2]), strict=True):
            np.testing.assert_array_equal(together[1, 2], one)
        for none, one in zip(ask(q[:, :0]), ask(q[1, 2]), strict=True):
            assert none.shape == (2, 0, *one.shape)


def test_an_unknown_angle_spoils_its_own_arm_and_configuration_alone(skeleton):
    q = np.random.default_rng(3).uniform(-1, 1, (3, 18))
    good = skeleton.hands_in_thorax(q)
    q[1, skeleton.joint_names.index("left_elbow_flexion")] = np.nan
    for found, before in zip(skeleton.hands_in_thorax(q), good, strict=True):
        assert np.isnan(found[1, 1]).any()
        found[1, 1] = before[1, 1]
        np.testing.assert_array_equal(found, before)
    assert np.isfinite(skeleton.chain_jacobian(q, "right_arm")).all()
    basis, rank = skeleton.null_spaces(q, "left_arm")
    assert rank.tolist() == [6, -1, 6]
    assert np.isnan(basis[1]).all()
    assert np.isnan(skeleton.swivel(q)).tolist() == [[0, 0], [0, 1], [0, 0]]


@pytest.mark.parametrize("chain", shipped_chains())
def test_joints_that_move_in_the_null_space_leave_the_hands_alone(skeleton, chain):
    q = np.random.default_rng(4).uniform(0.2, 1.0, (5, 18))
    basis, rank = skeleton.null_spaces(q, chain)
    n = len(chain_joints(chain))
    assert (rank == n - basis.shape[1]).all()
    columns = skeleton.columns(chain_joints(chain)) - 6
    before = skeleton.hands_in_thorax(q)
    for k in range(basis.shape[1]):
        moved = q.copy()
        moved[:, columns] += STEP * basis[:, k]
        for here, there in zip(before, skeleton.hands_in_thorax(moved), strict=True):
            # The second derivative of a hand by a unit of joint space is below 10.
            assert np.abs(here - there).max() < 10 * STEP**2


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


def test_swivel_is_measured_from_straight_below_the_line_to_the_wrist(skeleton):
    q = np.random.default_rng(6).uniform(0.1, 1.2, (20, 18))
    for h, (side, outward) in enumerate(zip(SIDES, (1, -1), strict=True)):
        shoulder, elbow, wrist = (
            skeleton.link_in_thorax(q, f"{side}_{link}")[0]
            for link in ("upper_arm", "forearm", "hand")
        )
        line = wrist - shoulder
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        radial = elbow - shoulder
        radial -= line * np.sum(radial * line, axis=1, keepdims=True)
        down = line * line[:, 1:2] - [0, 1, 0]
        angle = np.arctan2(
            np.sum(radial * np.cross(down, line), axis=1) * outward,
            np.sum(radial * down, axis=1),
        )
        # Elbows here stand 3 cm or more off the line: eps * 1 m / 0.03 m.
        np.testing.assert_allclose(skeleton.swivel(q)[:, h], angle, rtol=0, atol=1e-13)


def test_unknown_names_are_refused_with_a_sentence(skeleton):
    with pytest.raises(InvalidInput, match="no joint right_knee"):
        skeleton.columns(("right_knee",))
    with pytest.raises(FileError, match="no link 'pelvis'"):
        skeleton.link_in_thorax(skeleton.neutral(), "pelvis")
    with pytest.raises(InvalidInput, match="task must be"):
        skeleton.chain_jacobian(skeleton.neutral(), "right_arm", task="force")
    with pytest.raises(InvalidInput, match="unknown chain"):
        skeleton.chain_jacobian(skeleton.neutral(), "tail")
    with pytest.raises(InvalidInput, match=r"\(\.\.\., 25\).*found an array \(4, 24\)"):
        skeleton.hands_in_thorax(np.zeros((4, 24)))


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
