"""The compiled marker inverse kinematics: each part by itself, then against the plain
solver, on simulated and on real recordings."""

import threading
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marker_ik_oracle import PlainMarkerIK
from scipy.spatial.transform import Rotation

from ikns._kernels.body.articulated import (
    INERTIA,
    MOMENTS,
    ROW,
    factor,
    slope,
    solve,
    write_inertia,
)
from ikns._kernels.body.rigid import rigid_pose
from ikns._kernels.body.sine_cosine import sines_cosines
from ikns._kernels.body.step import displacement, integrate
from ikns._kernels.body.tree import joint_axes, place_joints
from ikns.body.skeleton import Skeleton
from ikns.body.skeleton.model import joint_tree
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import LIMIT, PRIOR, MarkerIK
from ikns.motion.marker_ik.gate import GateLimits
from ikns.motion.marker_ik.kernel import KernelSolver, limbs_in_turn
from ikns.motion.marker_ik.pose import SolvedFrames
from ikns.motion.marker_ik.turns import turned_markers
from ikns.numerics.rigid import rigid_transform
from ikns.recording.files import read

# The compiled solver leaves less than 5 % of its tolerance of 1e-5 rad, the plain one,
# asked for steps below 1e-10, at most a few hundred of those steps (it converges
# linearly, by 1 % a step where markers disagree with the body by centimeters).
AGREEMENT = 1e-6


def branched_model(seed):
    """A free root, two limbs with turning and sliding joints, axes anywhere."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    for limb in range(2):
        joint = root
        for k in range(4):
            axis = rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            kinds = (pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned)
            kind = kinds[k == 2 - limb]
            place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(0, 0.3, 3))
            joint = model.addJoint(joint, kind(axis), place, f"{limb}{k}")
    return model


def newton(model, q, joint, position, weight, target, share, extra, free, b):
    """The gradient, and H^-1 b and the joints' twists at these rates, or None."""
    tree, turned = joint_tree(model)
    J, n = len(tree.kind), model.nv
    rotation, translation = np.empty((J, 3, 3)), np.empty((J, 3))
    axes, wrench, gradient = np.empty((n, 6)), np.empty((J, 6)), np.empty(n)
    A, rows, twist = np.empty((J, INERTIA)), np.empty((n, ROW)), np.empty((J, 6))
    place_joints(tree, q, np.empty((2, len(q))), rotation, translation)
    joint_axes(tree, rotation, translation, axes)
    local = np.einsum("mji,mj->mi", turned[joint], position)
    x = np.einsum("mij,mj->mi", rotation[joint], local) + translation[joint]
    r = x - target
    slope(tree, joint, axes, weight, x, r, wrench, gradient)
    write_inertia(joint, weight, x, r, share, np.empty((J, MOMENTS)), A)
    if not factor(tree, axes, wrench, share, free, extra, A, rows):
        return gradient, None, None
    found = b.copy()
    solve(tree, rows, twist, found)
    return gradient, found, twist


def any_frame(model, seed):
    """Markers anywhere on any joints, and where they were seen."""
    rng = np.random.default_rng(seed)
    joint = rng.integers(0, model.njoints - 1, 12)
    position, weight = rng.normal(0, 0.2, (12, 3)), rng.uniform(0, 2, 12)
    weight[3] = 0.0
    target = rng.normal(0, 0.5, (12, 3))
    q = pin.integrate(model, pin.neutral(model), rng.normal(0, 0.7, model.nv))
    return q, joint, position, weight, target


def marker_jacobian(model, q, joint, position):
    """Markers (M, 3) and their Jacobian (M, 3, n), by Pinocchio."""
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    x, jacobian = np.empty((len(joint), 3)), np.empty((len(joint), 3, model.nv))
    for m, (j, place) in enumerate(zip(joint.tolist(), position, strict=True)):
        x[m] = data.oMi[j + 1].act(place)
        twists = pin.getJointJacobian(model, data, j + 1, pin.WORLD)
        jacobian[m] = twists[:3] + np.cross(twists[3:].T, x[m]).T
    return x, jacobian


@pytest.mark.parametrize("seed", range(3))
def test_newtons_equations_are_those_of_finite_differences(seed):
    model = branched_model(seed)
    data, n = model.createData(), model.nv
    q, joint, position, weight, target = any_frame(model, seed)

    def half_cost(step):
        pin.forwardKinematics(model, data, pin.integrate(model, q, step))
        x = [
            data.oMi[j + 1].act(p)
            for j, p in zip(joint.tolist(), position, strict=True)
        ]
        return 0.5 * weight @ ((np.array(x) - target) ** 2).sum(axis=1)

    h, e = 1e-4, np.eye(n)
    slopes = [(half_cost(h * d) - half_cost(-h * d)) / (2 * h) for d in e]
    second = np.empty((n, n))
    for i, a in enumerate(e):
        for j, b in enumerate(e):
            second[i, j] = (
                half_cost(h * (a + b))
                - half_cost(h * (a - b))
                - half_cost(h * (b - a))
                + half_cost(-h * (a + b))
            ) / (4 * h * h)
    # Far from a minimum the Hessian is indefinite: add so much that it no longer is.
    extra = np.full(n, 1.0 - min(np.linalg.eigvalsh(second)[0], 0.0))
    frame = model, q, joint, position, weight, target, 1.0, extra, np.ones(n)
    inverse = np.empty((n, n))
    for j, b in enumerate(e):
        gradient, inverse[:, j], _ = newton(*frame, b)
    # Central differences: h^2 = 1e-8 times third derivatives of the order of the cost's
    # scale (10), rounding 1e-15 / h.
    np.testing.assert_allclose(gradient, slopes, atol=1e-6)
    # As above, rounding 1e-15 / h^2 = 1e-7 times the cost: 1e-5 for each entry.
    rest = (second + np.diag(extra)) @ inverse - np.eye(n)
    assert np.abs(rest).max() < 1e-5 * np.abs(inverse).sum(axis=0).max()


@pytest.mark.parametrize("seed", range(5))
def test_gauss_newtons_equations_are_solved_as_numpy_solves_them(seed):
    model, rng = branched_model(seed), np.random.default_rng(seed)
    n = model.nv
    q, joint, position, weight, target = any_frame(model, seed)
    x, jacobian = marker_jacobian(model, q, joint, position)
    extra, b, free = rng.uniform(0.1, 1, n), rng.normal(size=n), np.ones(n)
    free[rng.integers(n, size=3)] = 0.0
    gradient, found, twist = newton(
        model, q, joint, position, weight, target, 0.0, extra, free, b
    )
    flat = jacobian.reshape(-1, n)
    each = np.repeat(weight, 3)
    # Sums of a few dozen products of order one.
    np.testing.assert_allclose(
        gradient, flat.T @ (each * (x - target).ravel()), atol=1e-13
    )
    own = free > 0
    H = ((flat.T * each) @ flat + np.diag(extra))[np.ix_(own, own)]
    expected = np.zeros(n)
    expected[own] = np.linalg.solve(H, b[own])
    # Rounding times the condition number.
    close = 1e-15 * np.linalg.cond(H) * np.abs(expected).max()
    np.testing.assert_allclose(found, expected, atol=close)
    moves = twist[joint, :3] + np.cross(twist[joint, 3:], x)
    np.testing.assert_allclose(moves, jacobian @ expected, atol=10 * close)


@pytest.mark.parametrize("bad", [-100.0, np.nan])
def test_what_is_not_positive_definite_is_refused(bad):
    model = branched_model(0)
    frame, n = any_frame(model, 0), model.nv
    extra, one = np.ones(n), np.ones(n)
    assert newton(model, *frame, 0.0, extra, one, one)[1] is not None
    # The markers' part of the diagonal is below 24 m^2 (weights up to 2, within 1 m).
    extra[5] = bad
    assert newton(model, *frame, 0.0, extra, one, one)[1] is None


@given(
    st.lists(
        st.floats(-1e7, 1e7) | st.floats(-7, 7) | st.sampled_from([np.nan, -np.inf]),
        max_size=20,
    )
)
def test_sines_and_cosines_are_numpys(angles):
    angles = np.array(angles)
    found = np.empty((2, len(angles)))
    sines_cosines(angles, found)
    with np.errstate(invalid="ignore"):
        expected = np.sin(angles), np.cos(angles)
    # One unit in the last place of numbers up to 1, and numpy's own rounding.
    np.testing.assert_allclose(found, expected, rtol=0, atol=3.4e-16)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 9.9e-3, 1.01e-2, 1.0, 3.1])
def test_steps_are_pinocchios(size):
    model = branched_model(1)
    tree, _ = joint_tree(model)
    rng = np.random.default_rng(2)
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    step = rng.normal(size=model.nv)
    step[3:6] *= size / np.linalg.norm(step[3:6])
    moved = np.empty(model.nq)
    integrate(tree, q, step, moved)
    expected = pin.integrate(model, q, step)
    expected[3:7] *= np.sign(expected[3:7] @ moved[3:7])
    # Rounding of numbers up to 3; series cut off at 1e-2^6 / 40000.
    np.testing.assert_allclose(moved, expected, atol=2e-15)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 1.0, 3.1])
def test_displacement_is_half_the_slope_of_its_square(size):
    model = branched_model(1)
    tree, _ = joint_tree(model)
    rng = np.random.default_rng(3)
    q0 = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    step = rng.normal(size=model.nv)
    step[3:6] *= size / np.linalg.norm(step[3:6])
    q = pin.integrate(model, q0, step)
    moved, beside = np.empty(model.nv), np.empty(model.nv)
    displacement(tree, q0, q, moved)
    turn = Rotation.from_quat(q0[3:7]).inv() * Rotation.from_quat(q[3:7])
    assert np.linalg.norm(moved[3:6]) == pytest.approx(turn.magnitude(), abs=1e-14)
    assert np.linalg.norm(moved[:3]) == pytest.approx(
        np.linalg.norm(q[:3] - q0[:3]), abs=1e-14
    )
    h = 1e-5
    for d in range(model.nv):
        squares = []
        for sign in (1, -1):
            there = pin.integrate(model, q, sign * h * np.eye(model.nv)[d])
            displacement(tree, q0, there, beside)
            squares.append(beside @ beside)
        # h^2 times third derivatives, at most 1 / (pi - 3.1)^2; rounding 1e-15 / h.
        slope = (squares[0] - squares[1]) / (4 * h)
        assert slope == pytest.approx(moved[d], abs=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_rigid_pose_is_kabschs(seed):
    rng = np.random.default_rng(seed)
    source = rng.normal(size=(6, 3))
    turn, shift = Rotation.random(random_state=seed), rng.normal(size=3)
    target = turn.apply(source) + shift + rng.normal(0, 0.05, (6, 3))
    weight = np.array([1.0, 2, 0.5, 1, 0, 1])
    target[4] = np.nan
    pose = np.empty(7)
    rigid_pose(source, target, weight, np.empty((4, 4)), np.empty((4, 4)), pose)
    rotation, place = rigid_transform(source[weight > 0], target[weight > 0])
    # Rounding of a 4 x 4 eigenvector whose eigenvalue stands apart by about 1.
    np.testing.assert_allclose(
        Rotation.from_quat(pose[3:]).as_matrix(), rotation, atol=1e-13
    )
    np.testing.assert_allclose(pose[:3], place, atol=1e-13)


@pytest.fixture(scope="module")
def skeleton():
    body = Skeleton.load()
    return body.with_markers(body.marker_set.without_static())


def cost(skeleton, q, before, seen):
    """What is minimized, put down once more."""
    worn = skeleton.marker_set.markers
    weight = np.array([0.0 if m.static_only else m.weight for m in worn])
    distance = ((skeleton.markers_in_world(q) - seen) ** 2).sum(axis=1)
    turn = Rotation.from_quat(before[3:7]).inv() * Rotation.from_quat(q[3:7])
    moved = (
        ((q - before)[:3] ** 2).sum()
        + turn.magnitude() ** 2
        + ((q - before)[7:] ** 2).sum()
    )
    beyond = np.maximum(q[7:] - skeleton.upper, 0) + np.minimum(
        q[7:] - skeleton.lower, 0
    )
    total = np.nansum(weight * distance)
    return total + PRIOR**2 * moved + LIMIT**2 * beyond @ beyond


def agree(skeleton, seen, before):
    ours = MarkerIK(skeleton).solve(seen, before)
    plain = PlainMarkerIK(skeleton, tolerance=1e-10, max_iterations=5000)
    exact = plain.solve(seen, before)
    assert ours.converged == exact.converged
    if not np.isfinite(exact.residual):
        np.testing.assert_array_equal(ours.q, exact.q)
        return
    away = np.abs(skeleton.difference(ours.q, exact.q)).max()
    lower = cost(skeleton, exact.q, before, seen)
    assert away < AGREEMENT
    # Near a minimum the cost grows with the square of AGREEMENT times a Hessian below
    # 100 m^2 (24 markers within 2 m).
    assert cost(skeleton, ours.q, before, seen) <= lower + 100 * AGREEMENT**2
    assert ours.residual == pytest.approx(exact.residual, abs=10 * AGREEMENT)


@pytest.mark.parametrize("solver_class", [MarkerIK, PlainMarkerIK])
def test_markers_of_the_static_trial_alone_weigh_nothing(solver_class):
    skeleton, rng = Skeleton.load(), np.random.default_rng(0)
    static = np.array([m.static_only for m in skeleton.marker_set.markers])
    assert 0 < static.sum() < len(static)
    solver = solver_class(skeleton)
    q = skeleton.neutral()
    q[7:] += rng.uniform(0.1, 0.4, 18)
    seen = skeleton.markers_in_world(q) + rng.normal(0, 1e-3, (len(static), 3))
    hidden, astray = seen.copy(), seen.copy()
    hidden[static], astray[static] = np.nan, 5.0
    # From scratch and from a pose before.
    for before in (None, q):
        without, far = solver.solve(hidden, before), solver.solve(astray, before)
        np.testing.assert_array_equal(far.q, without.q)
        assert far.residual == without.residual < 0.01


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 10**6),
    st.floats(0, 0.02),
    st.floats(0, 0.5),
    st.floats(0, 3),
    st.sampled_from([0.0, 0.02, 0.3]),
)
def test_any_frame_has_the_plain_solvers_answer(seed, noise, hidden, spread, off):
    # Straight elbows (spread 0), angles far outside limits (spread 3), lost markers.
    body = Skeleton.load()
    skeleton = body.with_markers(body.marker_set.without_static())
    rng = np.random.default_rng(seed)
    q = skeleton.neutral()
    q[7:] += spread * rng.uniform(-1, 1, 18)
    q = skeleton.integrate(q, np.r_[rng.normal(0, 1, 6), np.zeros(18)])
    seen = skeleton.markers_in_world(q) + rng.normal(0, noise, (22, 3))
    seen[rng.random(22) < hidden] = np.nan
    before = skeleton.integrate(q, rng.normal(0, off, 24))
    ours = MarkerIK(skeleton).solve(seen, before)
    assert np.isfinite(ours.q).all()
    plain = PlainMarkerIK(skeleton, tolerance=1e-10, max_iterations=5000)
    exact = plain.solve(seen, before)
    if not np.isfinite(exact.residual):
        np.testing.assert_array_equal(ours.q, exact.q)
        return
    # A cost with several minima may lead different ways down; never to a worse frame
    # by the cost when the start was near.
    away = np.abs(skeleton.difference(ours.q, exact.q)).max()
    if exact.converged and ours.converged and off < 0.1 and spread < 1:
        assert away < AGREEMENT


@pytest.mark.parametrize(
    ("folder", "static", "marker_set", "trials"),
    [
        ("ue_adl/ADL005", "ADL005_static.csv", "ue_adl", "ADL005[FADC]R1.csv"),
        ("ue_adl/ADL001", "ADL001_static.csv", "ue_adl", "ADL001[FADC]L1.csv"),
        ("stoop", "neu_t169_f250f350.c3d", "plug_in_gait", "stoop[123]_*.c3d"),
    ],
)
def test_real_frames_have_the_plain_solvers_answer(
    data, folder, static, marker_set, trials
):
    calm = read(data / folder / static)
    skeleton, _ = scale(Skeleton.load(), calm, marker_set=marker_set, min_duration=0.3)
    # The plain solver knows no free turns; tests/test_free_turn.py has them.
    worn = skeleton.marker_set
    rigid = tuple(replace(marker, free_turn=False) for marker in worn.markers)
    skeleton = skeleton.with_markers(replace(worn, markers=rigid))
    tried = 0
    for path in sorted((data / folder).glob(trials)):
        recording = read(path)
        worn = skeleton.marker_set
        markers = worn.pick(recording.labels, recording.markers)
        motion = MarkerIK(skeleton).track(recording)
        assert motion.converged.all()
        for i in range(1, len(markers), 97):
            agree(skeleton, markers[i], motion.q[i - 1])
            tried += 1
    assert tried > 5


def test_a_recording_is_its_frames_one_by_one(skeleton):
    rng = np.random.default_rng(0)
    q, frames = skeleton.neutral(), []
    for _ in range(30):
        q[7:] += rng.uniform(0, 0.02, 18)
        frames.append(skeleton.markers_in_world(q) + rng.normal(0, 1e-3, (22, 3)))
    frames[10][:] = np.nan
    solver, before, poses = MarkerIK(skeleton), None, []
    for seen in frames:
        pose = solver.solve(seen, before)
        poses.append(pose)
        before = pose.q
    rows = solver.solver.new_rows(30)
    solver.solver.solve(np.array(frames), (0, 30, 1), None, rows)
    batch = SolvedFrames.of(rows)
    np.testing.assert_array_equal(batch.q, [pose.q for pose in poses])
    np.testing.assert_array_equal(batch.residual, [pose.residual for pose in poses])


def test_joints_of_limbs_in_turn_are_where_they_were(skeleton):
    tree, at = limbs_in_turn(skeleton.tree)
    q = skeleton.integrate(
        skeleton.neutral(), np.random.default_rng(0).normal(size=skeleton.nv)
    )
    J = len(at)
    assert (tree.parent < np.arange(J)).all()
    placed = []
    for each in (skeleton.tree, tree):
        rotation, translation = np.empty((J, 3, 3)), np.empty((J, 3))
        place_joints(each, q, np.empty((2, len(q))), rotation, translation)
        placed.append((rotation, translation))
    np.testing.assert_array_equal(placed[1][0][at], placed[0][0])
    np.testing.assert_array_equal(placed[1][1][at], placed[0][1])


def test_the_gate_gets_the_errors_of_the_solution(skeleton):
    rng, start = np.random.default_rng(2), skeleton.neutral()
    q = start.copy()
    q[7:] += rng.uniform(-1, 1, 18)
    seen = skeleton.markers_in_world(q) + rng.normal(0, 0.02, (22, 3))
    seen[[3, 11]] = np.nan

    def solved(n, limit):
        solver = KernelSolver(
            skeleton, max_iterations=n, limits=GateLimits(1e9, limit, 1e9)
        )
        rows = solver.new_rows(1)
        solver.solve(seen[None], (0, 1, 1), start, rows)
        return SolvedFrames.of(rows)

    for n in range(1, 6):
        free = solved(n, 1e9)
        away = turned_markers(skeleton, free.q[0], seen) - seen
        worst = np.nanmax(np.linalg.norm(away, axis=1))
        loose, tight = solved(n, worst * (1 + 1e-9)), solved(n, worst * (1 - 1e-9))
        # What does not fit is tried from scratch, too.
        assert loose.fits.all()
        assert (loose.q == free.q).all()
        assert not tight.fits.all() or (tight.q != free.q).any()


def test_threads_do_not_share_memory(skeleton):
    rng = np.random.default_rng(1)
    solver, truth, found = MarkerIK(skeleton), [], {}
    for _ in range(2):
        q = skeleton.neutral()
        q[7:] += rng.uniform(0.1, 0.8, 18)
        seen = skeleton.markers_in_world(q) + rng.normal(0, 1e-3, (22, 3))
        truth.append((seen, solver.solve(seen).q))

    def work(k):
        found[k] = [solver.solve(truth[k][0]).q for _ in range(200)]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k in range(2):
        np.testing.assert_array_equal(found[k], [truth[k][1]] * 200)
