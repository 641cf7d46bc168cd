"""XDF: what LabRecorder keeps of a marker stream, written here byte by byte.

The layout is that of the XDF specification 1.0 (https://github.com/sccn/xdf/wiki).
"""

import struct
import sys
import warnings
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_files_repaired import refused

from ikns.errors import FileError, IknsError, RecordingWarning
from ikns.recording.files import read

NAMES = ["RSHO", "RELB", "RWRA"]
#: m, each a single, as most streams send them.
POINTS = np.random.default_rng(2).normal(size=(6, 3, 3)).astype(np.float32)
POINTS[2, 1] = np.nan
RATE = 100.0


def chunk(tag, content):
    """One chunk: how many bytes its length has, the length, a tag, the content."""
    return struct.pack("<BIH", 4, 2 + len(content), tag) + content


def described(names=NAMES, unit="meters"):
    channels = "".join(
        f"<channel><label>{name}_{axis}</label><marker>{name}</marker>"
        f"<type>Position{axis}</type><unit>{unit}</unit></channel>"
        for name in names
        for axis in "XYZ"
    )
    return f"<desc><channels>{channels}</channels></desc>"


def stream(
    points=POINTS,
    *,
    number=1,
    name="lab",
    kind="MoCap",
    desc=None,
    start=5000.0,
    offset=0,
):
    """The chunks of one stream; only the first sample has a time stamp."""
    flat = points.reshape(len(points), 3 * points.shape[1]).astype("<f4")
    info = (
        f"<?xml version='1.0'?><info><name>{name}</name><type>{kind}</type>"
        f"<channel_count>{flat.shape[1]}</channel_count><channel_format>float32"
        f"</channel_format><nominal_srate>{RATE}</nominal_srate>"
        f"{described() if desc is None else desc}</info>"
    )
    one = struct.pack("<I", number)
    samples = struct.pack("<BI", 4, len(flat))
    for i, row in enumerate(flat):
        stamp = struct.pack("<Bd", 8, start) if i == 0 else b"\0"
        samples += stamp + row.tobytes()
    clock = [struct.pack("<dd", start + second, offset) for second in (0, 5)]
    foot = f"<?xml version='1.0'?><info><sample_count>{len(flat)}</sample_count></info>"
    return (
        chunk(2, one + info.encode())
        + chunk(3, one + samples)
        + b"".join(chunk(4, one + each) for each in clock)
        + chunk(6, one + foot.encode())
    )


def xdf(*streams):
    head = "<?xml version='1.0'?><info><version>1.0</version></info>"
    return b"XDF:" + chunk(1, head.encode()) + b"".join(streams)


EEG = stream(
    np.ones((6, 1, 3), np.float32),
    number=7,
    name="cap",
    kind="EEG",
    desc="<desc><channels><channel><label>Cz</label></channel><channel/></channels>"
    "</desc>",
)


def reading(tmp_path, content, **options):
    path = tmp_path / "trial.xdf"
    path.write_bytes(content)
    return read(path, **options)


@pytest.mark.parametrize("kind", ["MoCap", "Mocap", "whatever"])
def test_markers_are_those_that_were_sent(tmp_path, kind):
    recording = reading(tmp_path, xdf(EEG, stream(kind=kind)))
    assert recording.labels == tuple(NAMES)
    np.testing.assert_array_equal(recording.markers, POINTS.astype(float))
    # The time stamps are 5000 s and more, of which 1e-12 s is the last digit.
    np.testing.assert_allclose(recording.time, np.arange(6) / RATE, atol=1e-10)


def test_the_clock_of_the_sender_leaves_no_trace(tmp_path):
    recording = reading(tmp_path, xdf(stream(offset=-3000.0)))
    np.testing.assert_allclose(recording.time, np.arange(6) / RATE, atol=1e-10)


@pytest.mark.parametrize(("unit", "meters"), [("mm", 1e-3), ("centimetres", 1e-2)])
def test_positions_are_in_the_unit_of_the_stream(tmp_path, unit, meters):
    sent = (POINTS / meters).astype(np.float32)
    recording = reading(tmp_path, xdf(stream(sent, desc=described(unit=unit))))
    np.testing.assert_allclose(recording.markers, sent.astype(float) * meters)


def test_of_several_streams_with_markers_one_is_to_be_chosen(tmp_path):
    both = xdf(stream(name="ann"), stream(POINTS + 1, number=2, name="bob"))
    path = tmp_path / "trial.xdf"
    path.write_bytes(both)
    with pytest.raises(FileError, match="found 2: 'ann', 'bob'; choose one with --st"):
        read(path)
    np.testing.assert_array_equal(read(path, stream="bob").markers, POINTS + 1.0)
    with pytest.raises(FileError, match="a stream named 'eve', found 'ann' of type"):
        read(path, stream="eve")
    with pytest.raises(FileError, match="only XDF files have streams"):
        read(path.with_suffix(".trc"), stream="bob")


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"no XDF file", "cannot be read as an XDF file"),
        (xdf(), "expected a stream with markers, found none"),
        (xdf(EEG), "expected a stream with markers, found 'cap' of type 'EEG'"),
        (xdf(stream(desc="")), "stream 'lab': expected channels of type PositionX"),
        (xdf(stream(desc=described(unit=""))), "'lab': expected a unit of mm, cm or m"),
        (xdf(stream(POINTS * np.nan)), "none of its 3 markers is seen"),
        (xdf(stream(POINTS[:, :2])), "a time and 9 values for every sample"),
        (xdf(stream(POINTS[:0])), "at least one frame, found none"),
    ],
)
def test_what_has_no_markers_is_refused(tmp_path, content, complaint):
    path = tmp_path / "trial.xdf"
    path.write_bytes(content)
    with pytest.raises(FileError) as refusal:
        read(path)
    assert complaint in str(refusal.value)


def test_a_file_cut_at_any_byte_survives(tmp_path):
    whole = xdf(stream(POINTS[:2, :1], desc=described(["A"])))
    path = tmp_path / "cut.xdf"
    for end in range(1, len(whole), 3):
        path.write_bytes(whole[:end])
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            with suppress(IknsError):
                read(path)
        assert all(issubclass(each.category, RecordingWarning) for each in told)


@settings(max_examples=60, deadline=None)
@given(changes=st.lists(st.tuples(st.integers(0), st.integers(0, 255)), min_size=1))
def test_flipped_bytes_survive(tmp_path_factory, changes):
    content = bytearray(xdf(stream(POINTS[:2, :1], desc=described(["A"]))))
    for place, byte in changes:
        content[place % len(content)] = byte
    path = tmp_path_factory.mktemp("flipped") / "flipped.xdf"
    path.write_bytes(content)
    with warnings.catch_warnings(record=True), suppress(IknsError):
        warnings.simplefilter("always", RecordingWarning)
        assert read(path).markers.shape[1:] == (1, 3)


def test_without_pyxdf_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyxdf", None)
    path = tmp_path / "trial.xdf"
    path.write_bytes(xdf(stream()))
    with pytest.raises(
        FileError, match=r"needs pyxdf; install it with pip install 'ik"
    ):
        read(path)


def test_an_empty_file_is_refused_before_the_library_is_asked(tmp_path):
    assert ": this file is empty." in refused(tmp_path, "", "xdf")
