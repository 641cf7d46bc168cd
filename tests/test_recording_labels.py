import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import FileError, InvalidInput
from ikns.recording.labels import name_pairs, read_name_pairs, renamed, unused_names
from ikns.recording.low_pass import low_pass
from ikns.recording.recording import Recording

names = st.text("ABCDab12 ", min_size=1, max_size=4).map(str.strip).filter(bool)


def recording(labels, frames=1):
    places = np.arange(3.0 * len(labels) * frames).reshape(frames, len(labels), 3)
    return Recording(np.arange(frames) / 100, places, labels)


@given(
    st.lists(names, min_size=1, max_size=8, unique_by=str.casefold),
    st.data(),
)
def test_names_that_are_permuted_come_back(labels, data):
    turned = data.draw(st.permutations(labels))
    there = dict(zip(labels, turned, strict=True))
    back = {new: old for old, new in there.items()}
    found = renamed(recording(labels), there)
    assert found.labels == tuple(turned)
    assert renamed(found, back).labels == tuple(labels)
    np.testing.assert_array_equal(found.markers, recording(labels).markers)


def test_a_subject_stays_before_the_label_and_case_does_not_matter():
    found = renamed(recording(["Ann:RELBL", "C7"]), {"relbl": "RELB", "c7": "CV7"})
    assert found.labels == ("Ann:RELB", "CV7")
    assert renamed(recording(["Ann:X", "Bob:X"]), {"Ann:X": "C7"}).labels == (
        "C7",
        "Bob:X",
    )


def test_two_markers_of_one_name_are_refused():
    with pytest.raises(InvalidInput, match="one marker to become relb, found X and re"):
        renamed(recording(["X", "relb"]), {"X": "RELB"})


def test_names_that_no_marker_has_are_found():
    assert unused_names(["Ann:RELB", "C7"], {"relb": "a", "C7": "b", "C8": "c"}) == [
        "C8"
    ]


@pytest.mark.parametrize("text", ["", "A", "=B", "A=", "A=B=C"])
def test_what_is_no_pair_is_refused(text):
    with pytest.raises(InvalidInput, match="--rename: expected OLD=NEW"):
        name_pairs([text], where="--rename")


def test_a_file_of_names(tmp_path):
    path = tmp_path / "lab.txt"
    path.write_text("# our labels\nElbow lat = RELB\n\nRELBM=RMEP # medial\n")
    assert read_name_pairs(path) == {"Elbow lat": "RELB", "RELBM": "RMEP"}
    path.write_text("A=B\nA=C\n")
    with pytest.raises(FileError, match=r"lab\.txt: expected one new name for A"):
        read_name_pairs(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileError, match=r"lab\.txt: cannot be read"):
        read_name_pairs(path)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 12.0])
def test_the_filter_has_the_gain_of_a_doubled_butterworth(frequency):
    rate, cutoff = 100.0, 5.0
    time = np.arange(2000) / rate
    wave = np.sin(2 * np.pi * frequency * time)
    moving = Recording(time, np.tile(wave[:, None, None], (1, 1, 3)), ["W"])
    found = low_pass(moving, cutoff).markers[500:1500, 0, 0]
    # Analog prototype of order 2, run twice, half the power at the cut-off; the digital
    # filter bends frequencies by tan(pi f / rate).
    bent = np.tan(np.pi * frequency / rate) / np.tan(
        np.pi * cutoff / (np.sqrt(2) - 1) ** 0.25 / rate
    )
    gain = 1 / (1 + bent**4)
    # In phase: the same wave, smaller. The transient has died after 500 frames.
    np.testing.assert_allclose(found, gain * wave[500:1500], atol=1e-6)


def test_gaps_stay_and_are_not_filtered_across():
    rng = np.random.default_rng(0)
    markers = rng.normal(size=(60, 2, 3))
    markers[20:23, 0] = np.nan
    markers[40, 0] = np.nan  # between two stretches, of 17 and 19 frames
    markers[5:, 1] = np.nan
    found = low_pass(Recording(np.arange(60) / 60, markers, ["A", "B"]), 6.0).markers
    np.testing.assert_array_equal(np.isnan(found), np.isnan(markers))
    shifted = np.array(markers)
    shifted[:20, 0] += 1000
    moved = low_pass(Recording(np.arange(60) / 60, shifted, ["A", "B"]), 6.0).markers
    # What lies before the gap has no say after it; a constant passes (rounding of 1e3).
    np.testing.assert_array_equal(moved[20:], found[20:])
    np.testing.assert_allclose(moved[:20, 0] - 1000, found[:20, 0], atol=1e-10)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.nan, 50.0, 45.0])
def test_a_cutoff_that_the_rate_does_not_allow_is_refused(cutoff):
    with pytest.raises(InvalidInput, match="--cutoff must be above 0 and below"):
        low_pass(recording(["A"], frames=20), cutoff)


def test_one_frame_has_no_rate_to_filter_at():
    with pytest.raises(InvalidInput, match="nan frames per second"):
        low_pass(recording(["A"]), 5.0)
