"""A subject folder holds the whole subject as plain text, or says what is wrong."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import small_person
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ikns.calibration.subject import Subject
from ikns.calibration.subject_files import FILES
from ikns.calibration.subject_tables import read_readout, write_readout
from ikns.errors import FileError, IknsError, InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.readout import Readout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("subjects") / "person"
    small_person.subject().save(made)
    return made


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_a_loaded_subject_gives_the_same_control_signal(folder: Path) -> None:
    made, loaded = small_person.subject(), Subject.load(folder)
    motion = made.motions[0]
    x, q = motion.task_position(made.chain), motion.chain_angles(made.chain)
    # JSON prints floats so that they read back as the same bits.
    np.testing.assert_array_equal(
        loaded.null_space_map.control_signal(q, x),
        made.null_space_map.control_signal(q, x),
    )
    np.testing.assert_array_equal(
        loaded.null_space_map.inside(x), made.null_space_map.inside(x)
    )
    assert loaded.null_space_map.radius_ == made.null_space_map.radius_


def test_a_loaded_subject_wears_the_same_markers_on_the_same_body(folder: Path) -> None:
    made, loaded = small_person.subject(), Subject.load(folder)
    q = made.motions[0].q[0]
    # Millimeters in the file: two roundings of 1e-16 of a meter's place.
    np.testing.assert_allclose(
        loaded.skeleton.markers_in_world(q),
        made.skeleton.markers_in_world(q),
        rtol=0,
        atol=1e-14,
    )
    assert loaded.skeleton.marker_set.held == made.skeleton.marker_set.held
    assert loaded.chain == made.chain
    assert loaded.report == json.loads(json.dumps(made.report))


def test_saving_what_was_loaded_changes_nothing(folder: Path, tmp_path: Path) -> None:
    Subject.load(folder).save(tmp_path / "again")
    first, again = contents(folder), contents(tmp_path / "again")
    for name in set(FILES) - {"markers.toml", "samples.csv"}:
        assert again[name] == first[name]
    assert sorted(again) == sorted(FILES)


@pytest.mark.parametrize("interpolation", ["natural", "laplace", "nearest"])
def test_the_interpolation_of_the_map_is_kept(
    tmp_path: Path, interpolation: str
) -> None:
    made = small_person.subject()
    learned = made.null_space_map
    other = NullSpaceMap.from_arrays(
        learned.centers_,
        learned.directions_,
        learned.lower_,
        learned.upper_,
        counts=learned.counts_,
        interpolation=interpolation,
    )
    other.radius_ = learned.radius_
    dataclasses.replace(made, null_space_map=other).save(tmp_path / "person")
    loaded = Subject.load(tmp_path / "person").null_space_map
    assert loaded.interpolation == interpolation
    x = learned.centers_.mean(axis=0)
    np.testing.assert_array_equal(
        loaded.interpolator_.weights(x), other.interpolator_.weights(x)
    )


def test_a_folder_that_does_not_name_the_interpolation_has_natural_neighbors(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder, tmp_path / "older")
    path = tmp_path / "older" / "map.json"
    table = json.loads(path.read_text())
    assert table.pop("interpolation") == "natural"
    path.write_text(json.dumps(table))
    loaded = Subject.load(tmp_path / "older").null_space_map
    whole = Subject.load(folder).null_space_map
    x = whole.centers_.mean(axis=0)
    assert loaded.interpolation == "natural"
    np.testing.assert_array_equal(
        loaded.interpolator_.weights(x), whole.interpolator_.weights(x)
    )


def test_still_samples_stay_within_a_twentieth_of_a_millimeter(folder: Path) -> None:
    made, loaded = small_person.subject().samples, Subject.load(folder).samples
    assert made is not None
    assert loaded is not None
    # Half of the last digit in the file, and the rounding of the comparison.
    np.testing.assert_allclose(loaded[:, :3], made[:, :3], rtol=0, atol=0.5e-4 + 1e-12)
    np.testing.assert_array_equal(loaded[:, 3], made[:, 3])


def test_a_folder_without_samples_opens_and_stays_without(
    folder: Path, tmp_path: Path
) -> None:
    shutil.copytree(folder, tmp_path / "older")
    (tmp_path / "older" / "samples.csv").unlink()
    loaded = Subject.load(tmp_path / "older")
    assert loaded.samples is None
    loaded.save(tmp_path / "again")
    assert sorted(contents(tmp_path / "again")) == sorted(set(FILES) - {"samples.csv"})


@pytest.mark.parametrize(
    "row",
    ["0,0,0", "0,0,0,1,2", "0,0,nan,1", "0,0,0,1.5", "0,0,0,-1", "0,0,0,99", "a,b,c,d"],
)
def test_samples_that_make_no_sense_are_refused(
    folder: Path, tmp_path: Path, row: str
) -> None:
    shutil.copytree(folder, tmp_path / "person")
    path = tmp_path / "person" / "samples.csv"
    path.write_text(f"{path.read_text()}{row}\n")
    with pytest.raises(FileError, match=r"samples.csv: .* the file can be deleted"):
        Subject.load(tmp_path / "person")
    path.write_text(f"x_m,y_m,z_m,point\n{row}\n")
    with pytest.raises(FileError, match=r"samples.csv: .* the file can be deleted"):
        Subject.load(tmp_path / "person")


def test_all_files_are_text(folder: Path) -> None:
    for path in folder.iterdir():
        assert path.read_text(encoding="utf-8").replace("\n", "").isprintable()


def test_a_folder_is_only_replaced_by_force(tmp_path: Path) -> None:
    made = small_person.subject()
    made.save(tmp_path / "person")
    before = contents(tmp_path)
    with pytest.raises(InvalidInput, match="--force"):
        made.save(tmp_path / "person")
    assert contents(tmp_path) == before
    dataclasses.replace(made, report={"new": True}).save(
        tmp_path / "person", force=True
    )
    assert Subject.load(tmp_path / "person").report == {"new": True}
    assert [path.name for path in tmp_path.iterdir()] == ["person"]


def test_a_map_made_from_arrays_is_saved_and_opens(tmp_path: Path) -> None:
    learned = small_person.subject().null_space_map
    made = NullSpaceMap.from_arrays(
        learned.centers_, learned.directions_, learned.lower_, learned.upper_
    )
    subject = dataclasses.replace(small_person.subject(), null_space_map=made)
    subject.save(tmp_path / "person")
    opened = Subject.load(tmp_path / "person").null_space_map
    assert opened.radius_ is None
    np.testing.assert_array_equal(opened.directions_, made.directions_)


def test_force_never_deletes_what_is_not_a_subject(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InvalidInput, match="thesis"):
        small_person.subject().save(tmp_path, force=True)
    assert contents(tmp_path) == {"thesis.tex": b"years of work"}


def test_a_failed_save_leaves_the_earlier_folder(tmp_path: Path) -> None:
    made = small_person.subject()
    made.save(tmp_path / "person")
    before = contents(tmp_path)
    broken = dataclasses.replace(made, report={"not JSON": float("nan")})
    with pytest.raises(ValueError, match="not JSON compliant"):
        broken.save(tmp_path / "person", force=True)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", FILES[:4])
def test_a_missing_file_is_named(folder: Path, tmp_path: Path, name: str) -> None:
    shutil.copytree(folder, tmp_path / "person")
    (tmp_path / "person" / name).unlink()
    with pytest.raises(FileError, match=name):
        Subject.load(tmp_path / "person")


def test_what_an_earlier_version_would_misread_it_refuses(
    folder: Path, tmp_path: Path
) -> None:
    table = json.loads((folder / "intent.json").read_text())
    assert len(table["natural_posture"]["coefficients_rad"]) == 13
    assert table["format"] == 4
    # Maps of before, which have no leash; of the wrist alone: with places remembered,
    # and without.
    natural = table["natural_posture"]
    assert Readout.from_table(table).map.leash == table.pop("leash_m") > 0
    for version, heights in ((3, natural["heights_rad"]),
                             (2, natural["heights_rad"]), (1, [])):  # fmt: skip
        for name in ("coefficients_rad", "people_rad"):
            natural[name] = natural[name][: 13 if version == 3 else 10]
        natural["heights_rad"] = heights
        natural["places_m"] = natural["places_m"][: len(heights)]
        before = Readout.from_table(table)
        assert before.map.leash == 0
        write_readout(tmp_path / "intent.json", before)
        assert json.loads((tmp_path / "intent.json").read_text())["format"] == version
        again = read_readout(tmp_path / "intent.json", "intent", "right_arm")
        assert again.table() == before.table()
    for name in ("map.json", "calibration.json", "proximal.json"):
        assert json.loads((folder / name).read_text())["format"] == 1


@pytest.mark.parametrize(
    "name", ["map.json", "calibration.json", "proximal.json", "intent.json"]
)
@pytest.mark.parametrize("version", [0, 5, "1", None])
def test_an_unknown_version_is_refused(
    folder: Path, tmp_path: Path, name: str, version: object
) -> None:
    shutil.copytree(folder, tmp_path / "person")
    path = tmp_path / "person" / name
    path.write_text(json.dumps(json.loads(path.read_text()) | {"format": version}))
    with pytest.raises(FileError, match=f"{name}: expected format version 1"):
        Subject.load(tmp_path / "person")


@pytest.mark.parametrize(
    "change",
    [
        {"chain": "third_arm"},
        {"chain": "left_arm"},
        {"chain": None},
        {"joints": ["elbow"]},
        {"joints": None},
        {"points": []},
        {"points": [{}]},
        {"points": 3},
        {"outside": "sideways"},
        {"interpolation": "cubic"},
        {"interpolation": None},
        {"radius_m": "wide"},
    ],
)
def test_a_map_that_makes_no_sense_is_refused(
    folder: Path, tmp_path: Path, change: dict[str, object]
) -> None:
    shutil.copytree(folder, tmp_path / "person")
    path = tmp_path / "person" / "map.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(FileError, match="map.json"):
        Subject.load(tmp_path / "person")


@pytest.mark.parametrize("name", FILES)
@settings(
    max_examples=15,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(where=st.floats(0, 1), rubbish=st.binary(max_size=8))
def test_damage_is_refused_in_one_sentence_or_is_harmless(
    folder: Path, tmp_path: Path, name: str, where: float, rubbish: bytes
) -> None:
    shutil.rmtree(tmp_path / "person", ignore_errors=True)
    shutil.copytree(folder, tmp_path / "person")
    whole = (folder / name).read_bytes()
    start = int(where * (len(whole) - 1))
    (tmp_path / "person" / name).write_bytes(whole[:start] + rubbish)
    fault = None
    try:
        Subject.load(tmp_path / "person")
    except IknsError as error:
        fault = str(error)
    assert fault is None or str(tmp_path) in fault


def test_a_loaded_subject_knows_its_postures(folder: Path) -> None:
    loaded = Subject.load(folder).null_space_map
    fitted = small_person.subject().null_space_map
    np.testing.assert_array_equal(loaded.cluster_means_, fitted.cluster_means_)


def test_a_folder_without_postures_still_opens(folder: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    shutil.copytree(folder, old)
    table = json.loads((old / "map.json").read_text())
    for point in table["points"]:
        del point["mean_rad"]
    (old / "map.json").write_text(json.dumps(table))
    assert not hasattr(Subject.load(old).null_space_map, "cluster_means_")
