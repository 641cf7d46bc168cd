"""The study file: what it declares, what it refuses, what may change later."""

import tomllib
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from ikns.errors import FileError, InvalidInput
from ikns.experiments.study import (
    Parameters,
    PickingDesign,
    TrackingDesign,
    check_declaration,
    init_study,
    read_study,
    save_declaration,
    study_from_table,
)
from ikns.experiments.study.design import LAYOUTS
from ikns.experiments.study.people import recalibrated, study_participant
from ikns.experiments.visits import create_visit, list_visits
from ikns.simulation.operator import Participant

SMALL: dict[str, Any] = {
    "study": {"name": "small"},
    "cohort": {"participants": 2},
    "tracking": {"margin": 1.0},
}


def changed(**tables: dict | None) -> dict[str, Any]:
    """The small study with keys of tables changed; None leaves a table out."""
    table = {
        name: dict(SMALL.get(name, {})) | (new or {}) for name, new in tables.items()
    }
    found = SMALL | table
    return {k: v for k, v in found.items() if k not in tables or tables[k] is not None}


# --- the example that ships ----------------------------------------------------------


def test_the_example_is_the_paper_s_two_experiments(tmp_path: Path) -> None:
    study = read_study(init_study(tmp_path / "study"))
    assert (study.participants, study.simulated, study.variations) == (10, True, {})
    steps = [
        [s for k in range(10) for s in d.steps(k, seed=study.seed) if s.kind == "trial"]
        for d in (study.tracking, study.picking)
        if d is not None
    ]
    # 10 people x 2 conditions x (3 profiles x 3, or 11 objects).
    assert [len(trials) for trials in steps] == [180, 220]


def test_what_the_example_leaves_out_has_the_value_written_there(
    tmp_path: Path,
) -> None:
    table = tomllib.loads(init_study(tmp_path / "study").read_text())
    designs = {
        "tracking": TrackingDesign(margin=1.0),
        "picking": PickingDesign(margin_s=2.0),
        "parameters": Parameters(),
    }
    for name, design in designs.items():
        assert set(table[name]) == {field.name for field in fields(design)}
    whole = study_from_table(table)
    assert (whole.tracking, whole.picking, whole.parameters) == tuple(designs.values())


def test_an_example_replaces_files_only_if_forced_and_never_results(
    tmp_path: Path,
) -> None:
    path = init_study(tmp_path / "study")
    path.write_text("mine")
    with pytest.raises(InvalidInput, match="exists already"):
        init_study(tmp_path / "study")
    assert path.read_text() == "mine"
    init_study(tmp_path / "study", force=True)
    assert read_study(path).participants == 10
    about = {"experiment": "tracking", "participant": "01", "simulated": True}
    visit = create_visit(tmp_path / "study" / "visits" / "sub-01_tracking", about)
    with pytest.raises(InvalidInput, match="found one that holds visits"):
        init_study(tmp_path / "study", force=True)
    assert visit.is_dir()


# --- what is refused -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"cohort": {"participants": 0}}, "expected 1 to .* found 0"),
        ({"cohort": {"participants": True}}, "a whole number for participants"),
        ({"tracking": {"conditions": ["ikns"]}}, "two conditions to compare .* ikns"),
        ({"tracking": {"conditions": ["ikns", "ikns"]}}, "distinct conditions"),
        ({"tracking": {"conditions": ["ikns", "mouse"]}}, "found 'mouse'"),
        ({"tracking": {"conditions": "ikns"}}, "a list of text for conditions"),
        ({"tracking": {"profiles": []}}, "distinct profiles"),
        ({"tracking": {"profiles": ["T4"]}}, "profiles of T1, T2, T3 .* 'T4'"),
        ({"tracking": {"repeats": 0}}, "found 0: no trial would be left"),
        ({"tracking": {"repeats": 1.5}}, "a whole number for repeats"),
        ({"tracking": {"training": -1}}, "training from 0 trials .* -1"),
        ({"tracking": {"seconds": 5}}, "seconds must be at least 12, found 5"),
        ({"tracking": {"seconds": 12}, "study": {"seed": 5}}, "no profile T1 of 12 s"),
        ({"tracking": {"align": -1.0}}, "align from 0 s"),
        ({"tracking": {"rest": -1.0}}, "rest from 0 s"),
        ({"tracking": {"margin": 0.0}}, "margin above 0 .* found 0"),
        ({"tracking": {"margin": float("nan")}}, "margin above 0 .* found nan"),
        ({"tracking": None}, r"a table \[tracking\] or \[picking\], found neither"),
        ({"cohort": None}, r"a table \[cohort\], found none"),
        ({"study": None}, r"a table \[study\], found none"),
        ({"study": {"name": " "}}, "a name"),
        ({"study": {"format": 2}}, "format 1, found 2"),
        ({"study": {"seed": -1}}, "a seed from 0"),
        ({"picking": {"objects": ["A", "Z"]}}, "found 'Z'"),
        ({"picking": {"limit": 0.0}}, "limit above 0"),
        ({"picking": {"margin_s": -2.0}}, "margin_s above 0"),
        ({"picking": {"conditions": ["ikns"]}}, "at least two conditions"),
        ({"picking": {"conditions": ["ikns", "gamepad"]}}, "found 'gamepad'"),
        ({"parameters": {"rate": 0.0}}, "rate above 0 .* found 0"),
        ({"parameters": {"rate": 5.0}}, "a rate of 20 to 1000 .* found 5"),
        ({"parameters": {"max_hand_speed": -1.0}}, "max_hand_speed above 0"),
        ({"parameters": {"n_points": 4}}, "n_points of 5 to 10 .* found 4"),
        ({"parameters": {"occluded": 0.5}}, "occluded of at least 0 .* below 0.5"),
        ({"parameters": {"layout": "sphere"}}, "layout of box, .* found 'sphere'"),
        ({"parameters": {"layout": "corners", "n_points": 7}}, "n_points above 7"),
        ({"parameters": {"interpolation": "cubic"}}, "found 'cubic'"),
        ({"variations": {"a": {}}}, r"a change of a parameter in \[variations.a\]"),
        ({"variations": {"a": {"latency": 0.05}}}, "a change of a parameter"),
        (
            {"variations": {"a": {"latency": -1.0}}},
            r"\[variations.a\]: expected latency",
        ),
        ({"variations": {"sub-01": {"latency": 0.1}}}, "found 'sub-01'"),
        ({"variations": {"../up": {"latency": 0.1}}}, r"found '\.\./up'"),
        ({"variations": {"a": 1}}, r"a table \[variations.a\], found 1"),
    ],
)
def test_an_impossible_design_is_refused_with_one_sentence(
    tables: dict, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(InvalidInput, match=sentence) as caught:
        study_from_table(changed(**tables))
    assert "\n" not in str(caught.value)
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(changed(**tables)))
    with pytest.raises(InvalidInput, match=r"study\.toml: "):
        read_study(path)


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"tracking": {"condition": ["a"]}}, r"'conditions' in \[tracking\]"),
        ({"cohort": {"participant": 3}}, r"'participants' in \[cohort\]"),
        ({"variation": {}}, "'variations' in a study file, found 'variation'"),
        ({"parameters": {"max_speed": 0.1}}, "'max_hand_speed'"),
        ({"variations": {"a": {"n_point": 8}}}, r"'n_points' in \[variations.a\]"),
        ({"study": {"zzz": 1}}, "one of name, seed, format, simulated in"),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest_known_one(
    tables: dict, sentence: str
) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        study_from_table(changed(**tables))


def test_what_is_no_study_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"study\.toml: no such file; `ikns"):
        read_study(tmp_path)
    (tmp_path / "study.toml").write_text("[study\n")
    with pytest.raises(FileError, match=r"study\.toml: cannot be read as TOML"):
        read_study(tmp_path)
    (tmp_path / "study.toml").write_bytes(b"\xff")
    with pytest.raises(FileError, match="cannot be read as TOML"):
        read_study(tmp_path)


def test_people_may_have_any_devices() -> None:
    table = changed(
        study={"simulated": False},
        tracking={"conditions": ["mouse", "ikns"], "align": 3.0},
    )
    study = study_from_table(table)
    assert study.tracking is not None
    assert study.tracking.conditions == ("mouse", "ikns")


# --- variations ----------------------------------------------------------------------


def test_a_variation_changes_what_it_names_and_nothing_else() -> None:
    study = study_from_table(
        changed(parameters={"rate": 50}, variations={"gate": {"max_hand_speed": 0.1}})
    )
    assert study.parameters_of() == Parameters(rate=50.0)
    assert study.parameters_of("gate") == Parameters(rate=50.0, max_hand_speed=0.1)


def test_every_layout_is_a_part_of_the_box_in_space() -> None:
    for points in LAYOUTS.values():
        assert len(set(points)) == len(points) >= 4
        assert set(points) <= set(range(10))
    # Corners come upper face first, around: 0 and 2, 5 and 7 are diagonals, crossed.
    assert Parameters(layout="tetrahedron").points == (0, 2, 5, 7)
    assert Parameters(n_points=7).points == tuple(range(7))


QUICK: dict[str, Any] = {"rate": 50.0, "point_seconds": 2.0}


@pytest.fixture(scope="module")
def usual() -> Participant:
    return study_participant(0, seed=4, parameters=Parameters(**QUICK))


def test_variations_have_the_same_people_and_noise(usual: Participant) -> None:
    gate = Parameters(**QUICK, max_hand_speed=0.1)
    other = study_participant(0, seed=4, parameters=gate)
    assert other.abilities == usual.abilities
    assert other.protocol.subject.adult == usual.protocol.subject.adult
    markers = [p.protocol.points.recording.markers for p in (usual, other)]
    assert np.array_equal(*markers, equal_nan=True)
    assert np.array_equal(other.place.posture, usual.place.posture)
    counts = [p.subject.null_space_map.counts_.sum() for p in (usual, other)]
    assert counts[0] < counts[1]  # a faster hand counts as still


def test_a_layout_makes_the_map_of_some_points(usual: Participant) -> None:
    layout = Parameters(**QUICK, layout="tetrahedron")
    four, ten = (
        p.subject.null_space_map.centers_ for p in (recalibrated(usual, layout), usual)
    )
    assert len(four) == 4
    # The hand is held there for 2 s and wanders by millimeters; the nearest two points
    # of the box are more than 0.1 m apart.
    apart = np.linalg.norm(four[:, None] - ten, axis=-1)
    assert np.all(apart.min(axis=1) < 0.02)
    assert len(set(apart.argmin(axis=1))) == 4


def test_interpolation_changes_the_weights_and_not_the_points(
    usual: Participant,
) -> None:
    maps = {
        method: recalibrated(
            usual, Parameters(**QUICK, interpolation=method, outside="project")
        ).subject.null_space_map
        for method in ("natural", "laplace", "nearest")
    }
    learned = usual.subject.null_space_map
    x = learned.centers_.mean(axis=0)
    weights = {name: found.interpolator_.weights(x) for name, found in maps.items()}
    for name, found in maps.items():
        assert found.outside == "project"
        assert np.array_equal(found.directions_, learned.directions_)
        assert weights[name].sum() == pytest.approx(1)
    assert weights["nearest"].max() == 1
    for name in ("natural", "laplace"):  # both reproduce the place
        assert weights[name] @ learned.centers_ == pytest.approx(x, abs=1e-12)
    assert not np.allclose(weights["natural"], weights["laplace"], atol=1e-3)


# --- what may change once there are results ------------------------------------------


def declare(folder: Path, **tables: dict | None) -> None:
    """Declare, and have a result, whichever it is."""
    save_declaration(folder, study_from_table(changed(**tables)))
    about = {"experiment": "tracking", "participant": "01", "simulated": True}
    if not list_visits(folder):
        create_visit(folder / "visits" / "sub-01_tracking", about)


def test_without_a_result_everything_may_change(tmp_path: Path) -> None:
    save_declaration(tmp_path, study_from_table(SMALL))
    save_declaration(tmp_path, study_from_table(changed(study={"seed": 1})))
    declare(tmp_path, study={"seed": 2})
    with pytest.raises(InvalidInput, match="seed = 2, found 1"):
        check_declaration(tmp_path, study_from_table(changed(study={"seed": 1})))


@pytest.mark.parametrize(
    "tables",
    [
        {"study": {"name": "renamed"}},
        {"cohort": {"participants": 20}},
        {"picking": {"repeats": 2}},
        {"variations": {"gate": {"max_hand_speed": 0.1}}},
        {"variations": {"gate": {"max_hand_speed": 0.1}, "b": {"latency": 0.1}}},
    ],
)
def test_more_of_the_same_may_be_added(tables: dict, tmp_path: Path) -> None:
    declare(tmp_path)
    declare(tmp_path, **tables)
    check_declaration(tmp_path, study_from_table(changed(**tables)))


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"study": {"seed": 1}}, "seed = 0, found 1"),
        ({"study": {"simulated": False}}, "simulated = True, found False"),
        ({"tracking": {"margin": 1.5}}, r"tracking\.margin = 1\.0, found 1\.5"),
        ({"tracking": {"repeats": 2}}, r"tracking\.repeats = 3, found 2"),
        ({"tracking": None, "picking": {}}, "found None"),
        ({"parameters": {"latency": 0.1}}, r"parameters\.latency = 0\.05, found 0\.1"),
        ({"picking": {"limit": 10.0}}, r"picking\.limit = 20\.0, found 10\.0"),
        ({"variations": {}}, r"variations\.gate = .* found None"),
        (
            {"variations": {"gate": {"max_hand_speed": 0.2}}},
            r"variations\.gate\.max_hand_speed = 0\.1, found 0\.2",
        ),
    ],
)
def test_the_meaning_of_results_may_not_change(
    tables: dict, sentence: str, tmp_path: Path
) -> None:
    # The second experiment and the variation are added later, and hold from then on.
    declare(tmp_path)
    whole: dict[str, Any] = {
        "picking": {},
        "variations": {"gate": {"max_hand_speed": 0.1}},
    }
    declare(tmp_path, **whole)
    with pytest.raises(InvalidInput, match=sentence):
        check_declaration(tmp_path, study_from_table(changed(**(whole | tables))))
    with pytest.raises(InvalidInput, match=sentence):
        save_declaration(tmp_path, study_from_table(changed(**(whole | tables))))
    check_declaration(tmp_path, study_from_table(changed(**whole)))


def test_a_damaged_copy_of_the_declaration_is_named(tmp_path: Path) -> None:
    declare(tmp_path)
    (tmp_path / "visits" / "declared.json").write_text("{}")
    with pytest.raises(FileError, match=r"declared\.json: cannot be read"):
        check_declaration(tmp_path, study_from_table(SMALL))


def test_a_declaration_is_plain(tmp_path: Path) -> None:
    study = read_study(init_study(tmp_path / "study"))
    table = study.declared()
    # What TOML can hold but for the frozen tables: text, numbers, lists, tables.
    assert tomllib.loads(tomli_w.dumps(table)) == table
    assert table["parameters"] == asdict(study.parameters)
