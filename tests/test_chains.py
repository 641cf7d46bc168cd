"""Chains as data: files, checks against the body, ends that are no hands, live."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st

import ikns
from ikns.analysis.ucm.tasks import chain_task
from ikns.body.chain_files import read_chains
from ikns.body.chains import (
    SIDES,
    Chain,
    chain_sides,
    no_swivel,
    shipped_chains,
    whole_arms,
)
from ikns.body.skeleton import Skeleton, check_chain
from ikns.calibration.subject import Subject
from ikns.cli import main
from ikns.errors import FileError, IknsError, InvalidInput
from ikns.live.control import FrameSolver
from ikns.motion.ends import with_ends
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap

BODY = Skeleton.load()
ARM = ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation", "elbow_flexion")
ARM += ("forearm_pronation", "wrist_flexion", "wrist_deviation")
RIGHT, LEFT = (tuple(f"{side}_{joint}" for joint in ARM) for side in SIDES)
ELBOW = Chain("right_elbow", RIGHT[:3], ("right_forearm",))
FROM_ARM = Chain("forearm", RIGHT[3:], ("right_knuckle",), "right_upper_arm")
BOTH_ENDS = Chain("elbows", (*LEFT[:4], *RIGHT[:4]), ("left_hand", "right_forearm"))


def test_the_shipped_chains_are_the_five_of_always():
    clavicle = ("clavicle_protraction", "clavicle_elevation")
    expected = {
        f"{side}_arm": (tuple(f"{side}_{joint}" for joint in ARM), (f"{side}_knuckle",))
        for side in SIDES
    }
    for side in SIDES:
        girdle = tuple(f"{side}_{joint}" for joint in clavicle)
        joints, ends = expected[f"{side}_arm"]
        expected[f"{side}_arm_clavicle"] = (girdle + joints, ends)
    expected["both_arms"] = (RIGHT + LEFT, ("right_knuckle", "left_knuckle"))
    assert {n: (c.joints, c.ends) for n, c in shipped_chains().items()} == expected
    assert all(c.base == "thorax" for c in shipped_chains().values())


@pytest.mark.parametrize("chain", [ELBOW, FROM_ARM, BOTH_ENDS], ids=str)
def test_ends_and_their_jacobian_are_those_of_the_links(chain):
    """Composed from poses in the thorax, and by central differences."""
    q = np.random.default_rng(3).uniform(BODY.lower, BODY.upper, (5, 18))

    def ends(angles):
        base_p, base_R = BODY.link_in_thorax(angles, chain.base)
        poses = [BODY.link_in_thorax(angles, end) for end in chain.ends]
        turn = np.swapaxes(base_R, -1, -2)
        places = [np.einsum("...ij,...j->...i", turn, p - base_p) for p, _ in poses]
        return np.stack(places, axis=-2), np.stack([turn @ R for _, R in poses], -3)

    for found, wanted in zip(BODY.chain_ends(q, chain), ends(q), strict=True):
        # Products of some ten rotations.
        np.testing.assert_allclose(found, wanted, atol=1e-14)
    J = BODY.chain_jacobian(q, chain, task="position")
    step = 1e-6
    for j, joint in enumerate(chain.joints):
        move = step * np.eye(18)[BODY.joint_names.index(joint)]
        slope = (ends(q + move)[0] - ends(q - move)[0]) / (2 * step)
        # Rounding of 1e-16 m over the step, third order 1e-12.
        np.testing.assert_allclose(J[..., j], slope.reshape(5, -1), atol=1e-9)


NAMES = st.text(min_size=1, max_size=12).filter(str.strip)


@given(
    name=NAMES,
    joints=st.lists(NAMES, min_size=1, max_size=5, unique=True),
    ends=st.lists(NAMES, min_size=1, max_size=3, unique=True),
    base=NAMES,
    extrinsic=st.booleans(),
)
@settings(max_examples=30)
def test_a_written_chain_is_read_back(
    tmp_path_factory, name, joints, ends, base, extrinsic
):
    made = Chain(name, tuple(joints), tuple(ends), base, extrinsic)
    path = tmp_path_factory.getbasetemp() / "chain.toml"
    path.write_text(made.toml(), encoding="utf-8")
    if name in shipped_chains():
        return
    assert ikns.load_chain(path) == made
    assert ikns.load_chain(f"{path}:{name}") == made


@given(st.text(max_size=60) | st.binary(max_size=60))
@settings(max_examples=30)
def test_whatever_is_in_a_file_is_a_chain_or_one_sentence(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FileError, match=r"any.toml: .*\.$"):
        read_chains(path)


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ("x = 1", "expected 'format = 1'"),
        ("format = 1\nchains = {}", "at least one table"),
        ("format = 1\n[chains.a]\nends = ['x']", "expected a table with joints"),
        ("format = 1\n[chains.a]\njoints = ['x']", "found neither"),
        ("format = 1\n[chains.a]\njoints = 'x'\nends = ['y']", "joints as a list"),
        ("format = 1\n[chains.a]\njoints = []\nends = ['y']", "joints as a list"),
        ("format = 1\n[chains.a]\njoints = [1]\nends = ['y']", "joints as a list"),
        ("format = 1\n[chains.a]\njoints = ['x', 'x']\nends = ['y']", "x again"),
        ("format = 1\n[chains.a]\njoints = ['x']\nends = ['y']\nend = 1", "found end"),
        ("format = 1\n[chains.a]\njoints = ['x']\nends = ['y']\nbase = 1", "as base"),
        ("format = 1\n[chains.a]\njoints = ['x']\ntask = 'leg'", "unknown chain 'leg'"),
        ("format = 1\n[chains.a]\njoints = ['x']\ntask = 3", "unknown chain '3'"),
        (
            "format = 1\n[chains.a]\njoints = ['right_elbow_flexion']\n"
            "task = 'right_arm'",
            "joints that right_arm leaves alone, found right_elbow_flexion",
        ),
        (
            "format = 1\n[chains.a]\njoints = ['x']\ntask = 'right_arm'\nends = ['y']",
            "leave out ends",
        ),
        ("format = 1\n[chains.left_arm]\njoints = ['x']\nends = ['y']", "own"),
    ],
)
def test_a_file_that_is_no_chain_is_refused(tmp_path, table, fault):
    path = tmp_path / "mine.toml"
    path.write_text(table)
    with pytest.raises(FileError, match=fault) as told:
        ikns.load_chain(path)
    assert str(told.value).startswith(str(path))


def test_one_of_several_chains_needs_its_name(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(ELBOW.toml() + FROM_ARM.toml().replace("format = 1\n", ""))
    assert ikns.load_chain(f"{path}:forearm") == FROM_ARM
    for name in (str(path), f"{path}:leg"):
        with pytest.raises(InvalidInput, match="its chains, right_elbow, forearm"):
            ikns.load_chain(name)
    for name in ("", "leg", "two.tom", f"{path}x"):
        with pytest.raises(InvalidInput, match="known are right_arm, left_arm"):
            ikns.load_chain(name)
    with pytest.raises(FileError, match=r"none\.toml: no such file\."):
        ikns.load_chain(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("chain", "fault"),
    [
        (Chain("a", ("left_knee",), ("right_knuckle",)), "no joint left_knee"),
        (Chain("a", RIGHT, ("nose",)), "found 'nose'"),
        (Chain("a", RIGHT, ("right_elbow_flexion",)), "found 'right_elbow_flexion'"),
        (Chain("a", RIGHT, ("right_knuckle",), "nose"), "found 'nose'"),
        (Chain("a", RIGHT, ("left_knuckle",)), "not depend on right_shoulder_abd"),
        (Chain("a", RIGHT, ("right_forearm",)), "right_wrist_deviation; leave them"),
        (Chain("a", RIGHT, ("right_knuckle",), "right_hand"), "expected a base"),
        (Chain("a", RIGHT, ("right_knuckle",), "left_hand"), "expected a base"),
        (Chain("a", RIGHT, ("right_knuckle",), "right_forearm"), "not depend on"),
        (Chain("a", RIGHT[5:], ("right_knuckle",)), "leave nothing over"),
        (Chain("a", LEFT[:2] + RIGHT[:1], ("thorax",)), "does not depend on"),
    ],
)
def test_a_chain_that_the_body_does_not_have_is_refused(chain, fault):
    with pytest.raises(InvalidInput, match=fault):
        check_chain(BODY, chain)


def test_as_many_freedoms_as_joints_leave_over():
    """Three joints turn about one point: their end stays on a sphere."""
    assert check_chain(BODY, ELBOW) is ELBOW
    with pytest.raises(InvalidInput, match="only 1 degree of freedom over"):
        check_chain(BODY, ELBOW, n_dof=2)
    assert check_chain(BODY, "both_arms", n_dof=9).name == "both_arms"


def test_what_a_chain_involves():
    crossed = ikns.extrinsic_chain("a", LEFT, "right_arm")
    mine = Chain("a", RIGHT[::-1], ("right_knuckle",))
    for chain, sides, arms, hands in (
        (ELBOW, ("right",), (), None),
        (FROM_ARM, ("right",), (), None),
        (BOTH_ENDS, ("right", "left"), (), None),
        (crossed, ("right", "left"), (), (0,)),
        (mine, ("right",), ("right",), (0,)),
    ):
        assert (chain_sides(chain), whole_arms(chain)) == (sides, arms)
        assert chain.hands == hands
        assert bool(no_swivel(chain)) == (not arms)
    assert "'right_elbow' has no elbow swivel" in no_swivel(ELBOW)


def motion_of(q: np.ndarray, rate: float) -> Motion:
    """Everything seen; hands and velocities by central differences."""
    time = np.arange(len(q)) / rate
    place, rotation = BODY.hands_in_thorax(q)
    n = len(time)
    return Motion(
        time=time,
        q=q,
        v=np.hstack([np.zeros((n, 6)), np.gradient(q[:, 7:], time, axis=0)]),
        joint_names=BODY.joint_names,
        hand_in_thorax=place,
        hand_rotation_in_thorax=rotation,
        hand_velocity_in_thorax=np.gradient(place, time, axis=0),
        residual=np.zeros(n),
        iterations=np.zeros(n, dtype=int),
        converged=np.ones(n, dtype=bool),
    )


def test_a_motion_holds_other_ends_once_asked():
    rate, q = 100.0, np.tile(BODY.neutral(), (60, 1))
    swing = 0.2 * np.sin(np.arange(60) / rate * 4.0)
    q[:, 7 + BODY.joint_names.index("right_shoulder_flexion")] += swing
    bare = motion_of(q, rate)
    for chain in (ELBOW, FROM_ARM):
        with pytest.raises(InvalidInput, match="track it with that chain"):
            bare.hand_speed(chain)
    motion = with_ends(BODY, bare, ELBOW)
    place = BODY.link_in_thorax(q, "right_forearm")[0]
    np.testing.assert_array_equal(motion.task_position(ELBOW), place)
    speed = np.linalg.norm(np.gradient(place, motion.time, axis=0), axis=1)
    # Slopes differ in the fourth power of 4 rad/s times a step of 10 ms, and by the
    # third of the window: some 1 % of the largest.
    inner = slice(5, -5)
    np.testing.assert_allclose(
        motion.hand_speed(ELBOW)[inner], speed[inner], atol=0.02 * speed.max()
    )
    # From the upper arm the hand does not move.
    still = with_ends(BODY, bare, FROM_ARM)
    assert still.hand_speed(FROM_ARM).max() < 1e-12
    assert with_ends(BODY, bare, "left_arm") is bare


@pytest.mark.parametrize("chain", [ELBOW, FROM_ARM, BOTH_ENDS], ids=str)
def test_a_live_frame_reads_any_chain(chain):
    corners = np.array(list(itertools.product((-0.6, 0.6), repeat=3)))
    rng, n = np.random.default_rng(5), len(chain.joints)
    z = np.linalg.qr(rng.normal(size=(n, n)))[0]
    learned = NullSpaceMap.from_arrays(
        corners, z[np.arange(8) % n], np.full(8, -1.0), rng.uniform(1.0, 2.0, 8)
    )
    solver = FrameSolver(BODY, learned, chain)
    q = BODY.neutral()
    q[7:] += 0.3
    solver.reset(q)
    frame = solver.solve(BODY.markers_in_world(q))
    angles = frame.q[7:][[BODY.joint_names.index(joint) for joint in chain.joints]]
    place = BODY.chain_ends(frame.q, chain)[0].mean(axis=0)
    # The same sums in another order.
    np.testing.assert_allclose(frame.hand_in_thorax, place, atol=1e-14)
    c = learned.control_signal(angles, place)
    np.testing.assert_allclose(frame.c, c, atol=1e-12)
    assert frame.in_sight
    assert frame.inside


def test_what_needs_a_whole_arm_says_so():
    one = small_person.subject()
    bent = Chain("bent", RIGHT[2:], ("right_knuckle",))
    z = one.null_space_map.directions_[:, :, 2:]
    arrays = one.null_space_map.lower_, one.null_space_map.upper_
    learned = NullSpaceMap.from_arrays(one.null_space_map.centers_, z, *arrays)
    person = Subject(one.skeleton, learned, bent, one.report)
    for method in ("intent", "proximal"):
        with pytest.raises(InvalidInput, match="'bent' has no elbow swivel: expected"):
            person.readout(method)
    for coordinates, fault in (("isb", "no whole shoulder"), ("internal", None)):
        options = {"chain": bent, "task": "position", "resamples": 0}
        options["coordinates"] = coordinates
        if fault is None:
            found = ikns.compare_motion(learned, BODY, one.motions[0], **options)
            assert np.isfinite(found.pooled["angle"][0])
            continue
        with pytest.raises(InvalidInput, match=fault):
            ikns.compare_motion(learned, BODY, one.motions[0], **options)
    with pytest.raises(InvalidInput, match="expected a chain that ends in the right"):
        ikns.compare_motion(
            learned, BODY, one.motions[0], chain=bent, analyzed="left_arm"
        )
    resting = ikns.extrinsic_chain("resting", LEFT[:5], "right_arm")
    with pytest.raises(InvalidInput, match="'resting' is extrinsic"):
        ikns.compare_motion(learned, BODY, one.motions[0], chain=resting)
    with pytest.raises(InvalidInput, match="'resting' is extrinsic"):
        chain_task(BODY, resting, np.zeros(18))


def test_a_subject_of_another_chain_is_refused(tmp_path):
    one = small_person.subject()
    Subject(one.skeleton, one.null_space_map, RAISED, one.report).save(tmp_path / "a")
    with pytest.raises(FileError, match="a direction needs one entry per joint"):
        Subject.load(tmp_path / "a")
    own = Chain("mine", RIGHT, ("right_knuckle",))
    Subject(one.skeleton, one.null_space_map, own, one.report).save(tmp_path / "b")
    assert Subject.load(tmp_path / "b").chain == own
    path = tmp_path / "b" / "map.json"
    table = json.loads(path.read_text())
    for change in ({"ends": ["nose"]}, {"base": 1}, {"joints": ["left_knee"]}):
        path.write_text(json.dumps(table | change))
        with pytest.raises(FileError, match="cannot be read as a null-space map"):
            Subject.load(tmp_path / "b")
    path.write_text(json.dumps({k: v for k, v in table.items() if k != "extrinsic"}))
    with pytest.raises(IknsError, match="extrinsic"):
        Subject.load(tmp_path / "b")
    with pytest.raises(InvalidInput, match="expected a map of the 8 joints of raised"):
        FrameSolver(one.skeleton, one.null_space_map, RAISED)


RAISED = Chain("raised", ("right_clavicle_elevation", *RIGHT), ("right_knuckle",))


def test_the_files_are_where_the_urdf_is():
    assert {c.name for c in read_chains(_shipped()).values()} == set(shipped_chains())


def _shipped() -> Path:
    from ikns.body.model_file import urdf_folder

    return urdf_folder() / "chains.toml"


def test_a_chain_is_not_replaced_by_the_folder_that_it_helps_to_make(tmp_path, capsys):
    small_person.subject().save(tmp_path / "a")
    mine = tmp_path / "a" / "markers.toml"
    mine.write_text(RAISED.toml())
    argv = ["calibrate", "--static", "x.c3d", "--exploration", "x.c3d", "--force"]
    for name in (str(mine), f"{mine}:raised"):
        assert main([*argv, "--out", str(tmp_path / "a"), "--chain", name]) == 2
        assert "markers.toml" in capsys.readouterr().err
    assert ikns.load_chain(mine) == RAISED
