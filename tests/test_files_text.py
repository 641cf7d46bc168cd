"""TRC and Nexus CSV: read as printed, in meters; damage is told where it is."""

import csv
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ikns.errors import FileError
from ikns.recording.files import read

NAMES = ["ADL001:RSHO1", "RELB", "RFIN"]
POINTS = 1000 * np.random.default_rng(3).normal(size=(4, 3, 3)).round(3)


def cells(points, separator):
    return [
        separator.join("" if np.isnan(v) else repr(float(v)) for v in frame.ravel())
        for frame in points
    ]


def trc(points=POINTS, names=NAMES, *, first=1, start=0.0, rate=100.0, **changes):
    """Return a TRC file as Motion Analysis' software prints it."""
    n = len(points)
    header = {"DataRate": f"{rate:g}", "CameraRate": f"{rate:g}", "NumFrames": n}
    header |= {"NumMarkers": len(names), "Units": "mm"} | changes
    times = [f"{start + i / rate:.3f}" for i in range(n)]
    lines = ["PathFileType\t4\t(X/Y/Z)\ttrial.trc"]
    lines += ["\t".join(header), "\t".join(map(str, header.values()))]
    lines += ["Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t"]
    lines += [
        "\t\t" + "\t".join(f"{c}{i + 1}" for i in range(len(names)) for c in "XYZ")
    ]
    rows = zip(range(first, first + n), times, cells(points, "\t"), strict=True)
    lines += ["", *("\t".join(map(str, row)) for row in rows)]
    return "\n".join(lines) + "\n"


def nexus(points=POINTS, names=NAMES, *, first=1, rate="100", unit="mm"):
    """Return the trajectories of a Nexus export."""
    lines = ["Trajectories", rate, ",," + ",,,".join(names) + ",,"]
    lines += ["Frame,Sub Frame" + ",X,Y,Z" * len(names)]
    lines += ["," + f",{unit}" * 3 * len(names)]
    lines += [f"{first + i},0,{row}" for i, row in enumerate(cells(points, ","))]
    return "\n".join(lines) + "\n\n"


DEVICES = "Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,-0.5\n1,1,0.25\n\n"


def reading(path, text):
    path.write_text(text, newline="")
    return read(path)


def refused(path, text):
    with pytest.raises(FileError) as refusal:
        reading(path, text)
    assert str(refusal.value).startswith(f"{path}: ")
    assert "\n" not in str(refusal.value)
    return str(refusal.value)


FORMATS = pytest.mark.parametrize(
    ("ending", "write"), [("trc", trc), ("csv", nexus)], ids=["trc", "csv"]
)


@FORMATS
def test_positions_times_and_labels_are_the_printed_ones(tmp_path, ending, write):
    recording = reading(tmp_path / f"trial.{ending}", write())
    assert recording.labels == tuple(NAMES)
    # Each coordinate is rounded once when multiplied by 1e-3, as here.
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    np.testing.assert_allclose(recording.time, np.arange(4) / 100, rtol=1e-15)


@settings(max_examples=30, deadline=None)
@given(
    arrays(
        float,
        st.tuples(st.integers(1, 5), st.integers(1, 2), st.just(3)),
        elements=st.one_of(st.floats(1, 8000), st.floats(-8000, -1), st.just(np.nan)),
    )
)
def test_every_pattern_of_gaps_is_read_alike_from_both(tmp_path_factory, points):
    points[0, 0] = 1.0  # something is seen
    folder = tmp_path_factory.mktemp("gaps")
    expected = np.where(np.isnan(points).any(axis=2)[..., None], np.nan, points * 1e-3)
    for ending, write in [("trc", trc), ("csv", nexus)]:
        text = write(points, NAMES[: points.shape[1]])
        recording = reading(folder / f"trial.{ending}", text)
        np.testing.assert_array_equal(recording.markers, expected)


@FORMATS
@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text + "\n \n\n",
        lambda text: text.rstrip("\n"),
    ],
    ids=["byte-order mark", "CRLF", "CR", "blank lines", "no last line end"],
)
def test_editors_and_systems_change_nothing(tmp_path, ending, write, change):
    recording = reading(tmp_path / f"trial.{ending}", change(write()))
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


@FORMATS
def test_rows_may_end_early_or_in_empty_cells(tmp_path, ending, write):
    separator = "\t" if ending == "trc" else ","
    points = POINTS.copy()
    points[1:3, 2] = np.nan
    text = write(points)
    lines = [line.rstrip(separator) for line in text.split("\n")]
    lines[-3] += separator * 7
    recording = reading(tmp_path / f"trial.{ending}", "\n".join(lines))
    np.testing.assert_array_equal(recording.markers, points * 1e-3)


@FORMATS
def test_points_at_zero_are_gaps(tmp_path, ending, write):
    points = POINTS.copy()
    points[2, 1] = 0.0
    recording = reading(tmp_path / f"trial.{ending}", write(points))
    assert np.isnan(recording.markers[2, 1]).all()
    assert np.isnan(recording.markers).sum() == 3


@FORMATS
def test_trajectories_without_a_name_are_dropped(tmp_path, ending, write):
    text = write(names=["A", "*12", "C"])
    recording = reading(tmp_path / f"trial.{ending}", text)
    assert recording.labels == ("A", "C")
    np.testing.assert_array_equal(recording.markers, POINTS[:, [0, 2]] * 1e-3)


@FORMATS
@pytest.mark.parametrize(("unit", "meters"), [("m", 1.0), ("cm", 1e-2), ("MM", 1e-3)])
def test_positions_are_meters_whatever_the_unit(tmp_path, ending, write, unit, meters):
    key = {"Units": unit} if ending == "trc" else {"unit": unit}
    text = write(POINTS * 1e-3 / meters, **key)
    recording = reading(tmp_path / f"trial.{ending}", text)
    # Two roundings more than the expectation has.
    np.testing.assert_allclose(recording.markers, POINTS * 1e-3, rtol=1e-15)


@FORMATS
@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1e-3)])
def test_wrong_units_are_refused(tmp_path, ending, write, unit, factor):
    key = {"Units": unit} if ending == "trc" else {"unit": unit}
    text = write(POINTS * factor, **key)
    message = refused(tmp_path / f"trial.{ending}", text)
    assert f"probably not {unit}." in message


@FORMATS
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda text, _: text.replace("mm", "inch"), "found unit 'inch'"),
        (lambda text, _: text.replace("100", "nan"), "found nan"),
        (lambda text, _: text.replace("100", "-100"), "found -100"),
        (lambda text, sep: text.replace(f"3{sep}0", f"x{sep}0"), "found 'x'"),
        (lambda text, sep: text.replace(f"\n3{sep}0", f"\n1{sep}0"), "increase"),
        (lambda text, sep: text.replace(f"\n3{sep}0", f"\n3{sep}0{sep}7"), "columns"),
    ],
    ids=["unit", "nan rate", "rate", "text", "order", "columns"],
)
def test_damage_is_refused_with_the_reason(tmp_path, ending, write, change, complaint):
    separator = "\t" if ending == "trc" else ","
    text = change(write(), separator)
    message = refused(tmp_path / f"trial.{ending}", text)
    assert complaint in message


@FORMATS
def test_empty_recordings_are_refused(tmp_path, ending, write):
    path = tmp_path / f"trial.{ending}"
    assert "at least one frame, found none" in refused(path, write(POINTS[:0]))
    assert "3 markers is seen in any of its 4" in refused(path, write(POINTS * np.nan))
    assert "at least one named marker" in refused(path, write(names=["*1", "*2", "*3"]))
    infinite = np.where(POINTS > 500, np.inf, POINTS)
    assert "found infinity" in refused(path, write(infinite))


def test_real_nexus_values_are_those_printed(data):
    path = data / "ue_adl" / "ADL005" / "ADL005FR1.csv"
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = [row for row in csv.reader(file) if row]
    printed = [[float(cell or "nan") for cell in row[2:149]] for row in rows[5:]]
    markers = np.array(printed).reshape(-1, 49, 3) * 1e-3
    recording = read(path)
    np.testing.assert_array_equal(recording.markers, markers)
    assert recording.labels == tuple(rows[2][2::3][:49])


@pytest.mark.parametrize(
    "text",
    [
        DEVICES + nexus(),
        nexus() + DEVICES,
        nexus().rstrip("\n") + "\n" + DEVICES,
        DEVICES.replace("\n", ",,\n") + nexus().replace("\n", ",,,\n") + DEVICES,
    ],
    ids=["before", "after", "after without a blank line", "trailing commas"],
)
def test_other_sections_of_nexus_are_ignored(tmp_path, text):
    recording = reading(tmp_path / "trial.csv", text)
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


def test_a_nexus_frame_of_which_only_the_number_is_left_is_no_title(tmp_path):
    text = re.sub(r"\n2,0,.*\n", "\n2\n", nexus())
    assert text != nexus()
    expected = POINTS * 1e-3
    expected[1] = np.nan
    recording = reading(tmp_path / "trial.csv", text)
    np.testing.assert_array_equal(recording.markers, expected)


def test_nexus_time_is_the_frame_number_over_the_rate(tmp_path):
    recording = reading(tmp_path / "trial.csv", nexus(first=695, rate="120,,"))
    expected = (694 + np.arange(4)) / 120
    np.testing.assert_allclose(recording.time, expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            DEVICES,
            "or one of Vicon Workstation or OptiTrack Motive, found a file that starts "
            "with 'Devices'",
        ),
        ("Trajectories\n100\n,,A\n", "found 2 lines, so the file is cut off"),
        (nexus().replace("Sub Frame", "Time"), "expected the columns 'Frame'"),
        (nexus().replace("X,Y,Z", "RX,RY,RZ", 1), "under marker 'ADL001:RSHO1'"),
        (nexus().replace("mm", "deg", 1), "one unit for all trajectories"),
    ],
)
def test_what_is_no_nexus_section_of_markers_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path / "trial.csv", text)


def test_trc_times_are_freed_from_their_few_digits(tmp_path):
    # 1/120 s printed with three digits is off by up to 0.5 ms, 6 % of a step.
    recording = reading(tmp_path / "trial.trc", trc(start=2.5, rate=120.0))
    np.testing.assert_allclose(recording.time, 2.5 + np.arange(4) / 120, rtol=1e-15)


def test_trc_times_that_are_not_at_the_rate_are_kept(tmp_path):
    text = trc().replace("\t0.020\t", "\t0.520\t").replace("\t0.030\t", "\t0.530\t")
    np.testing.assert_array_equal(
        reading(tmp_path / "trial.trc", text).time, [0, 0.01, 0.52, 0.53]
    )


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("one\ntwo\n", "whose first word is PathFileType, found 'one'"),
        ("\n".join(trc().split("\n")[:3]), "expected 5 header lines, found 3"),
        (trc(NumFrames="many"), "expected a number for NumFrames, found 'many'"),
        (trc().replace("Units", "Unit"), "expected Units in line 2"),
        (trc().replace("RELB\t\t", "RELB\tRWRA\t"), "above its X"),
    ],
)
def test_what_is_no_trc_file_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path / "trial.trc", text)
