"""``ikns markers``, and labels that are not those of the set."""

import io
import json
from pathlib import Path

import pytest
import small_person
from command_line import check_refused

from ikns.body.marker_set import MarkerSet
from ikns.cli import main
from ikns.recording.files import read
from ikns.recording.labels import renamed
from ikns.recording.recording import Recording


def test_sets_and_places_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["markers", "list", "--json"]) == 0
    found = {row["name"]: row for row in json.loads(capsys.readouterr().out)["sets"]}
    assert list(found) == list(MarkerSet.names())
    assert found["oxford24"]["static_only"] == ["RMEP", "LMEP"]
    assert len(found["halpe26"]["held"]) == 10
    assert main(["markers", "sites"]) == 0
    assert "right_lateral_epicondyle" in capsys.readouterr().out


def test_a_set_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["markers", "show", "halpe26", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    by_label = {row["label"]: row for row in shown["markers"]}
    assert by_label["RElbow"]["position_m"] == [0, -0.271, 0]
    assert by_label["LHip"]["weight"] == 0.2
    assert main(["markers", "show", "halpe26"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Held, as no marker shows them: clavicle_protraction" in said
    assert "RElbow right_upper_arm 0 -271 0 12 12 12" in said


def test_answers_on_the_terminal_become_a_set(
    files: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    labels = read(files / "static.c3d").labels
    said = {label: "" for label in labels}
    said |= {"RMEP": "static", "RFIN": "fin\nright knuckle 3", "LFRM": "?\nskip"}
    typed = "\n".join(said[label] for label in labels) + "\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    out = tmp_path / "mine.toml"
    static = str(files / "static.c3d")
    assert main(["markers", "new", static, "--out", str(out), "--json"]) == 0
    captured = capfd.readouterr()
    result = json.loads(captured.out)
    assert "there is no place 'fin' on the body" in captured.err
    assert "  left_acromion: left highest point" in captured.err
    assert result["skipped"] == ["LFRM"]
    assert result["sites"]["RMEP"] == "right_medial_epicondyle static"
    assert result["sites"]["LMEP"] == "left_medial_epicondyle"
    made = MarkerSet.load(out)
    assert [m.label for m in made.markers if m.static_only] == ["RMEP"]
    assert made.name == "mine"
    # What the file says of places is used at once.
    assert main(["markers", "check", str(out), static]) == 0
    assert "The person stands like this" in capfd.readouterr().out


def test_answers_in_a_file_and_labels_renamed(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    places = tmp_path / "places.txt"
    places.write_text(
        "C7 = c7\nCLAV = sternal_notch  # and so on\nRAC = right acromion\n"
        "RELB = right_lateral_epicondyle\nRMEP = right_medial_epicondyle static\n"
        "RWRA = right_radial_styloid\nRWRB = right_ulnar_styloid\n"
        "RUPA = right_upper_arm\nT10 = thorax\n"
    )
    out = tmp_path / "right.toml"
    words = ["markers", "new", str(files / "static.c3d"), "--sites", str(places)]
    words += ["--rename", "RSHO=RAC", "--out", str(out), "--json"]
    assert main(words) == 0
    result = json.loads(capfd.readouterr().out)
    assert result["measured"] == ["RUPA", "T10"]
    assert {"right_wrist_flexion", "right_wrist_deviation"} <= set(result["held"])
    assert not {"right_elbow_flexion", "right_shoulder_flexion"} & set(result["held"])
    refused = check_refused(words[:-1], tmp_path, capfd, names=out)
    assert "--force" in refused
    assert main([*words, "--force"]) == 0


def test_a_movement_says_what_is_static_only_and_how_well_it_is_followed(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    static, moved = (str(files / f"{name}.c3d") for name in ("static", "points"))
    out = str(tmp_path / "mine.toml")
    words = ["markers", "new", static, "--guess", "--movement", moved, "--out", out]
    assert main([*words, "--json"]) == 0
    made = json.loads(capfd.readouterr().out)
    static_only = {k for k, v in made["sites"].items() if v.endswith(" static")}
    assert static_only == {"RMEP", "LMEP"}
    words = ["markers", "check", out, static, "--movement", moved]
    assert main([*words, "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    # Simulated skin moves by some 3 mm per axis.
    assert 0 < found["residual_in_movement_m"] < 0.01
    assert found["residual_in_movement_m"] == pytest.approx(
        made["residual_in_movement_m"]
    )
    assert main(words) == 0
    assert "mm apart in the median frame" in capfd.readouterr().out


def test_a_mirror_image_is_named_before_what_follows_from_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    static = small_person.protocol().static.recording
    image = Recording(
        static.time, static.markers * [1.0, 1.0, -1.0], static.labels, "image.c3d"
    )
    path = str(small_person.write(tmp_path, "image", image))
    assert main(["markers", "check", "oxford24", path]) == 2
    out, err = capfd.readouterr()
    assert err.startswith(f"ikns: {path}: the body is a mirror image")
    assert "misplaced" not in out
    assert "beyond" in out
    assert main(["markers", "check", "oxford24", path, "--json"]) == 2
    (told,) = json.loads(capfd.readouterr().out)["notes"]
    assert told in err


def test_nothing_to_answer_with_is_one_sentence(
    files: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    static, out = str(files / "static.c3d"), str(tmp_path / "mine.toml")
    assert main(["markers", "new", static, "--out", out]) == 2
    assert "give --sites FILE" in capfd.readouterr().err
    for more, says in (
        (["--guess", "--sites", static], "expected --sites or --guess, found both"),
        (["--guess", "--out", str(tmp_path / "a.txt")], "ends in .toml, found .txt"),
    ):
        words = ["markers", "new", static, "--out", out, *more]
        assert says in check_refused(words, tmp_path, capfd)


def test_renamed_markers_give_the_same_angles(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = small_person.protocol()
    other = {"RELB": "Elbow lat", "RWRA": "RWRB", "RWRB": "RWRA"}
    odd = small_person.write(tmp_path, "odd", renamed(run.free.recording, other))
    names = tmp_path / "names.txt"
    names.write_text("Elbow lat = RELB\nRWRB=RWRA\n")
    person, plain, back = (
        str(files / "person"),
        tmp_path / "plain.csv",
        tmp_path / "back.csv",
    )
    free = str(files / "free.c3d")
    assert main(["ik", free, "--subject", person, "--out", str(plain)]) == 0
    words = ["ik", str(odd), "--subject", person, "--labels", str(names)]
    assert main([*words, "--rename", "RWRA=RWRB", "--out", str(back)]) == 0
    assert back.read_text() == plain.read_text()
    capfd.readouterr()
    # A label that no file has is refused, whatever would come of it.
    words = ["ik", free, "--subject", person, "--force", "--rename", "RELBO=RELB"]
    said = check_refused([*words, "--out", str(back)], tmp_path, capfd)
    assert "no recording has the label RELBO of --rename" in said
    calibrated = ["calibrate", "--static", free, "--exploration", free]
    calibrated += ["--marker-set", "ue_adl", "--rename", "X1=RELB"]
    words = [*calibrated, "--out", str(tmp_path / "new")]
    assert "has the label X1 of --rename" in check_refused(words, tmp_path, capfd)


def test_a_cutoff_smooths_the_angles(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rough, smooth = tmp_path / "rough.csv", tmp_path / "smooth.csv"
    words = ["ik", str(files / "free.c3d"), "--subject", str(files / "person")]
    assert main([*words, "--out", str(rough)]) == 0
    assert main([*words, "--out", str(smooth), "--cutoff", "4"]) == 0
    assert rough.read_text() != smooth.read_text()
    capfd.readouterr()
    fast = [*words, "--out", str(tmp_path / "new.csv"), "--cutoff", "30"]
    assert "--cutoff must be above 0 and below" in check_refused(fast, tmp_path, capfd)


def test_live_calibration_has_no_files_to_rename(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ["calibrate", "--live", "--source", "replay:x.c3d", "--rename", "A=B"]
    said = check_refused([*words, "--out", str(tmp_path / "a")], tmp_path, capfd)
    assert "--rename goes with recordings from files" in said
