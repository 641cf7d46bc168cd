"""Files of laboratories that are not quite by the book: read, and what was odd told.

All numbers are invented; the kinds are those of public files.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.body.marker_set import Marker, MarkerSet
from ikns.errors import FileError, MarkerMismatch, RecordingWarning
from ikns.recording.files import read

NAMES = ["RSHO", "RELB", "RWRA"]
KEYS = (
    "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame "
    "OrigNumFrames"
).split()
#: mm, each with the three decimals that are printed.
POINTS = (1000 + 300 * np.random.default_rng(5).normal(size=(4, 3, 3))).round(3)
LABELS = "Frame#\tTime\t" + "\t\t\t".join(NAMES) + "\t\t"
AXES = "\t\t" + "\t".join(f"{axis}{i}" for i in (1, 2, 3) for axis in "XYZ")


def rows(points=POINTS, rate=100.0, extra=""):
    return [
        "\t".join([str(i + 1), f"{i / rate:.3f}", *(f"{v:.3f}" for v in p.ravel())])
        + extra
        for i, p in enumerate(points)
    ]


def trc(*, labels=LABELS, axes=(AXES, ""), body=None, values=None, first=None):
    values = values or "100.00\t100.00\t4\t3\tmm\t100.00\t1\t4"
    head = [first or "PathFileType\t4\t(X/Y/Z)\tx.trc", "\t".join(KEYS), values, labels]
    return "\n".join([*head, *axes, *(rows() if body is None else body)]) + "\n"


def reading(tmp_path, text, *notes, ending="trc", **options):
    """Read a file that must give exactly these notes, told by a part of each."""
    path = tmp_path / f"trial.{ending}"
    path.write_text(text, newline="")
    if not notes:
        return read(path, **options)
    with pytest.warns(RecordingWarning) as told:
        recording = read(path, **options)
    said = [str(warning.message) for warning in told]
    assert len(said) == len(notes) == len(recording.notes)
    for note, sentence in zip(notes, said, strict=True):
        assert note in sentence
        assert sentence.startswith(f"{path}: ")
        assert sentence.endswith(".")
    return recording


def refused(tmp_path, text, ending="trc"):
    path = tmp_path / f"trial.{ending}"
    path.write_text(text, newline="")
    with pytest.raises(FileError) as refusal:
        read(path)
    assert str(refusal.value).startswith(f"{path}: ")
    return str(refusal.value)


ORDER = "taken in order"
SIMPLE = {
    "padded header": (
        trc(
            values="  100.0\t\t  100.0\t\t      4\t\t  3\t\t mm\t  100.0\t   1\t   4",
            first="PathFileType  4\t(X/Y/Z) D:\\capture\\",
        ),
        [],
    ),
    "values glued by blanks": (trc(values="100\t100\t4\t3\tmm   100.0  1\t4"), []),
    "labels without gaps": (trc(labels="Frame#\tTime\t" + "\t".join(NAMES)), [ORDER]),
    "no cell above frame and time": (trc(labels="\t\t\t".join(NAMES)), [ORDER]),
    "a tab missing after time": (
        trc(labels=LABELS.replace("Time\t", "Time ")),
        [ORDER],
    ),
    "a blank before labels": (trc(labels=LABELS.replace("\t", "\t ")), []),
    "labels that an editor aligned": (
        trc(labels=LABELS.replace("RSHO\t\t\t", "RSHO           ")),
        [ORDER],
    ),
    "labels above Z": (trc(labels="Frame#\tTime\t\t\t" + LABELS[12:]), [ORDER]),
    "labels above every column": (
        trc(labels="Frame#\tTime\t" + "\t".join(n for n in NAMES for _ in "XYZ")),
        [],
    ),
    "a label per coordinate": (
        trc(
            labels="Frame#\tTime\t"
            + "\t".join(f"{n}_{a}" for n in NAMES for a in "xyz")
        ),
        [],
    ),
    "empty counts and rate": (
        trc(values="\t100\t\t\tmm\t100\t1\t4"),
        ["0 frames per second, its times 100"],
    ),
    "a blank line before the labels": (trc(labels="\n" + LABELS), []),
    "time with its unit": (trc(labels=LABELS.replace("Time", "Time (sec)")), []),
    "no line of axes": (trc(axes=()), []),
    "no blank line": (trc(axes=(AXES,)), []),
    "wrong NumFrames": (
        trc(values="100\t100\t900\t3\tmm\t100\t1\t900"),
        ["says 900 frames, found 4"],
    ),
    "wrong NumMarkers": (
        trc(values="100\t100\t4\t7\tmm\t100\t1\t4"),
        ["says 7 markers, found 3 labels"],
    ),
    "rate 0": (
        trc(values="0\t0\t4\t3\tmm\t0\t1\t4"),
        ["0 frames per second, its times 100"],
    ),
    "unlabeled columns": (
        trc(body=rows(extra="\t7.000\t8.000\t9.000")),
        ["3 of its columns have no label"],
    ),
    "counted unlabeled columns": (
        trc(body=rows(extra="\t7\t8\t9"), values="100\t100\t4\t4\tmm\t100\t1\t4"),
        ["3 of its columns have no label"],
    ),
    "blanks for tabs": (trc().replace("\t", "  "), [ORDER]),
    "blanks for tabs in the rows": (
        trc(body=[row.replace("\t", " ") for row in rows()]),
        [],
    ),
    "decimal commas": (
        trc(
            body=[row.replace(".", ",") for row in rows()],
            values="100,00\t100,00\t4\t3\tmm\t100,00\t1\t4",
        ),
        [],
    ),
    "commas for tabs": (trc().replace("\t", ","), ["separated by commas"]),
    "no frame numbers": (
        trc(body=["\t" + row.partition("\t")[2] for row in rows()]),
        ["frames have no numbers"],
    ),
}


@pytest.mark.parametrize("kind", SIMPLE)
def test_what_a_trc_file_means_beyond_doubt_is_read(tmp_path, kind):
    text, notes = SIMPLE[kind]
    recording = reading(tmp_path, text, *notes)
    assert recording.labels == tuple(NAMES)
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    # One rounding of the division, and one of a sum.
    np.testing.assert_allclose(recording.time, np.arange(4) / 100, atol=1e-15)


def test_a_rate_that_is_not_that_of_the_times_is_told(tmp_path):
    text = trc(body=rows(rate=50.0))
    recording = reading(tmp_path, text, "says 100 frames per second, its times 50")
    np.testing.assert_allclose(recording.time, np.arange(4) / 50, atol=1e-15)


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    # Half of the last number is a number too.
    text = trc()[:-5]
    text = text.replace("100.00\t4\t3", "100.00\t9\t3")
    recording = reading(tmp_path, text, "9 frames, found 4, so the file was cut off")
    np.testing.assert_array_equal(recording.markers, POINTS[:3] * 1e-3)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        # Which column the labels name cannot be known.
        (trc(labels="Frame#\tTime\tA\tB"), "found 2 labels for 3 markers"),
        # With blanks between the columns a gap leaves no trace.
        (
            trc(body=[rows()[0].replace("\t", " "), "2 0.010 1.0 2.0 3.0"]),
            "an unseen marker cannot be recognized",
        ),
        (trc(body=[*rows()[:3], rows()[3].replace("\t", " ", 1)]), "found '4 0.030'"),
        (
            trc(labels="Frame#\tTime\t" + "\t".join("abcdefghi")),
            "labels of X, Y and Z of one marker next to each other",
        ),
        (
            trc(
                values="0\t0\t4\t3\tmm\t0\t1\t4",
                body=[row.replace("\t0.0", "\t\t0.0")[:2] for row in rows()],
            ),
            "found a rate of 0 and no times",
        ),
        (trc(first="PathFileType\t4\t(X/Y)\tx.trc"), "found one of X and Y only"),
        # A decimal comma beside decimal points may as well group thousands.
        (trc(body=[rows()[0].replace(".", ",", 3), *rows()[1:]]), "found '"),
    ],
    ids=[
        "few labels",
        "gap",
        "one blank",
        "nine names",
        "no time",
        "flat",
        "both commas",
    ],
)
def test_what_a_trc_file_leaves_open_is_refused(tmp_path, text, complaint):
    assert complaint in refused(tmp_path, text)


def test_frame_and_time_that_a_blank_separates_in_all_rows_are_two(tmp_path):
    text = trc(body=[row.replace("\t", " ", 1) for row in rows()])
    np.testing.assert_array_equal(reading(tmp_path, text).markers, POINTS * 1e-3)


@settings(max_examples=40, deadline=None)
@given(
    widths=st.lists(st.integers(1, 4), min_size=8, max_size=8),
    gap=st.sampled_from(["\t", "\t\t", " \t ", "   ", "\t  \t"]),
)
def test_a_header_may_be_padded_anyhow(tmp_path_factory, widths, gap):
    values = ["100", "100", "4", "3", "mm", "100", "1", "4"]
    padded = gap.join(" " * w + v for w, v in zip(widths, values, strict=True))
    recording = reading(tmp_path_factory.mktemp("padded"), trc(values=padded))
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)


# A label that stands twice.

NEXUS_HEAD = (
    "Trajectories\n100\n,,{}\nFrame,Sub Frame" + ",X,Y,Z" * 3 + "\n" + ",mm" * 9
)


def doubled(tmp_path, ending, points, names, *notes):
    if ending == "trc":
        body, labels = rows(points), "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t"
        text = trc(labels=labels, body=body)
    else:
        flat = (",".join(f"{v:.3f}" for v in p.ravel()) for p in points)
        lines = (f"{i + 1},0,{row}" for i, row in enumerate(flat))
        head = NEXUS_HEAD.format(",,,".join(names))
        text = head.replace("\n,mm", "\n,,mm") + "\n" + "\n".join(lines) + "\n"
    return reading(tmp_path, text, *notes, ending=ending)


@pytest.mark.parametrize("ending", ["trc", "csv"])
def test_markers_of_one_name_are_numbered_and_only_they_are_refused(tmp_path, ending):
    note = "2 markers are named S:RKNE, read as S:RKNE #1, S:RKNE #2"
    names = ["S:RKNE", "S:RELB", "S:RKNE"]
    recording = doubled(tmp_path, ending, POINTS, names, note)
    assert recording.labels == ("S:RKNE #1", "S:RELB", "S:RKNE #2")
    np.testing.assert_array_equal(recording.markers, POINTS * 1e-3)
    worn = MarkerSet.load("oxford24").only(["RELB"])
    assert worn.columns(recording.labels).tolist() == [1]
    knee = MarkerSet("knee", (Marker("RKNE", "thorax", (0, 0, 0), (1, 1, 1)),))
    with pytest.raises(MarkerMismatch, match="RKNE must match one label, found S:RKNE"):
        knee.columns(recording.labels)
    meant = replace(knee, markers=(replace(knee.markers[0], label="RKNE #2"),))
    assert meant.columns(recording.labels).tolist() == [2]


@pytest.mark.parametrize("ending", ["trc", "csv"])
def test_the_same_marker_twice_is_one_marker(tmp_path, ending):
    points = POINTS.copy()
    points[:, 2] = points[:, 0]
    names = ["RKNE", "RELB", "RKNE"]
    for third in (points[:, 0], 0.0):
        points[:, 2] = third
        note = "RKNE appears 2 times, identical or unseen"
        recording = doubled(tmp_path, ending, points, names, note)
        assert recording.labels == ("RKNE", "RELB")
        np.testing.assert_array_equal(recording.markers, points[:, :2] * 1e-3)


def test_a_number_that_a_label_has_already_is_not_given_again(tmp_path):
    names = ["RKNE", "RKNE #1", "RKNE"]
    note = "read as RKNE #2, RKNE #3"
    assert doubled(tmp_path, "trc", POINTS, names, note).labels == (
        "RKNE #2",
        "RKNE #1",
        "RKNE #3",
    )


def test_two_subjects_in_a_file_are_named():
    worn = MarkerSet.load("oxford24")
    with pytest.raises(MarkerMismatch, match=r"--subject-prefix \(Ann, Bob\)\.$"):
        worn.columns(["Ann:RSHO", "Bob:RSHO"])
