"""Exports of Motive, Qualisys and Vicon Workstation: positions, times, names, gaps.

Written here as the programs write them, with invented numbers.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from test_files_repaired import reading, refused

from ikns.errors import FileError

NAMES = ["RSHO", "RELB", "RWRA"]
#: mm, each with the three decimals that are printed.
POINTS = (1000 + 300 * np.random.default_rng(8).normal(size=(4, 3, 3))).round(3)
POINTS[2, 1] = np.nan


def cells(points, separator):
    return [
        separator.join("" if np.isnan(v) else repr(float(v)) for v in frame.ravel())
        for frame in points
    ]


def motive(
    points=POINTS,
    names=NAMES,
    *,
    kind="Marker",
    version="1.23",
    unit="Millimeters",
    more="Coordinate Space,Global",
    extra=("", "", ""),
    first=0,
):
    """Return a Motive export; `extra` are kind, name and value of one column more."""
    keys = f"Format Version,{version},Take Name,Take 2,Capture Frame Rate,240.000000,"
    keys += "Export Frame Rate,120.000000,Rotation Type,Quaternion"
    keys += f",Length Units,{unit}" * bool(unit) + f",{more}" * bool(more)
    triple = [n for n in names for _ in "XYZ"]
    one = [extra[0]] if extra[0] else []
    head = [
        ["", "Type", *one, *[kind] * len(triple)],
        ["", "Name", *[extra[1]] * len(one), *(f'"Skel:{n}"' for n in triple)],
        ["", "ID", *[""] * len(one), *(f'"8F{i}"' for i in range(len(triple)))],
        ["", "", *["Rotation"] * len(one), *["Position"] * len(triple)],
        ["Frame", "Time (Seconds)", *["W"] * len(one), *"XYZ" * len(names)],
    ]
    if version == "1.25":
        head.insert(3, ["", "Parent", *[""] * (len(one) + len(triple))])
    if version == "1.0":
        head[-1][:2] = ["", ""]
    rows = [
        ",".join([str(i), f"{i / 120:.6f}", *[extra[2]] * len(one), row])
        for i, row in enumerate(cells(points, ","), first)
    ]
    return "\n".join([keys, "", *(",".join(line) for line in head), *rows]) + "\n"


def qualisys(points=POINTS, names=NAMES, *, before=True, title=True, **changes):
    header = {"NO_OF_FRAMES": len(points), "NO_OF_CAMERAS": 8}
    header |= {"NO_OF_MARKERS": len(names), "FREQUENCY": 100, "NO_OF_ANALOG": 0}
    header |= {"ANALOG_FREQUENCY": 0, "DESCRIPTION": "--"}
    header |= {"TIME_STAMP": "2026-01-02, 10:20:30.400\t123.5", "DATA_INCLUDED": "3D"}
    header |= {"MARKER_NAMES": "\t".join(names)} | changes
    header |= {"TRAJECTORY_TYPES": "\t".join("Measured" for _ in names)}
    lines = [f"{key}\t{value}" for key, value in header.items() if value != ""]
    columns = [f"{name} {axis}" for name in names for axis in "XYZ"]
    if title:
        lines.append("\t".join(["Frame", "Time"] * before + columns))
    for i, row in enumerate(cells(points, "\t")):
        lines.append(f"{i + 1}\t{i / 100:.5f}\t" * before + row)
    return "\n".join(lines) + "\n"


def workstation(points=POINTS, names=NAMES, *, rate="100,Hz", first=1, after=""):
    lines = ["Title", "Date:", "Time:", "Type:", "", "TRAJECTORIES", rate]
    lines += ["," + ",,,".join(names) + ",,", "Field #" + ",X,Y,Z" * len(names)]
    lines += [f"{first + i},{row}" for i, row in enumerate(cells(points, ","))]
    return "\n".join(lines) + f"\n{after}"


FORMATS = {
    "motive": ("csv", motive, 120, "Skel:"),
    "qualisys": ("tsv", qualisys, 100, ""),
    "workstation": ("csv", workstation, 100, ""),
}


@pytest.mark.parametrize("kind", FORMATS)
def test_positions_times_labels_and_gaps_are_those_of_the_export(tmp_path, kind):
    ending, write, rate, prefix = FORMATS[kind]
    recording = reading(tmp_path, write(), ending=ending)
    assert recording.labels == tuple(prefix + name for name in NAMES)
    # Each coordinate is rounded once when multiplied by 1e-3, as here.
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    np.testing.assert_allclose(recording.time, np.arange(4) / rate, rtol=1e-15)


@settings(max_examples=30, deadline=None)
@given(
    arrays(
        float,
        st.tuples(st.integers(1, 4), st.integers(1, 2), st.just(3)),
        elements=st.one_of(st.floats(1, 8000), st.floats(-8000, -1), st.just(np.nan)),
    )
)
def test_every_pattern_of_gaps_is_read_alike(tmp_path_factory, points):
    points[0, 0] = 1.0  # something is seen
    folder = tmp_path_factory.mktemp("gaps")
    expected = np.where(np.isnan(points).any(axis=2)[..., None], np.nan, points * 1e-3)
    for ending, write, _, _ in FORMATS.values():
        text = write(points, NAMES[: points.shape[1]])
        found = reading(folder, text, ending=ending)
        np.testing.assert_array_equal(found.markers, expected)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text + "\n \n\n",
        lambda text: text.rstrip("\n"),
    ],
    ids=["byte-order mark", "CRLF", "blank lines", "no last line end"],
)
def test_editors_and_systems_change_nothing(tmp_path, kind, change):
    ending, write, _, _ = FORMATS[kind]
    recording = reading(tmp_path, change(write()), ending=ending)
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


@pytest.mark.parametrize("kind", ["motive", "workstation"])
@pytest.mark.parametrize("separator", [";", "\t"])
def test_numbers_with_decimal_commas_are_read(tmp_path, kind, separator):
    ending, write, _, _ = FORMATS[kind]
    text = write().replace(",", separator).replace(".", ",")
    recording = reading(tmp_path, text, ending=ending)
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


# Motive.


@pytest.mark.parametrize("version", ["1.0", "1.23", "1.25"])
def test_versions_of_motive_differ_in_header_lines_only(tmp_path, version):
    recording = reading(tmp_path, motive(version=version), ending="csv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


@pytest.mark.parametrize(("unit", "meters"), [("Meters", 1.0), ("Centimeters", 0.01)])
def test_motive_states_its_unit(tmp_path, unit, meters):
    text = motive(POINTS * 1e-3 / meters, unit=unit)
    recording = reading(tmp_path, text, ending="csv")
    # Two roundings more than the expectation has.
    np.testing.assert_allclose(recording.markers, POINTS * 1e-3, rtol=1e-15)
    note = "states no Length Units, read as meters"
    text = motive(POINTS * 1e-3, unit="")
    recording = reading(tmp_path, text, note, ending="csv")
    np.testing.assert_allclose(recording.markers, POINTS * 1e-3, rtol=1e-15)


@pytest.mark.parametrize(
    "extra",
    [("Bone", "Skel:Hip", "0.7071"), (" ", "TimeCode", "15:26:46:12.02")],
    ids=["bone", "time code"],
)
def test_other_columns_of_motive_are_ignored(tmp_path, extra):
    recording = reading(tmp_path, motive(extra=extra), ending="csv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


def test_a_part_of_a_take_keeps_its_times(tmp_path):
    recording = reading(tmp_path, motive(first=240), ending="csv")
    np.testing.assert_allclose(recording.time, (240 + np.arange(4)) / 120, rtol=1e-15)


def test_markers_of_motive_without_a_name_are_dropped(tmp_path):
    names = ["RSHO", "Unlabeled 1023", "RWRA"]
    text = motive(names=names).replace("Skel:Unl", "Unl")
    recording = reading(tmp_path, text, ending="csv")
    assert recording.labels == ("Skel:RSHO", "Skel:RWRA")
    np.testing.assert_array_equal(recording.markers, POINTS[:, [0, 2]] * 1e-3)


def test_markers_that_a_solver_placed_are_a_last_resort(tmp_path):
    text = motive(kind="Bone Marker")
    recording = reading(tmp_path, text, "placed by a solver", ending="csv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    local = motive(kind="Bone Marker", more="Coordinate Space,Local")
    assert "Coordinate Space Global, found 'Local'" in refused(tmp_path, local, "csv")
    both = motive().split("\n")
    for i, line in enumerate(motive(POINTS + 50, kind="Bone Marker").split("\n")):
        if i > 1 and line:  # its columns beside the measured ones, of the same names
            both[i] += "," + line.split(",", 2)[2]
    recording = reading(tmp_path, "\n".join(both), ending="csv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (motive(kind="Rigid Body"), "columns of 'Rigid Body, Type'"),
        (motive(unit="Inches"), "found unit 'Inches'"),
        (motive().replace("Export", "Exp").replace("Capture", "C"), "Frame Rate in"),
        (motive().replace("120.000000", "fast"), "a number for Export Frame Rate"),
        (motive().replace("\n1,", "\n1,0.5,"), "columns as in its header, found 12"),
        ("\n".join(motive().split("\n")[:4]), "found 2 lines, so the file is cut off"),
    ],
)
def test_what_is_no_motive_export_of_markers_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path, text, "csv")


# Qualisys.


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("title", [True, False])
def test_frame_and_time_may_stand_before_the_positions(tmp_path, before, title):
    text = qualisys(before=before, title=title)
    recording = reading(tmp_path, text, ending="tsv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    np.testing.assert_allclose(recording.time, np.arange(4) / 100, rtol=1e-15)


@pytest.mark.parametrize(
    "word", ["NULL", "null", "NaN", "-1.#IND", "1.#QNAN0", "0.000"]
)
def test_a_word_for_what_was_not_seen_is_a_gap(tmp_path, word):
    text = qualisys(title=False).replace("\t\t\t\t", f"\t{word}\t{word}\t{word}\t")
    assert text.count(word) >= 3
    recording = reading(tmp_path, text, ending="tsv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


def test_events_of_qualisys_are_moments(tmp_path):
    event = "EVENT\tReach\t2\t0.01000\nEVENT\tReturn\t4\t0.03000\nMARKER_NAMES"
    text = qualisys().replace("MARKER_NAMES", event, 1)
    part = reading(tmp_path, text, ending="tsv", start="reach", end="0.02")
    np.testing.assert_allclose(part.time, [0.01, 0.02])
    with pytest.raises(
        FileError, match="one event 'Rest', found Reach at 0.010 s, Ret"
    ):
        reading(tmp_path, text, ending="tsv", start="Rest")


@pytest.mark.parametrize(
    ("text", "ending", "said", "rate"),
    [
        (
            qualisys(FREQUENCY=50),
            "tsv",
            "says 50 frames",
            100,
        ),
        (qualisys(FREQUENCY=50, before=False), "tsv", None, 50),
        (
            motive().replace("120.000000", "60.0"),
            "csv",
            "says 60 frames",
            120,
        ),
    ],
)
def test_times_count_where_a_header_has_another_rate(
    tmp_path, text, ending, said, rate
):
    notes = (said,) if said else ()
    recording = reading(tmp_path, text, *notes, ending=ending)
    assert recording.rate == pytest.approx(rate, rel=1e-3)


def test_counts_of_qualisys_that_are_wrong_are_told(tmp_path):
    text = qualisys(NO_OF_FRAMES=9, NO_OF_MARKERS=5)
    notes = ("says 5 markers, found 3 names", "says 9 frames, found 4")
    recording = reading(tmp_path, text, *notes, ending="tsv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("Frame\tTime\n1\t0\n", "starts with NO_OF_FRAMES, found 'Frame"),
        (qualisys(DATA_INCLUDED="6D"), "3D data with MARKER_NAMES, found '6D'"),
        (qualisys(MARKER_NAMES=""), "3D data with MARKER_NAMES, found 'NO_OF"),
        (qualisys(FREQUENCY="often"), "found nan"),
        (qualisys(MARKER_NAMES="A\tB", title=False), "6 or 8 columns for 2 markers"),
    ],
)
def test_what_is_no_qualisys_export_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path, text, "tsv")


# Vicon Workstation.


def test_other_sections_of_workstation_are_ignored(tmp_path):
    after = "\nANALOG\n1000,Hz\nSample #,Fx\n1,0.5\n2,0.25\n"
    text = workstation(after=after, first=21).replace("Title", "EVENTS\nSide,Time")
    recording = reading(tmp_path, text, ending="csv")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    np.testing.assert_allclose(recording.time, (20 + np.arange(4)) / 100, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("Title\n\nTRAJECTORIES\n100,Hz\n", "found 1 lines, so the file is cut off"),
        (workstation(rate="fast"), "found nan"),
        (workstation().replace("Field #", "Sample"), "'Field #' under the labels"),
        (workstation().replace(",RELB,,,", ",RELB,"), "followed by two empty cells"),
        (workstation().replace("X,Y,Z", "X,Z,Y", 1), "under marker 'RSHO', found"),
    ],
)
def test_what_is_no_workstation_file_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path, text, "csv")
