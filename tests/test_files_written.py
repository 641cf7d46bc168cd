"""TRC, CSV, MOT and STO written and read; one format into another."""

import importlib.util
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ikns.errors import FileError, InvalidInput
from ikns.recording.files import read, write
from ikns.recording.files.convert import convert_file
from ikns.recording.files.joint_angles import read_joint_angles
from ikns.recording.files.storage import (
    CoordinateTable,
    complete_frames,
    read_storage,
    write_storage,
)
from ikns.recording.recording import Recording

NAMES = ["S:RSHO", "S:RELB"]
PLACES = np.random.default_rng(6).normal(size=(5, 2, 3))
RECORDING = Recording(np.arange(20, 25) / 100, PLACES, NAMES)
ENDINGS = [".c3d", ".trc", ".csv"]
#: Half of the last of six decimals of a millimeter, and a rounding of that.
PRINTED = 0.51e-9


@pytest.mark.parametrize("ending", [".trc", ".csv"])
@settings(max_examples=25, deadline=None)
@given(
    points=arrays(
        float,
        st.tuples(st.integers(2, 5), st.integers(1, 3), st.just(3)),
        elements=st.floats(-9, 9) | st.just(np.nan),
    ),
    first=st.integers(0, 10**6),
    rate=st.sampled_from([25.0, 100.0, 119.88, 1000.0]),
)
def test_what_was_written_comes_back(tmp_path_factory, ending, points, first, rate):
    points[0, :] = [[1.0, 2.0, 3.0]]  # everybody is seen, and spread like a person
    points[1, :] = [[2.0, 3.0, 4.0]]
    unseen = np.isnan(points).any(axis=2) | (np.abs(points) < 1e-9).all(axis=2)
    expected = np.where(unseen[..., None], np.nan, points)
    time = (first + np.arange(len(points))) / rate
    labels = [f"M{i}" for i in range(points.shape[1])]
    path = tmp_path_factory.mktemp("written") / f"trial{ending}"
    write(path, Recording(time, points, labels))
    found = read(path)
    assert found.labels == tuple(labels)
    np.testing.assert_allclose(found.markers, expected, rtol=0, atol=PRINTED)
    # Times in TRC have six decimals; frame numbers over the rate one rounding.
    np.testing.assert_allclose(found.time, time, rtol=1e-9, atol=0.51e-6)


@pytest.mark.parametrize("ending", ENDINGS)
def test_nothing_is_overwritten_unasked(tmp_path, ending):
    path = tmp_path / f"trial{ending}"
    path.write_text("mine")
    with pytest.raises((FileError, InvalidInput)):
        write(path, RECORDING)
    assert path.read_text() == "mine"
    write(path, RECORDING, force=True)
    assert read(path).labels == tuple(NAMES)


def test_what_no_file_can_hold_is_refused(tmp_path):
    with pytest.raises(FileError, match=r"ends in \.c3d, \.trc, \.csv, found \.mat"):
        write(tmp_path / "trial.mat", RECORDING)
    odd = Recording([0.0, 0.1, 0.5], np.ones((3, 1, 3)), ["A"])
    tab = Recording([0.0, 0.1], np.ones((2, 1, 3)), ["A\tB"])
    for ending in (".trc", ".csv"):
        with pytest.raises(InvalidInput, match="constant frame rate"):
            write(tmp_path / f"trial{ending}", odd)
        with pytest.raises(InvalidInput, match="labels without tabs"):
            write(tmp_path / f"trial{ending}", tab)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("source", ENDINGS)
@pytest.mark.parametrize("target", ENDINGS)
def test_markers_are_the_same_in_every_format(tmp_path, source, target):
    write(tmp_path / f"a{source}", RECORDING)
    found = convert_file(tmp_path / f"a{source}", tmp_path / f"b{target}")
    assert (found.kind, found.frames, found.names) == ("markers", 5, tuple(NAMES))
    recording = read(tmp_path / f"b{target}")
    # C3D holds singles of millimeters.
    np.testing.assert_allclose(recording.markers, PLACES, rtol=2.0**-22, atol=PRINTED)
    np.testing.assert_allclose(recording.time, RECORDING.time, atol=1e-9)


def test_a_part_is_converted(tmp_path):
    write(tmp_path / "a.c3d", RECORDING)
    convert_file(
        tmp_path / "a.c3d",
        tmp_path / "b.trc",
        subject_prefix="s",
        start="0.21",
        end="0.23",
    )
    part = read(tmp_path / "b.trc")
    assert part.labels == ("RSHO", "RELB")
    np.testing.assert_allclose(part.time, [0.21, 0.22, 0.23], atol=1e-9)


def markers_by_the_book(path):
    """Read a TRC file as OpenSim documents it: every cell ends with a tab."""
    lines = path.read_text().split("\n")
    labels = lines[3].split("\t")[2::3]
    rows = [line.split("\t") for line in lines[6:-1]]
    assert {len(row) for row in rows} == {2 + 3 * len(labels) + 1}
    table = np.array([[float(cell or "nan") for cell in row[:-1]] for row in rows])
    return labels, table[:, 1], table[:, 2:].reshape(len(rows), len(labels), 3)


def in_a_process(function, path):
    """OpenSim does not load next to the CasADi that other tests have loaded.

    It writes its log where it is loaded: in the folder of `path`.
    """
    with ProcessPoolExecutor(
        1, get_context("spawn"), initializer=os.chdir, initargs=(path.parent,)
    ) as pool:
        return pool.submit(function, path).result()


def markers_by_opensim(path):
    return in_a_process(markers_in_opensim, path)


def markers_in_opensim(path):
    import opensim

    found = opensim.TimeSeriesTableVec3(str(path))
    labels = list(found.getColumnLabels())
    time = np.array(found.getIndependentColumn())
    matrix, size = found.getMatrix(), (len(time), len(labels))
    places = [[matrix.getElt(*at)[k] for k in range(3)] for at in np.ndindex(*size)]
    return labels, time, np.array(places).reshape(*size, 3)


@pytest.mark.parametrize(
    "reader",
    [markers_by_the_book]
    + [markers_by_opensim] * (importlib.util.find_spec("opensim") is not None),
)
@pytest.mark.parametrize("gap", [(2, 0), (2, 1)], ids=["first marker", "last marker"])
def test_others_read_markers_and_gaps(tmp_path, reader, gap):
    places = PLACES.copy()
    places[gap] = np.nan
    path = tmp_path / "trial.trc"
    write(path, Recording(RECORDING.time, places, NAMES))
    labels, time, found = reader(path)
    assert labels == NAMES
    np.testing.assert_allclose(time, RECORDING.time, atol=1e-9)
    np.testing.assert_allclose(found * 1e-3, places, atol=PRINTED)


# OpenSim's tables.

TABLE = CoordinateTable(
    np.arange(4) / 50,
    ("hip_tx", "right_elbow_flexion", "right_wrist_flexion"),
    np.random.default_rng(1).normal(size=(4, 3)) * 60,
    True,
)


def by_the_book(path):
    """Read a MOT file as OpenSim documents it: header, names, rows."""
    head, _, body = path.read_text().partition("endheader\n")
    keys = dict(line.split("=") for line in head.split("\n") if "=" in line)
    names, *rows = body.strip().split("\n")
    table = np.array([[float(cell) for cell in row.split("\t")] for row in rows])
    assert int(keys["nRows"]), int(keys["nColumns"]) == table.shape
    return names.split("\t"), table, keys["inDegrees"] == "yes"


def by_opensim(path):
    return in_a_process(in_opensim, path)


def in_opensim(path):
    """Read it by OpenSim itself; both ways that it has find the same."""
    import opensim

    found = opensim.TimeSeriesTable(str(path))
    names = ["time", *found.getColumnLabels()]
    columns = [found.getDependentColumn(name).to_numpy() for name in names[1:]]
    table = np.column_stack([found.getIndependentColumn(), *columns])
    older = opensim.Storage(str(path))
    assert older.getSize() == len(table)
    return names, table, older.isInDegrees()


# OpenSim is in the group `bench` only.
READERS = [by_the_book] + [by_opensim] * (
    importlib.util.find_spec("opensim") is not None
)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("ending", [".mot", ".sto"])
def test_others_read_what_was_written(tmp_path, ending, reader):
    path = tmp_path / f"angles{ending}"
    write_storage(path, TABLE)
    names, table, in_degrees = reader(path)
    assert tuple(names) == ("time", *TABLE.names)
    assert in_degrees
    # Ten digits are printed.
    np.testing.assert_allclose(table[:, 0], TABLE.time, rtol=1e-9)
    np.testing.assert_allclose(table[:, 1:], TABLE.values, rtol=1e-9)


def test_what_was_written_is_read_and_nothing_is_overwritten(tmp_path):
    path = tmp_path / "angles.mot"
    write_storage(path, TABLE)
    found = read_storage(path)
    assert (found.names, found.in_degrees) == (TABLE.names, True)
    np.testing.assert_allclose(found.values, TABLE.values, rtol=1e-9)
    with pytest.raises(InvalidInput):
        write_storage(path, TABLE)


def test_gaps_are_left_out_before_and_refused_in_writing(tmp_path):
    values = TABLE.values.copy()
    values[:, 0] = np.nan
    values[2, 1] = np.nan
    whole = complete_frames(TABLE.time, TABLE.names, values, in_degrees=True)
    assert whole.names == TABLE.names[1:]
    np.testing.assert_array_equal(whole.time, TABLE.time[[0, 1, 3]])
    np.testing.assert_array_equal(whole.values, values[[0, 1, 3], 1:])
    gap = CoordinateTable(TABLE.time, TABLE.names, values, True)
    with pytest.raises(InvalidInput, match="cannot have gaps"):
        write_storage(tmp_path / "gap.mot", gap)
    nothing = complete_frames(TABLE.time, TABLE.names, values * np.nan, in_degrees=True)
    assert nothing.values.shape == (0, 0)


STATES = """states
version=1
OpenSimVersion=4.5
inDegrees=no
endheader
time /jointset/elbow/flexion/value /jointset/elbow/flexion/speed slide
 0.00  0.5  9  0.1
 0.01  0.6  9  0.2
"""


def test_paths_of_a_model_and_blanks_are_read(tmp_path):
    path = tmp_path / "states.sto"
    path.write_text(STATES)
    found = read_storage(path)
    assert found.names == ("flexion", "slide")
    np.testing.assert_array_equal(found.values, [[0.5, 0.1], [0.6, 0.2]])
    time, q = read_joint_angles(path, ["slide", "flexion"])
    np.testing.assert_array_equal(time, [0.0, 0.01])
    np.testing.assert_array_equal(q, [[0.1, 0.5], [0.2, 0.6]])


def test_degrees_are_those_of_joints_that_turn(tmp_path):
    path = tmp_path / "robot.mot"
    path.write_text(STATES.replace("inDegrees=no", "inDegrees=yes"))
    _, q = read_joint_angles(path, ["flexion", "slide"], sliding=["slide"])
    expected = [[np.radians(0.5), 0.1], [np.radians(0.6), 0.2]]
    np.testing.assert_allclose(q, expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("time\ta\n0\t1\n", "a header that ends with 'endheader'"),
        (STATES.replace("inDegrees=no", "DataType=Quaternion"), "DataType 'quatern"),
        (STATES.replace("time ", "frame "), "columns that start with time"),
        (STATES.replace(" 0.01 ", " 0.00 "), "a time that increases"),
        (STATES.replace("0.6", "many"), "found 'many'"),
        (STATES.replace("slide", "elbow").replace("/flexion/v", "/elbow/v"), "twice"),
        (STATES.partition(" 0.00")[0], "a time that increases"),
    ],
)
def test_what_is_no_storage_file_is_refused(tmp_path, text, complaint):
    path = tmp_path / "bad.sto"
    path.write_text(text)
    with pytest.raises(FileError, match=complaint):
        read_storage(path)


@settings(max_examples=60, deadline=None)
@given(changes=st.lists(st.tuples(st.integers(0), st.integers(0, 255)), min_size=1))
def test_flipped_bytes_survive(tmp_path_factory, changes):
    content = bytearray(STATES.encode())
    for place, byte in changes:
        content[place % len(content)] = byte
    path = tmp_path_factory.mktemp("flipped") / "flipped.sto"
    path.write_bytes(content)
    try:
        found = read_storage(path)
    except FileError as error:
        assert str(error).isprintable()  # noqa: PT017
    else:
        assert found.values.shape == (len(found.time), len(found.names))


def test_angles_go_from_format_to_format(tmp_path):
    write_storage(tmp_path / "a.mot", TABLE)
    assert convert_file(tmp_path / "a.mot", tmp_path / "b.csv").kind == "joint angles"
    head = (tmp_path / "b.csv").read_text().split("\n")[0]
    assert head == "time_s,hip_x_m,right_elbow_flexion_deg,right_wrist_flexion_deg"
    found = convert_file(
        tmp_path / "b.csv", tmp_path / "c.sto", start="0.02", end="0.04"
    )
    assert (found.frames, found.names) == (2, TABLE.names)
    back = read_storage(tmp_path / "c.sto")
    # Nine digits are printed in between.
    np.testing.assert_allclose(back.values, TABLE.values[1:3], rtol=1e-8)


def test_frames_with_gaps_are_counted(tmp_path):
    (tmp_path / "a.csv").write_text("time_s,a_deg,residual_m\n0,1,\n1,,0.1\n2,3,0.1\n")
    found = convert_file(tmp_path / "a.csv", tmp_path / "b.mot")
    assert (found.frames, found.names, found.left_out) == (2, ("a",), 1)


@pytest.mark.parametrize(
    ("source", "target", "options", "complaint"),
    [
        ("a.c3d", "b.mot", {}, r"in \.c3d, \.trc, \.csv for markers, found \.mot"),
        ("a.mot", "b.trc", {}, r"in \.mot, \.sto or \.csv for joint angles"),
        ("a.mot", "b.sto", {"subject_prefix": "S"}, "found joint angles"),
        ("a.mot", "b.sto", {"start": "Jump"}, "a number of seconds, found 'Jump'"),
        ("a.mot", "b.sto", {"start": "9"}, "to last from 0 to 0.06 s"),
        ("a.docx", "b.sto", {}, r"ends in \.c3d, .*\.sto, found \.docx"),
    ],
)
def test_what_cannot_be_converted_is_refused(
    tmp_path, source, target, options, complaint
):
    write(tmp_path / "a.c3d", RECORDING)
    write_storage(tmp_path / "a.mot", TABLE)
    with pytest.raises((FileError, InvalidInput), match=complaint):
        convert_file(tmp_path / source, tmp_path / target, **options)
    assert not (tmp_path / target).exists()
