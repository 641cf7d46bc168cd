"""A part of a recording: one subject, some seconds, or from event to event."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_files_c3d import c3d_bytes, parameter

from ikns.errors import FileError, InvalidInput, MarkerMismatch
from ikns.recording.files import read
from ikns.recording.files.file_events import read_c3d_events
from ikns.recording.part import between, one_subject
from ikns.recording.recording import Recording

PLACES = np.random.default_rng(4).normal(size=(5, 4, 3))
TWO = Recording(
    np.arange(5) / 10,
    PLACES,
    ["Ann:RSHO", "ANN:RELB", "Anna:RSHO", "C7"],
    notes=["a note."],
)


@pytest.mark.parametrize("prefix", ["Ann", "ann", "Ann:", "ANN_"])
def test_one_subject_is_hers_and_without_the_name(prefix):
    found = one_subject(TWO, prefix)
    assert found.labels == ("RSHO", "RELB")
    np.testing.assert_array_equal(found.markers, PLACES[:, :2])
    assert found.notes == TWO.notes


def test_a_subject_may_be_joined_by_a_low_line():
    labels = ["Bob_RSHO", "Bob_RELB", "Bobby_RSHO", "Bob_"]
    found = one_subject(Recording(TWO.time, PLACES, labels), "bob")
    assert found.labels == ("RSHO", "RELB")


@pytest.mark.parametrize("prefix", ["Eve", "", ":", "An"])
def test_a_subject_who_is_not_there_is_refused_with_those_who_are(prefix):
    with pytest.raises(MarkerMismatch, match="found those of Ann, ANN, Anna"):
        one_subject(TWO, prefix)


@given(st.integers(0, 99), st.integers(0, 99))
def test_a_part_has_the_frames_between_two_of_them(first, last):
    whole = Recording(np.arange(100) / 30, np.ones((100, 1, 3)), ["A"])
    start, end = first / 30, last / 30
    if last < first:
        with pytest.raises(InvalidInput, match="give an earlier start"):
            between(whole, start, end)
        return
    # Moments as somebody reads them off a table, with six digits.
    for digits in (15, 6):
        part = between(whole, round(start, digits), round(end, digits))
        np.testing.assert_array_equal(part.time, whole.time[first : last + 1])


def events_bytes(names, contexts, pairs):
    """A C3D file with a group EVENT, made by hand."""
    content = c3d_bytes(LABELS=["A", "B", "C"])
    section = struct.pack("bb", 5, -2) + b"EVENT" + struct.pack("<HB", 3, 0)
    section += parameter("LABELS", 2, names) + parameter("CONTEXTS", 2, contexts)
    body = struct.pack("bb2B", 4, 2, 2, len(pairs))
    body += b"".join(struct.pack("<2f", *pair) for pair in pairs)
    section += struct.pack("bb", 5, 2) + b"TIMES"
    section += struct.pack("<H", len(body) + 3) + body + b"\0"
    # The last parameter, DATA_START, ends in two zeros of its own.
    end = 512 + len(content[512:1536].rstrip(b"\0")) + 2
    return content[:end] + section + content[end + len(section) :]


@pytest.fixture
def trial(tmp_path):
    """Frames at 0, 0.02, ... 0.08 s, and four events."""
    path = tmp_path / "trial.c3d"
    path.write_bytes(
        events_bytes(
            ["Foot Strike", "Foot Off", "Foot Strike", "Event"],
            ["Right", "Right", "Left", "General"],
            [(0, 0.06), (0, 0.04), (0, 0.02), (1, 0.5)],
        )
    )
    return path


def test_events_are_minutes_and_seconds_by_time(trial):
    found = read_c3d_events(trial)
    assert [event.name for event in found] == [
        "Foot Strike",
        "Foot Off",
        "Foot Strike",
        "Event",
    ]
    assert [event.context for event in found] == ["Left", "Right", "Right", "General"]
    # Single precision.
    np.testing.assert_allclose(
        [e.time for e in found], [0.02, 0.04, 0.06, 60.5], rtol=1e-7
    )


def test_a_trial_is_cut_at_events_by_name_and_at_seconds(trial):
    part = read(trial, start="left foot strike", end="Foot Off")
    np.testing.assert_allclose(part.time, [0.02, 0.04])
    part = read(trial, start="0.03", end="Right Foot Strike")
    np.testing.assert_allclose(part.time, [0.04, 0.06])
    np.testing.assert_allclose(read(trial, end=0.02).time, [0.0, 0.02])


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        (
            "Foot Strike",
            "found Left Foot Strike at 0.020 s, Right Foot Strike at 0.060",
        ),
        ("Jump", "one event 'Jump', found Left Foot Strike at 0.020 s"),
        ("nan", "a finite number of seconds, found nan"),
    ],
)
def test_an_event_that_is_not_one_is_refused(trial, name, complaint):
    with pytest.raises(FileError, match=complaint):
        read(trial, start=name)


def test_files_without_events_take_seconds(trial, tmp_path):
    path = tmp_path / "none.c3d"
    path.write_bytes(c3d_bytes())
    with pytest.raises(FileError, match="one event 'Jump', found none"):
        read(path, start="Jump")
    path.write_bytes(events_bytes(["A", "B"], ["", ""], [(0, 1)]))
    with pytest.raises(FileError, match="seconds for 2 events, found 2 numbers"):
        read(path, start="A")


def test_part_and_subject_together(tmp_path):
    path = tmp_path / "two.c3d"
    path.write_bytes(c3d_bytes(LABELS=["Ann:A", "Bob:A", "Ann:B"]))
    part = read(path, subject_prefix="Ann", start=0.02, end=0.04)
    assert part.labels == ("A", "B")
    assert part.markers.shape == (2, 2, 3)


@pytest.mark.parametrize(
    ("start", "end", "says"),
    [
        (30.0, None, "--from 30 s is past its end; it runs from 1 to 2 s."),
        (None, 0.5, "--to 0.5 s is before its start; it runs from 1 to 2 s."),
        (1.2, 1.3, "it has no frame from 1.2 to 1.3 s; it runs from 1 to 2 s."),
    ],
)
def test_a_part_without_frames_says_how_long_the_recording_is(start, end, says):
    whole = Recording([1.0, 1.5, 2.0], np.ones((3, 1, 3)), ["RSHO"], "walk.c3d")
    with pytest.raises(InvalidInput) as refused:
        between(whole, start, end)
    assert str(refused.value) == f"walk.c3d: {says}"
