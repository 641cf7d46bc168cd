"""A motion for other programs: OpenSim, pandas, xarray, marker files."""

import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, RecordingWarning
from ikns.motion.export import fitted_markers, motion_coordinates, write_motion
from ikns.motion.motion import Motion
from ikns.motion.unseen import warn_unseen
from ikns.recording.files import read
from ikns.recording.files.storage import read_storage
from ikns.recording.recording import Recording

SKELETON = Skeleton.load()
T, J = 6, len(SKELETON.joint_names)


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
    with pytest.warns(RecordingWarning, match="reach.c3d: no frame shows") as told:
        assert set(warn_unseen(SKELETON, seen, chain)) == lost
    assert len(told) == 1
    whole = Recording(motion().time, np.nan_to_num(carried, nan=1.0), labels)
    assert warn_unseen(SKELETON, whole, chain) == ()


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match=r"\.csv, \.mot, \.sto, \.trc, \.c3d, found"):
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
