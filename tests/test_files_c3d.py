"""C3D: read as ezc3d reads it, in meters; written whole or not at all."""

import errno
import os
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ikns.errors import FileError, InvalidInput, RecordingWarning
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording

# It has no build for Linux on ARM; what is read by it is read there by nothing.
ezc3d = pytest.importorskip("ezc3d")

#: Half a step of single precision.
SINGLE = 2.0**-24

POINTS = 1000 * np.random.default_rng(7).normal(size=(5, 3, 3)).round(3)
NAMES = ["RSHO", "RELB", "RFIN"]


def parameter(name, group, value, order="<", number="f"):
    """Return one parameter record of a C3D file, byte by byte as the format says."""
    if isinstance(value, list):
        width = max(map(len, value), default=0)
        text = "".join(word.ljust(width) for word in value).encode()
        body = struct.pack("bb2B", -1, 2, width, len(value)) + text
    else:
        body = struct.pack(f"{order}bb{number}", 4 if number == "f" else 2, 0, value)
    head = struct.pack("bb", len(name), group) + name.encode()
    return head + struct.pack(f"{order}H", len(body) + 3) + body + b"\0"


def c3d_bytes(points=POINTS, labels=NAMES, *, machine=84, integer=False, **changes):
    """Return a small C3D file made by hand, residual -1 where x is NaN.

    ``changes`` replace or add parameters of the POINT group.
    """
    order = ">" if machine == 86 else "<"
    n_frames, n_points, _ = points.shape
    scale = 0.25 if integer else -0.1

    def real(values):
        values = np.asarray(values, dtype=f"{order}f4")
        if machine != 85:
            return values.tobytes()
        # DEC: an exponent larger by 2, and the two words swapped.
        words = (values * 4).astype("<f4").view("<u2").reshape(-1, 2)
        return words[:, ::-1].tobytes()

    values = {"RATE": 50.0, "UNITS": ["mm"], "LABELS": labels, "SCALE": scale}
    values |= {"USED": n_points, "FRAMES": n_frames, "DATA_START": 4} | changes
    section = b"\1\x50\2" + bytes([machine])
    section += struct.pack("bb", 5, -1) + b"POINT" + struct.pack(f"{order}HB", 3, 0)
    for name, value in values.items():
        if value is None:
            continue
        if isinstance(value, float) and machine == 85:
            record = parameter(name, 1, value)
            section += record.replace(struct.pack("<f", value), real([value]))
        else:
            number = "h" if isinstance(value, int) else "f"
            section += parameter(name, 1, value, order, number)
    header = struct.pack(f"{order}BB5H", 2, 0x50, n_points, 0, 1, n_frames, 10)
    header += real([scale]) + struct.pack(f"{order}2H", 4, 0) + real([50.0])
    seen = ~np.isnan(points[..., :1])
    stored = np.concatenate([np.where(seen, points, 0), np.where(seen, 0, -1)], axis=2)
    if integer:
        stored[..., :3] /= scale
        data = stored.round().astype(f"{order}i2").tobytes()
    else:
        data = real(stored)
    return header.ljust(512, b"\0") + section.ljust(1024, b"\0") + data


def refused(path, content=None):
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FileError) as refusal:
        read(path)
    assert str(refusal.value).startswith(f"{path}: ")
    return str(refusal.value)


def by_ezc3d(path):
    """Return labels and positions (T, M, 3) in the file's unit as ezc3d reads them."""
    file = ezc3d.c3d(str(path))
    points = file["data"]["points"][:3].transpose(2, 1, 0).copy()
    points[file["data"]["meta_points"]["residuals"][0].T < 0] = np.nan
    point = file["parameters"]["POINT"]
    return [label.strip() for label in point["LABELS"]["value"]], points, file


@pytest.mark.parametrize(
    "name",
    [
        "box_lift/markers_analogs.c3d",
        "plugin_gait/Movement_trial.c3d",
        "shoulder_kinova/example.c3d",
        "stoop/neu_t169_f250f350.c3d",
        "stoop/stoop1_t169_f620f800.c3d",
    ],
)
def test_real_recordings_hold_what_ezc3d_finds(data, name):
    recording = read(data / name)
    labels, points, file = by_ezc3d(data / name)
    columns = [labels.index(label) for label in recording.labels]
    # The same singles, times 1e-3 in doubles: equal.
    np.testing.assert_array_equal(recording.markers, points[:, columns] * 1e-3)
    first = file["header"]["points"]["first_frame"] / recording.rate
    assert recording.time[0] == pytest.approx(first, rel=1e-12)


@pytest.mark.parametrize("integer", [False, True])
@pytest.mark.parametrize("machine", [84, 85, 86])
def test_all_machines_and_number_formats_mean_the_same(tmp_path, machine, integer):
    points = POINTS.copy()
    points[1, 2] = np.nan
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes(points, machine=machine, integer=integer))
    recording = read(path)
    assert recording.labels == tuple(NAMES)
    assert recording.rate == pytest.approx(50, rel=1e-12)
    # Integers count quarters of a mm; singles of 4 m are exact to 2.4e-4 mm.
    allowed = 0.125e-3 if integer else 4 * SINGLE
    np.testing.assert_allclose(recording.markers, points * 1e-3, rtol=0, atol=allowed)
    if machine != 86:  # which ezc3d does not read
        np.testing.assert_allclose(
            recording.markers, by_ezc3d(path)[1] * 1e-3, rtol=1e-6
        )


@pytest.mark.parametrize(
    ("unit", "meters"), [("mm", 1e-3), ("CM ", 1e-2), ("m", 1.0), (None, 1e-3)]
)
def test_positions_are_meters_whatever_the_unit(tmp_path, unit, meters):
    path = tmp_path / "trial.c3d"
    points = POINTS * 1e-3 / meters
    path.write_bytes(c3d_bytes(points, UNITS=[unit] if unit else None))
    np.testing.assert_allclose(read(path).markers, POINTS * 1e-3, rtol=4 * SINGLE)


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1e-3), (None, 1e-3)])
def test_wrong_units_are_refused(tmp_path, unit, factor):
    content = c3d_bytes(POINTS * factor, UNITS=[unit] if unit else None)
    message = refused(tmp_path / "trial.c3d", content)
    assert f"is probably not {unit or 'mm'}" in message


def test_what_is_no_position_is_dropped_and_virtual_positions_stay(tmp_path):
    labels = ["S:RSHO", "S:RElbowAngles", "*12", "RKneeForce", "CentreOfMass", ""]
    path = tmp_path / "trial.c3d"
    lists = {
        "ANGLES": ["RElbowAngles"],
        "FORCES": ["x"],
        "FORCES2": ["RKneeForce"],
        "MODELED_MARKERS": ["CentreOfMass"],
    }
    points = np.concatenate([POINTS, POINTS + 1], axis=1)
    path.write_bytes(c3d_bytes(points, labels, **lists))
    recording = read(path)
    assert recording.labels == ("S:RSHO", "CentreOfMass")
    np.testing.assert_allclose(
        recording.markers, points[:, [0, 4]] * 1e-3, rtol=4 * SINGLE
    )


def test_labels_go_on_in_further_lists_and_beyond_the_points(tmp_path):
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes(labels=["A ", "B"], LABELS2=["C"], LABELS3=["D", "E"]))
    assert read(path).labels == ("A", "B", "C")


def test_points_without_a_label_are_dropped(tmp_path):
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes(labels=["A", "B"]))
    assert read(path).labels == ("A", "B")


def test_a_second_frame_rate_in_a_file_is_noted(tmp_path):
    path = tmp_path / "trial.c3d"
    content = bytearray(c3d_bytes())
    path.write_bytes(content)
    assert not read(path).notes
    struct.pack_into("<f", content, 20, 100.0)  # words 11 and 12 of the header
    path.write_bytes(content)
    with pytest.warns(RecordingWarning, match="header says 100 .*RATE 50, which"):
        recording = read(path)
    assert recording.rate == pytest.approx(50.0)


def test_labels_that_are_not_utf8_are_read_as_latin1(tmp_path):
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes().replace(b"RELB", "Épi1".encode("latin-1")))
    assert read(path).labels == ("RSHO", "Épi1", "RFIN")


def test_points_at_zero_and_nan_are_gaps(tmp_path):
    points = POINTS.copy()
    points[0, 0] = 0
    content = bytearray(c3d_bytes(points))
    struct.pack_into("<f", content, 1536 + 16, np.nan)
    path = tmp_path / "trial.c3d"
    path.write_bytes(content)
    gaps = np.isnan(read(path).markers)
    assert gaps[0, :2].all()
    assert gaps.sum() == 6


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"garbage that is not C3D", "this is not a C3D file"),
        (c3d_bytes()[:300], "expected at least"),
        (c3d_bytes()[:1000], "expected at least 1536 bytes"),
        (c3d_bytes()[:-1], "expected 5 frames of 48 bytes as its header says, found 4"),
        (c3d_bytes(RATE=float("nan")), "found nan"),
        (c3d_bytes(RATE=-50.0), "found -50"),
        (c3d_bytes(UNITS=["inch"]), "expected positions in mm, cm or m, found unit"),
        (c3d_bytes(FRAMES=0), "at least one frame, found none"),
        (c3d_bytes(USED=2), "found 3 and 2"),
        (c3d_bytes(SCALE=0.1), "found -0.1 and 0.1"),
        (c3d_bytes(labels=["*1", "*2", "*3"]), "found 3 points that are unnamed"),
        (c3d_bytes(labels=["A", "B", "C\x07"]), "printable"),
        (c3d_bytes(POINTS * np.nan), "none of its 3 markers is seen"),
        (c3d_bytes(np.where(POINTS > 500, np.inf, POINTS)), "found infinity"),
        (c3d_bytes().replace(b"\2\x50\3", b"\2\x50\4", 1), "found 4 and 3"),
        (c3d_bytes(machine=87), "found 87"),
    ],
)
def test_damaged_files_are_refused_with_the_reason(tmp_path, content, complaint):
    assert complaint in refused(tmp_path / "trial.c3d", content)


def recordings():
    """Return recordings of one to three markers, 0.1 to 8 m from zero, with gaps."""
    shapes = st.tuples(st.integers(2, 6), st.integers(1, 2), st.just(3))
    positions = st.one_of(st.floats(0.1, 8), st.floats(-8, -0.1), st.just(np.nan))
    return st.tuples(
        shapes.flatmap(lambda shape: arrays(float, shape, elements=positions)),
        st.integers(0, 10**6),
        st.sampled_from([30.0, 50.0, 59.94, 100.0, 240.0, 1000 / 3]),
    )


@settings(max_examples=40, deadline=None)
@given(recordings())
def test_what_is_written_is_read_again(tmp_path_factory, drawn):
    markers, first, rate = drawn
    markers[0, 0] = 1.0  # something is seen
    time = (first + np.arange(len(markers))) / rate
    labels = ["S1:A b", "É"][: markers.shape[1]]
    path = tmp_path_factory.mktemp("c3d") / "trial.c3d"
    write_c3d(path, Recording(time, markers, labels))
    again = read(path)
    assert again.labels == tuple(labels)
    # Positions and rate are singles; the change to mm and back rounds in doubles.
    gap = np.isnan(markers).any(axis=2, keepdims=True)
    expected = np.where(gap, np.nan, markers)
    np.testing.assert_allclose(again.markers, expected, rtol=1.001 * SINGLE)
    np.testing.assert_allclose(again.time, time, rtol=1.001 * SINGLE)


@pytest.mark.parametrize("n_markers", [255, 256, 600])
def test_long_label_lists_survive(tmp_path, n_markers):
    markers = np.random.default_rng(0).normal(size=(3, n_markers, 3))
    labels = [f"{i}".rjust(100, "x") for i in range(n_markers)]
    write_c3d(tmp_path / "many.c3d", Recording([0, 1, 2], markers, labels))
    assert read(tmp_path / "many.c3d").labels == tuple(labels)


@pytest.mark.parametrize("n_markers", [1, 255, 256, 700])
@pytest.mark.parametrize("first", [1, 51, 65_534, 70_000])
def test_ezc3d_reads_what_is_written(tmp_path, n_markers, first):
    rng = np.random.default_rng(n_markers)
    markers = rng.normal(size=(4, n_markers, 3))
    hidden = rng.random(markers.shape[:2]) < 0.3
    markers[hidden] = np.nan
    labels = [f"M{i:0{1 + i % 9}d}é" for i in range(n_markers)]
    time = (first - 1 + np.arange(4)) / 120
    path = tmp_path / "trial.c3d"
    write_c3d(path, Recording(time, markers, labels))
    found, points, file = by_ezc3d(path)
    point = file["parameters"]["POINT"]
    for part in range(2, 2 + (n_markers - 1) // 255):  # 255 texts in one parameter
        found += [label.strip() for label in point[f"LABELS{part}"]["value"]]
    assert found == labels
    # Half a step of single precision, after the rounding of meters to mm in double.
    np.testing.assert_allclose(points, markers * 1e3, rtol=1.001 * SINGLE)
    assert point["RATE"]["value"] == pytest.approx([120], rel=SINGLE)
    assert point["UNITS"]["value"] == ["mm"]
    assert len(point["DESCRIPTIONS"]["value"]) == min(n_markers, 255)
    trial = file["parameters"]["TRIAL"]
    low, high = trial["ACTUAL_START_FIELD"]["value"]
    assert low % 65536 + 65536 * high == first
    again = read(path)
    assert again.labels == tuple(labels)
    np.testing.assert_array_equal(np.isnan(again.markers).all(2), hidden)
    np.testing.assert_allclose(again.time, time, rtol=2 * SINGLE)


def test_more_frames_than_a_word_counts_survive(tmp_path):
    time = np.arange(70_000) / 240
    markers = np.random.default_rng(0).normal(size=(70_000, 1, 3))
    write_c3d(tmp_path / "long.c3d", Recording(time, markers, ["A"]))
    again = read(tmp_path / "long.c3d")
    np.testing.assert_allclose(again.time, time, rtol=SINGLE)
    np.testing.assert_allclose(again.markers, markers, rtol=1.001 * SINGLE)


@pytest.mark.parametrize(
    ("n_points", "n_frames"),
    # The last frames end with a block of 512 bytes, and 16 bytes short of that.
    [(1, 65_600), (1, 65_599), (3, 65_568)],
)
def test_padding_at_the_end_of_a_long_file_is_no_frame(tmp_path, n_points, n_frames):
    # ezc3d says 65535 frames, the largest number, and pads the last block.
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    labels = [f"M{i}" for i in range(n_points)]
    file["parameters"]["POINT"]["LABELS"]["value"] = labels
    points = np.ones((4, n_points, n_frames))
    points[:3] = np.linspace(1, 500, n_frames) * np.arange(1, n_points + 1)[:, None]
    file["data"]["points"] = points
    path = tmp_path / "long.c3d"
    file.write(str(path))
    recording = read(path)
    assert recording.markers.shape == (n_frames, n_points, 3)
    assert not np.isnan(recording.markers).any()
    # Singles of millimeters.
    expected = points[:3].transpose(2, 1, 0) * 1e-3
    np.testing.assert_allclose(recording.markers, expected, rtol=SINGLE * 2)


@pytest.mark.parametrize("unit", ["mete", "mill", "cent", "(mm)", "Metr"])
def test_a_unit_that_was_cut_off_is_the_only_one_that_begins_so(tmp_path, unit):
    meters = {"mete": 1, "mill": 1e-3, "cent": 1e-2, "(mm)": 1e-3, "Metr": 1}[unit]
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes(POINTS * 1e-3 / meters, UNITS=[unit]))
    markers = read(path).markers
    np.testing.assert_allclose(markers, POINTS * 1e-3, rtol=SINGLE * 2)


@pytest.mark.parametrize("count", [{"FRAMES": 5.0}, {"FRAMES": -1, "LONG_FRAMES": 5.0}])
def test_frame_counts_are_read_in_every_form(tmp_path, count):
    path = tmp_path / "trial.c3d"
    path.write_bytes(c3d_bytes(**count))
    assert len(read(path).time) == 5


def test_nothing_is_overwritten_without_force(tmp_path):
    path = tmp_path / "trial.c3d"
    path.write_text("precious")
    recording = Recording([0, 0.1], POINTS[:2] / 1000, NAMES)
    with pytest.raises(FileError, match="exists already"):
        write_c3d(path, recording)
    assert path.read_text() == "precious"
    write_c3d(path, recording, force=True)
    assert read(path).labels == tuple(NAMES)


def test_a_failure_half_way_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    path = tmp_path / "trial.c3d"
    path.write_text("precious")

    whole = Path.write_bytes

    def torn(self, content):
        whole(self, content[:-200])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", torn)
    with pytest.raises(FileError, match="cannot be written"):
        write_c3d(path, Recording([0, 0.1], POINTS[:2] / 1000, NAMES), force=True)
    assert path.read_text() == "precious"
    assert [entry.name for entry in tmp_path.iterdir()] == ["trial.c3d"]


@pytest.mark.parametrize(
    ("time", "labels", "complaint"),
    [
        ([0, 1, 2, 3, 4, 6], ["A"], "constant frame rate"),
        (np.linspace(1, 2, 100) ** 2 - 1, ["A"], "constant frame rate"),
        ([0.0], ["A"], "has 1 frame; at least 2 are needed"),
        ([-1, -0.5], ["A"], "expected to start between 0 and"),
        ([1e9, 1e9 + 0.01], ["A"], "expected to start between 0 and"),
        ([0, 1], [" A"], "without blanks"),
        ([0, 1], [""], "1 to 120 bytes"),
        ([0, 1], ["A" * 121], "1 to 120 bytes"),
        ([0, 1], [], "1 to 1000 markers"),
    ],
)
def test_what_c3d_cannot_hold_is_refused(tmp_path, time, labels, complaint):
    recording = Recording(time, np.ones((len(time), len(labels), 3)), labels, "live")
    with pytest.raises(InvalidInput, match=complaint):
        write_c3d(tmp_path / "trial.c3d", recording)
    assert not list(tmp_path.iterdir())


def test_positions_beyond_single_precision_are_refused(tmp_path):
    far = Recording([0, 1], np.full((2, 1, 3), 1e36), ["A"], "live")
    with pytest.raises(InvalidInput, match="single precision"):
        write_c3d(tmp_path / "trial.c3d", far)


@pytest.mark.parametrize("name", ["trial.trc", "nowhere/trial.c3d"])
def test_targets_that_cannot_be_are_refused(tmp_path, name):
    with pytest.raises(FileError, match="expected a|does not exist"):
        write_c3d(tmp_path / name, Recording([0, 0.1], POINTS[:2] / 1000, NAMES))
