"""A motion for other programs: OpenSim, pandas, xarray, marker files."""

import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, RecordingWarning
from ikns.motion.export import fitted_markers, motion_coordinates, write_motion
from ikns.motion.gimbal import gimbal_sentence, xyz_angles
from ikns.motion.lab_vertical import lab_vertical, up_sentence
from ikns.motion.motion import Motion
from ikns.motion.unseen import warn_unseen
from ikns.recording.files import read
from ikns.recording.files.storage import read_storage
from ikns.recording.recording import Recording

SKELETON = Skeleton.load()
T, J = 6, len(SKELETON.joint_names)
angles = st.floats(-180, 180)


def motion(*, unseen=None):
    """Six frames with numbers of their own; `unseen` are a segment and its frames."""
    rng = np.random.default_rng(9)
    turn = Rotation.from_euler("XYZ", rng.uniform(-1, 1, (T, 3)))
    q = np.hstack(
        [rng.normal(size=(T, 3)), turn.as_quat(), 0.3 * rng.normal(size=(T, J))]
    )
    segments = ("thorax", *dict.fromkeys(m.link for m in SKELETON.marker_set.markers))
    segments = tuple(dict.fromkeys(segments))
    seen, known = np.ones((T, len(segments)), bool), np.ones((T, J), bool)
    if unseen is not None:
        segment, frames = unseen
        seen[frames, segments.index(segment)] = False
        known[frames, -2:] = False
    return Motion(
        time=np.arange(T) / 50,
        q=q,
        v=rng.normal(size=(T, 6 + J)),
        joint_names=SKELETON.joint_names,
        hand_in_thorax=rng.normal(size=(T, 2, 3)),
        hand_rotation_in_thorax=rng.normal(size=(T, 2, 3, 3)),
        hand_velocity_in_thorax=rng.normal(size=(T, 2, 3)),
        residual=rng.uniform(size=T),
        iterations=np.ones(T, int),
        converged=np.arange(T) > 0,
        segments=segments,
        seen=seen,
        known=known,
    )


def test_coordinates_are_those_of_the_motion():
    moved = motion()
    found = motion_coordinates(moved)
    assert found.names[6:] == moved.joint_names
    np.testing.assert_array_equal(found.time, moved.time)
    np.testing.assert_allclose(
        np.radians(found.values[:, 6:]), moved.angles, atol=1e-14
    )
    np.testing.assert_array_equal(found.values[:, :3], moved.q[:, :3])
    # Rotations about the body's own x, then y, then z, multiplied out here.
    x, y, z = np.radians(found.values[:, 3:6].T)
    zero, one = np.zeros(T), np.ones(T)
    about_x = [one, zero, zero, zero, np.cos(x), -np.sin(x), zero, np.sin(x), np.cos(x)]
    about_y = [np.cos(y), zero, np.sin(y), zero, one, zero, -np.sin(y), zero, np.cos(y)]
    about_z = [np.cos(z), -np.sin(z), zero, np.sin(z), np.cos(z), zero, zero, zero, one]
    a, b, c = (
        np.stack(m, axis=1).reshape(T, 3, 3) for m in (about_x, about_y, about_z)
    )
    expected = Rotation.from_quat(moved.q[:, 3:7]).as_matrix()
    np.testing.assert_allclose(a @ b @ c, expected, atol=1e-12)


def test_turning_on_and_on_makes_no_jump():
    moved = motion()
    angle = np.linspace(0, 3 * np.pi, T)
    q = moved.q.copy()
    q[:, 3:7] = Rotation.from_rotvec(np.outer(angle, [1, 0, 0])).as_quat()
    turned = Motion(**{**vars(moved), "q": q})
    found = motion_coordinates(turned).values[:, 3]
    np.testing.assert_allclose(found, np.degrees(angle), atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(
    start=st.tuples(angles, st.sampled_from([-90, -80, 0, 90]), angles),
    step=st.tuples(*3 * [st.floats(-0.2, 0.2)]),
)
def test_any_turning_has_angles_that_give_it_back(start, step):
    first = Rotation.from_euler("XYZ", start, degrees=True)
    turns = Rotation.from_rotvec(np.outer(np.arange(40), step))
    expected = (first * turns).as_matrix()
    found = xyz_angles(expected)
    # In gimbal lock the angles of a matrix are exact to the root of its rounding.
    back = Rotation.from_euler("XYZ", found).as_matrix()
    np.testing.assert_allclose(back, expected, atol=1e-7)
    # Of two triples the nearer one is taken: the other is pi away in every angle.
    away = np.diff(found, axis=0)
    assert np.abs(away).max(initial=0) <= np.pi + 1e-9


def test_a_turn_through_gimbal_lock_goes_on_and_is_told():
    moved = motion()
    turn = np.radians([0, 45, 88, 90, 135, 200])
    q = moved.q.copy()
    q[:, 3:7] = Rotation.from_rotvec(np.outer(turn, [0, 1, 0])).as_quat()
    turned = Motion(**{**vars(moved), "q": q})
    found = motion_coordinates(turned).values[:, 3:6]
    np.testing.assert_allclose(found[:, 1], np.degrees(turn), atol=1e-6)
    np.testing.assert_allclose(found[:, [0, 2]], 0, atol=1e-6)
    assert "thorax_rx and thorax_rz in 2 of 6 frames" in gimbal_sentence(
        turned, thorax=True
    )
    assert gimbal_sentence(turned, thorax=False) == ""
    # An arm straight ahead at shoulder height, in one frame.
    ahead = turned.q.copy()
    ahead[4, 7 + SKELETON.joint_names.index("left_shoulder_flexion")] = np.pi / 2
    told = gimbal_sentence(Motion(**{**vars(turned), "q": ahead}), thorax=False)
    assert "left_shoulder_abduction and left_shoulder_rotation in 1 of 6" in told


def places_by_the_book(path, values):
    """Markers of an .osim file, its frames multiplied out as OpenSim documents them."""
    model = ElementTree.parse(path).getroot().find("Model")

    def frame(part):
        place, turn = (
            np.array(part.findtext(tag).split(), float)
            for tag in ("translation", "orientation")
        )
        whole = np.eye(4)
        whole[:3, 3], whole[:3, :3] = (
            place,
            Rotation.from_euler("XYZ", turn).as_matrix(),
        )
        return part.findtext("socket_parent"), whole

    bodies = {}
    for joint in model.find("JointSet/objects"):
        value = {c.get("name"): values[c.get("name")] for c in joint.iter("Coordinate")}
        moved = np.eye(4)
        if joint.tag == "FreeJoint":
            moved[:3, :3] = Rotation.from_euler(
                "XYZ", [*value.values()][:3]
            ).as_matrix()
            moved[:3, 3] = [*value.values()][3:]
            bodies[joint.findtext("socket_child_frame")] = moved
            continue
        parent, child = map(frame, joint.find("frames"))
        if joint.tag == "PinJoint":
            moved[:3, :3] = Rotation.from_euler("Z", [*value.values()]).as_matrix()
        bodies[child[0]] = (
            bodies[parent[0]] @ parent[1] @ moved @ np.linalg.inv(child[1])
        )
    return {
        m.get("name"): bodies[m.findtext("socket_parent_frame")]
        @ [*map(float, m.findtext("location").split()), 1.0]
        for m in model.iter("Marker")
    }


def test_a_model_of_opensim_moves_its_markers_as_the_body_does(tmp_path):
    # OpenSim 4.6 itself put them there too, to 3e-12 m, at five postures.
    moved, path = motion(), tmp_path / "body.osim"
    assert write_motion(path, moved, SKELETON) == ""
    table = motion_coordinates(moved)
    for q, row in zip(moved.q, table.values, strict=True):
        values = np.radians(row)
        values[:3] = row[:3]
        found = places_by_the_book(path, dict(zip(table.names, values, strict=True)))
        expected = SKELETON.markers_in_world(q)
        for label, place in zip(SKELETON.marker_set.labels, expected, strict=True):
            # Twelve digits are printed of places and angles.
            np.testing.assert_allclose(found[label][:3], place, atol=1e-9)


@given(
    up=st.sampled_from([*np.eye(3), *-np.eye(3)]),
    heading=st.floats(-180, 180),
    lean=st.floats(0, 30),
    way=st.floats(-180, 180),
)
def test_up_in_the_laboratory_is_where_an_upright_trunk_points(up, heading, lean, way):
    # The thorax has y up: to the laboratory's up, then turned about it, then leaning.
    aside = np.roll(up, 1)
    across = Rotation.from_rotvec(np.radians(way) * up).apply(aside)
    stands = (
        Rotation.from_rotvec(np.radians(lean) * across)
        * Rotation.from_rotvec(np.radians(heading) * up)
        * Rotation.align_vectors([up], [[0.0, 1, 0]])[0]
    )
    moved = motion()
    q = moved.q.copy()
    q[:, 3:7] = stands.as_quat()
    found = lab_vertical(Motion(**{**vars(moved), "q": q}))
    np.testing.assert_array_equal(found, up)


def test_a_trunk_that_is_not_upright_shows_no_vertical():
    moved, q = motion(), motion().q.copy()
    q[:, 3:7] = Rotation.from_euler("x", 45, degrees=True).as_quat()
    assert lab_vertical(Motion(**{**vars(moved), "q": q})) is None
    q[:, :7] = np.nan
    assert lab_vertical(Motion(**{**vars(moved), "q": q})) is None
    assert "gravity of the model" in up_sentence(None, model=True)
    assert up_sentence(np.array([0.0, 1, 0]), model=True) == ""
    assert "gravity is along X" in up_sentence(np.array([-1.0, 0, 0]), model=True)


def test_gravity_of_an_opensim_model_is_down_in_the_laboratory(tmp_path):
    for name, up, told in (("own", None, None), ("z", [0, 0, 1], "0 0 -9.80665")):
        path = tmp_path / f"{name}.osim"
        write_motion(path, motion(), SKELETON, up=up)
        model = ElementTree.parse(path).getroot().find("Model")
        assert model.findtext("gravity") == told


@pytest.mark.parametrize("ending", [".mot", ".sto"])
def test_frames_with_gaps_are_left_out_of_opensims_files_and_told(tmp_path, ending):
    hand = SKELETON.marker_set.markers[-1].link
    moved = motion(unseen=(hand, [1, 2]))
    path = tmp_path / f"motion{ending}"
    said = write_motion(path, moved, SKELETON)
    assert said == f"{path} is without 2 frames that do not show all joints."
    found = read_storage(path)
    # Ten digits are printed.
    np.testing.assert_allclose(found.time, moved.time[[0, 3, 4, 5]], rtol=1e-9)
    kept = np.degrees(moved.angles[[0, 3, 4, 5]])
    np.testing.assert_allclose(found.values[:, 6:], kept, rtol=1e-9)
    never = motion(unseen=(hand, slice(None)))
    said = write_motion(path, never, SKELETON, force=True)
    assert said == f"{path} is without 2 coordinates that no frame shows."
    assert read_storage(path).names == found.names[:-2]


def test_without_any_whole_frame_there_is_no_file(tmp_path):
    moved = motion()
    known = np.eye(T, J, dtype=bool)
    path = tmp_path / "motion.mot"
    with pytest.raises(InvalidInput, match="write a .csv file"):
        write_motion(path, Motion(**{**vars(moved), "known": known}), SKELETON)
    assert not path.exists()


@pytest.mark.parametrize("ending", [".trc", ".c3d"])
def test_fitted_markers_are_where_the_body_carries_them(tmp_path, ending):
    hand = SKELETON.marker_set.markers[-1].link
    moved = motion(unseen=(hand, [1, 2]))
    path = tmp_path / f"fitted{ending}"
    assert write_motion(path, moved, SKELETON) == ""
    found = read(path)
    assert found.labels == SKELETON.marker_set.labels
    carried = np.stack([SKELETON.markers_in_world(q) for q in moved.q])
    on_hand = [m.link == hand for m in SKELETON.marker_set.markers]
    gap = np.isnan(found.markers).all(axis=2)
    assert gap[1:3, on_hand].all()
    assert gap.sum() == 2 * sum(on_hand)
    # C3D holds singles of some thousand millimeters, TRC six decimals.
    np.testing.assert_allclose(found.markers[~gap], carried[~gap], atol=5e-7)
    np.testing.assert_array_equal(
        np.isnan(fitted_markers(SKELETON, moved).markers[..., 0]), gap
    )


@pytest.mark.parametrize(
    ("chain", "lost"),
    [
        (None, {"RFIN", "LFIN"}),
        ("right_arm", {"RFIN"}),
        ("both_arms", {"RFIN", "LFIN"}),
    ],
)
def test_markers_that_a_recording_lacks_are_told(chain, lost):
    carried = np.stack([SKELETON.markers_in_world(q) for q in motion().q])
    labels = SKELETON.marker_set.labels
    hidden = [labels.index(label) for label in ("RFIN", "RMEP")]
    carried[:, hidden] = np.nan
    kept = [i for i, label in enumerate(labels) if label != "LFIN"]
    seen = Recording(
        motion().time, carried[:, kept], [labels[i] for i in kept], "reach.c3d"
    )
    # RMEP is taken off after the static trial, so nobody misses it.
    with pytest.warns(RecordingWarning, match="reach.c3d: .* in no frame; ") as told:
        assert set(warn_unseen(SKELETON, seen, chain)) == lost
    assert len(told) == 1
    whole = Recording(motion().time, np.nan_to_num(carried, nan=1.0), labels)
    assert warn_unseen(SKELETON, whole, chain) == ()


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match=r"\.c3d or \.osim, found"):
        write_motion(tmp_path / "motion.xlsx", motion(), SKELETON)


def test_a_data_frame_has_a_column_for_every_joint():
    moved = motion(unseen=(SKELETON.marker_set.markers[-1].link, [1, 2]))
    frame = moved.to_dataframe()
    assert frame.index.name == "time_s"
    np.testing.assert_array_equal(frame.index, moved.time)
    for k, name in enumerate(moved.joint_names):
        np.testing.assert_array_equal(frame[f"{name}_rad"], moved.angles[:, k])
    np.testing.assert_array_equal(
        frame["right_hand_y_m"], moved.hand_in_thorax[:, 0, 1]
    )
    np.testing.assert_array_equal(frame["left_hand_z_m"], moved.hand_in_thorax[:, 1, 2])
    np.testing.assert_array_equal(frame["converged"], moved.converged)
    assert len(frame.columns) == J + 6 + 2


def test_a_dataset_has_its_axes_and_units():
    moved = motion()
    found = moved.to_xarray()
    elbow = moved.joint_names.index("right_elbow_flexion")
    chosen = found["angles"].sel(joint="right_elbow_flexion")
    np.testing.assert_array_equal(chosen, moved.angles[:, elbow])
    hand = found["hand_in_thorax"].sel(side="left", axis="y")
    np.testing.assert_array_equal(hand, moved.hand_in_thorax[:, 1, 1])
    assert found["angles"].attrs["units"] == "rad"
    assert found["hand_velocity_in_thorax"].attrs["units"] == "m/s"
    assert found["velocities"].shape == (T, J)
    np.testing.assert_array_equal(found["time"], moved.time)


@pytest.mark.parametrize("library", ["pandas", "xarray"])
def test_without_the_library_the_extra_is_named(monkeypatch, library):
    monkeypatch.setitem(sys.modules, library, None)
    moved = motion()
    table = moved.to_dataframe if library == "pandas" else moved.to_xarray
    with pytest.raises(InvalidInput, match=rf"needs {library}; .*'ikns\[tables\]'"):
        table()
