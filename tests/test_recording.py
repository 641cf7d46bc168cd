"""Recordings hold what they were given, whole and frozen, or are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import IknsError, InvalidInput, MarkerMismatch
from ikns.recording.recording import Recording

TIME = np.array([0.0, 0.01, 0.02, 0.03])
MARKERS = np.arange(4 * 2 * 3, dtype=float).reshape(4, 2, 3)
LABELS = ("RSHO", "RELB")


def test_arrays_are_copies_that_cannot_be_changed():
    time, markers = TIME.copy(), MARKERS.copy()
    recording = Recording(time, markers, LABELS)
    time[0], markers[0] = 9.0, 9.0
    np.testing.assert_array_equal(recording.time, TIME)
    np.testing.assert_array_equal(recording.markers, MARKERS)
    with pytest.raises(ValueError, match="read-only"):
        recording.markers[0] = 0.0


def test_gaps_are_kept_as_nan():
    markers = MARKERS.copy()
    markers[1, 0] = np.nan
    np.testing.assert_array_equal(Recording(TIME, markers, LABELS).markers, markers)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"labels": ("RSHO",)}, r"expected time \(T,\) and markers \(T, 1, 3\)"),
        ({"time": TIME[:3]}, r"found \(3,\) and \(4, 2, 3\)"),
        ({"time": 0.0}, r"found \(\) and"),
        ({"labels": ("RSHO", "RSHO")}, "found RSHO more than once"),
        ({"time": [0, 0.01, 0.01, 0.02]}, "frame 3 is at 0.01 s after 0.01 s"),
        ({"time": [0, 0.01, np.nan, 0.02]}, "not finite"),
        ({"markers": np.full((4, 2, 3), np.inf)}, "found infinity"),
    ],
)
def test_what_is_no_recording_is_refused(change, complaint):
    given = {"time": TIME, "markers": MARKERS, "labels": LABELS, "source": "trial"}
    with pytest.raises(InvalidInput, match=complaint) as refusal:
        Recording(**(given | change))
    assert str(refusal.value).startswith("trial: ")
    assert isinstance(refusal.value, IknsError)


@given(st.permutations(range(5)))
def test_selecting_orders_markers_as_asked(order):
    names = [f"M{i}" for i in range(5)]
    markers = np.random.default_rng(0).normal(size=(4, 5, 3))
    recording = Recording(TIME, markers, names)
    chosen = recording.select([names[i] for i in order])
    assert chosen.labels == tuple(names[i] for i in order)
    np.testing.assert_array_equal(chosen.markers, markers[:, order])


def test_selecting_a_marker_that_is_not_there_says_which_and_what_there_is():
    with pytest.raises(MarkerMismatch, match="RFIN, found only RSHO, RELB"):
        Recording(TIME, MARKERS, LABELS).select(["RSHO", "RFIN"])


def test_rate_counts_the_steps_between_frames():
    # (T - 1) / (last - first) in doubles: a few roundings of 1e-16 each.
    assert Recording(TIME, MARKERS, LABELS).rate == pytest.approx(100, rel=1e-12)


def test_one_frame_has_no_rate():
    assert np.isnan(Recording(TIME[:1], MARKERS[:1], LABELS).rate)


def test_recordings_can_be_compared_and_hashed():
    first, second = (Recording(TIME, MARKERS, LABELS) for _ in range(2))
    assert first == first
    assert first != second
    assert len({first, second}) == 2
