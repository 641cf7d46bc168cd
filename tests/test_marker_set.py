import numpy as np
import pytest

from ikns.body.marker_set import MarkerSet
from ikns.body.skeleton import Skeleton
from ikns.errors import FileError, MarkerMismatch
from ikns.recording.files import read


@pytest.mark.parametrize(
    ("name", "count", "static"),
    [
        ("oxford24", 24, 2),
        ("plug_in_gait", 19, 0),
        ("ue_adl", 45, 10),
        ("halpe26", 9, 0),
        ("body25", 9, 0),
        ("opencap", 13, 0),
    ],
)
def test_shipped_sets_fit_the_body(name, count, static):
    markers = MarkerSet.load(name)
    assert len(markers.markers) == count
    assert len(markers.markers) - len(markers.without_static().markers) == static
    skeleton = Skeleton.load(marker_set=name)
    positions = skeleton.markers_in_world(skeleton.neutral())
    assert not set(markers.held) - set(skeleton.joint_names)
    # The generic adult, arms hanging: every marker within a body's reach of the notch.
    assert np.abs(positions).max() < 0.8


ALL = ["oxford24", "plug_in_gait", "ue_adl", "halpe26", "body25", "opencap"]


@pytest.mark.parametrize("name", ALL)
def test_left_markers_mirror_the_right(name):
    by_label = {m.label: m for m in MarkerSet.load(name).markers}
    assert any(label[0] in "Rr" for label in by_label)
    for label, marker in by_label.items():
        if label[0] in "Rr" and "L" + label[1:] in by_label:
            twin = by_label["L" + label[1:]]
            assert twin.link == marker.link.replace("right", "left")
            mirrored = np.array(marker.position) * [1, 1, -1]
            np.testing.assert_array_equal(twin.position, mirrored)


def test_labels_resolve_with_prefix_case_and_alias():
    markers = MarkerSet.load("oxford24")
    columns = markers.columns(["Subject 1:RSHO", "ij", "lelb", "X"])
    found = {markers.labels[i]: c for i, c in enumerate(columns) if c >= 0}
    assert found == {"RSHO": 0, "CLAV": 1, "LELB": 2}


def test_two_subjects_in_one_file_are_refused():
    with pytest.raises(MarkerMismatch, match="A:RSHO, B:RSHO"):
        MarkerSet.load("oxford24").columns(["A:RSHO", "B:RSHO"])


@pytest.mark.parametrize(
    ("file", "name", "share"),
    [
        ("ue_adl/ADL001/ADL001_static.csv", "ue_adl", 1.0),
        ("stoop/neu_t169_f250f350.c3d", "plug_in_gait", 17 / 19),
        ("plugin_gait/Movement_trial.c3d", "plug_in_gait", 1.0),
    ],
)
def test_real_recordings_wear_the_set(data, file, name, share):
    markers = MarkerSet.load(name)
    found = markers.columns(read(data / file).labels) >= 0
    assert found.mean() == pytest.approx(share)


def test_picking_sorts_and_leaves_gaps_for_missing_markers():
    markers = MarkerSet.load("oxford24")
    positions = np.arange(12.0).reshape(2, 2, 3)
    picked = markers.pick(["T10", "C7"], positions)
    np.testing.assert_array_equal(picked[:, 0], positions[:, 1])
    np.testing.assert_array_equal(picked[:, 1], positions[:, 0])
    assert np.isnan(picked[:, 2:]).all()


@pytest.mark.parametrize("name", ALL)
def test_written_sets_read_back(name, tmp_path):
    markers = MarkerSet.load(name)
    markers.write(tmp_path / "worn.toml")
    again = MarkerSet.load(tmp_path / "worn.toml")
    assert again.labels == markers.labels
    assert again.held == markers.held
    for one, other in zip(again.markers, markers.markers, strict=True):
        assert (one.link, one.static_only, one.aliases, one.weight) == (
            other.link,
            other.static_only,
            other.aliases,
            other.weight,
        )
        # Meters to millimeters and back: one rounding each way.
        np.testing.assert_allclose(one.position, other.position, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("format = 2", "expected marker-set format 1, found 2"),
        ("format = 1\nname = 'a'", "markers"),
        (
            "format = 1\nname = 'a'\n[markers.X]\nlink = 'thorax'\n"
            "position_mm = [1, 2]\nplacement_sd_mm = 1",
            "3 numbers",
        ),
        ("format = ", "cannot be read as a marker set"),
    ],
)
def test_damaged_sets_are_refused_with_a_sentence(text, said, tmp_path):
    path = tmp_path / "odd.toml"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        MarkerSet.load(path)


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(FileError, match="halpe26, opencap, oxford24, plug_in_gait"):
        MarkerSet.load("helen_hayes")
