"""What the judge says of static trials and recordings, clean and wrong."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import ikns
from ikns.body.marker_set import MarkerSet
from ikns.body.set_choice import better_set
from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.labels import judge_unseen
from ikns.calibration.judge.recordings import check_recordings
from ikns.calibration.scaling import judge_static, scale
from ikns.cli import main
from ikns.errors import FileError, InvalidInput, MarkerMismatch, NotEnoughData
from ikns.recording.files import read, write_c3d
from ikns.recording.labels import renamed
from ikns.recording.recording import Recording

RATE = 50.0
REST = {"elbow_flexion": 1.0, "shoulder_abduction": 0.3, "forearm_pronation": 0.2}


@cache
def generic() -> Skeleton:
    return Skeleton.load()


def pose(body: Skeleton, angles: dict[str, float]) -> np.ndarray:
    """Both arms at these angles, rad."""
    q = body.neutral()
    for i, name in enumerate(body.joint_names):
        q[7 + i] = angles.get(name.split("_", 1)[1], 0.0)
    return q


def recorded(body: Skeleton, poses: list[np.ndarray], source: str) -> Recording:
    """Put the markers where the poses have them, with 0.3 mm of noise."""
    markers = np.array([body.markers_in_world(q) for q in poses])
    markers += np.random.default_rng(1).normal(0, 3e-4, markers.shape)
    labels = [f"Ann:{label}" for label in body.marker_set.labels]
    return Recording(np.arange(len(poses)) / RATE, markers, labels, source)


@cache
def standing() -> Recording:
    return recorded(generic(), [pose(generic(), REST)] * 60, "static.c3d")


@cache
def reaching(body: Skeleton | None = None) -> Recording:
    """Elbows, shoulders and wrists bend to and fro for four seconds."""
    poses = []
    for t in np.arange(200) / RATE:
        moved = {
            "elbow_flexion": 1.0 + 0.6 * np.sin(2 * t),
            "shoulder_flexion": 0.5 + 0.5 * np.sin(1.3 * t),
            "shoulder_abduction": 0.3 + 0.2 * np.sin(0.7 * t),
            "forearm_pronation": 0.7 * np.sin(1.1 * t),
            "wrist_flexion": 0.5 * np.sin(1.7 * t),
        }
        poses.append(pose(body or generic(), moved))
    return recorded(body or generic(), poses, "reaching.c3d")


def changed(recording: Recording, markers: np.ndarray) -> Recording:
    return Recording(recording.time, markers, recording.labels, recording.source)


def swapped(recording: Recording, a: str, b: str, rows=slice(None)) -> Recording:
    i, j = (recording.labels.index(f"Ann:{name}") for name in (a, b))
    markers = np.array(recording.markers)
    markers[rows, i] = recording.markers[rows, j]
    markers[rows, j] = recording.markers[rows, i]
    return changed(recording, markers)


@cache
def person() -> Skeleton:
    return scale(generic(), standing())[0]


def check(recording: Recording):
    """Judge a recording of the person of the static trial."""
    return check_recordings([recording], skeleton=person())


def test_a_clean_person_passes():
    found = check_recordings([reaching(), standing()], static=standing())
    assert found.usable
    assert not found.findings
    alone = check_recordings([reaching(), standing()])
    assert not alone.findings
    assert [kind for _, kind in alone.judged] == [
        "movement, without a static trial",
        "static trial",
    ]


@pytest.mark.parametrize(
    "names",
    [
        ("RWRA", "RWRB"),  # pronation 144 deg off, every residual below 0.3 mm
        ("RELB", "RMEP"),
        ("LFIN", "LWRA"),
        ("C7", "CLAV"),
    ],
)
def test_names_exchanged_everywhere_are_refused_with_what_repairs_them(names):
    static = swapped(standing(), *names)
    with pytest.raises(MarkerMismatch) as caught:
        scale(generic(), static)
    sentence = str(caught.value)
    assert sentence.startswith("static.c3d: ")
    pairs = {f"swap {a} and {b}:" for a, b in (names, names[::-1])}
    assert any(pair in sentence for pair in pairs), sentence


def test_both_wrists_exchanged_are_mended_together():
    static = swapped(swapped(standing(), "RWRA", "RWRB"), "LWRA", "LWRB")
    (found,) = judge_static(generic(), static).findings
    assert found.kind == "exchanged"
    assert set(found.markers) == {"RWRA", "RWRB", "LWRA", "LWRB"}


def test_the_command_that_is_named_mends_names_also_of_a_ring_of_three():
    ring = {"RUPA": "RUPB", "RUPB": "RUPC", "RUPC": "RUPA"}
    wrong = renamed(reaching(), ring)
    right = check(wrong).findings[0].right
    names = dict(re.findall(r"--rename (\w+)=(\w+)", right))
    assert names == {new: old for old, new in ring.items()}
    assert check(renamed(wrong, names)).findings == ()


def test_the_command_that_is_named_has_the_labels_of_the_file():
    theirs = renamed(reaching(), {"RSHO": "RACR", "RELB": "RLEP"})
    wrong = renamed(theirs, {"RACR": "RLEP", "RLEP": "RACR"})
    right = check(wrong).findings[0].right
    names = dict(re.findall(r"--rename (\w+)=(\w+)", right))
    assert names == {"RACR": "RLEP", "RLEP": "RACR"}
    assert check(renamed(wrong, names)).findings == ()


def test_a_mirror_image_is_told():
    for markers in (
        standing().markers * [1.0, 1.0, -1.0],
        standing().markers[:, [*range(4), *range(14, 24), *range(4, 14)]],
    ):
        (found,) = judge_static(generic(), changed(standing(), markers)).findings
        assert found.kind == "mirrored"
        assert found.severity == "refuse"


@pytest.mark.parametrize("factor", [1e-3, 1 / 25.4, 0.1, 10.0, 25.4, 1e3])
def test_another_unit_is_refused_in_either_recording(factor):
    static = changed(standing(), factor * standing().markers)
    with pytest.raises(MarkerMismatch, match="unit"):
        scale(generic(), static)
    moving = changed(reaching(), factor * reaching().markers)
    for found in (check(moving), check_recordings([moving])):
        assert [finding.kind for finding in found.findings] == ["unit"]
        assert not found.usable


def test_a_person_who_moves_is_refused_and_a_ghost_is_left_out():
    with pytest.raises(NotEnoughData, match=r"static\.c3d: the person moved: .FIN by"):
        scale(generic(), changed(standing(), reaching().markers[:60]))
    markers = np.array(standing().markers)
    markers[20:30, 5] += 0.5
    clean, _ = scale(generic(), standing())
    ghost, report = scale(generic(), changed(standing(), markers))
    assert "in frames 21-30" in report.warnings[0]
    for name, length in clean.segment_lengths.items():
        # Ten of sixty frames fewer: the mean of 0.3 mm of noise changes by less than
        # 0.3 / sqrt(50) mm, four times that for the fit's two ends and chance.
        assert abs(ghost.segment_lengths[name] - length) < 2e-4


def test_numbers_for_not_seen_are_refused_with_the_marker():
    for number in (-16.512, 9999.999):
        for recording in (standing(), reaching()):
            markers = np.array(recording.markers)
            markers[10:20, 7] = number
            wrong = changed(recording, markers)
            (found,) = check_recordings([wrong]).findings
            assert (found.kind, found.severity) == ("not seen", "refuse")
            assert found.markers == (generic().marker_set.labels[7],)
            assert found.frames == "11-20"


@pytest.mark.parametrize(
    "names", [("RWRA", "RFIN"), ("RELB", "LELB"), ("RUPA", "RFRM"), ("RSHO", "LSHO")]
)
def test_names_exchanged_in_a_recording_are_told(names):
    assert names[0] in generic().marker_set.labels
    for rows in (slice(None), slice(50, 110), slice(50, 60)):
        found = check(swapped(reaching(), *names, rows))
        told = found.findings[0]
        assert told.kind == "exchanged"
        assert set(told.markers) == set(names)
        assert found.usable == (rows != slice(None))
        assert told.frames == ("" if found.usable is False else f"51-{rows.stop}")


def test_a_marker_put_elsewhere_is_told():
    markers = np.array(reaching().markers)
    first, second = (reaching().labels.index(f"Ann:{m}") for m in ("RFRM", "RWRA"))
    line = markers[:, first] - markers[:, second]
    markers[:, first] += 0.03 * line / np.linalg.norm(line, axis=1, keepdims=True)
    (found,) = check(changed(reaching(), markers)).findings
    assert (found.kind, found.severity) == ("marker moved", "warn")
    assert "30 mm farther apart" in found.found


def test_noise_does_not_hide_a_marker_that_was_put_elsewhere():
    markers = np.array(reaching().markers)
    markers += np.random.default_rng(2).normal(0, 0.008, markers.shape)
    noisy = changed(reaching(), markers)
    assert "marker moved" not in {one.kind for one in check(noisy).findings}
    first, second = (reaching().labels.index(f"Ann:{m}") for m in ("RFRM", "RWRA"))
    line = reaching().markers[:, first] - reaching().markers[:, second]
    markers[:, first] += 0.04 * line / np.linalg.norm(line, axis=1, keepdims=True)
    found = {one.kind: one for one in check(changed(reaching(), markers)).findings}
    assert {"noise", "marker moved"} <= set(found)
    assert "farther apart than in the static trial" in found["marker moved"].found


def test_another_persons_static_trial_is_told_by_distances_and_by_name():
    rng = np.random.default_rng(3)
    worn = generic().marker_set
    # Two people's markers differ by as much as the set says they are misplaced.
    places = generic().marker_positions + rng.normal(
        0, [m.placement_sd for m in worn.markers]
    )
    other = generic().with_markers(worn.at(places))
    found = check(reaching(other))
    assert "another person" in [finding.kind for finding in found.findings]
    assert not found.usable
    labels = [label.replace("Ann", "Ben") for label in standing().labels]
    ben = Recording(standing().time, standing().markers, labels, "ben.c3d")
    (found,) = check_recordings([reaching()], static=ben).findings
    assert found.kind == "another person"
    assert "ben" in found.found


def test_another_person_than_the_one_who_was_calibrated_is_told():
    # What a calibration keeps of the person: the name before the labels, and how far
    # the markers are from the body, here the noise of `recorded`.
    as_ann, as_ben = ({"static": {"subjects": [name]}} for name in ("ann", "ben"))
    assert not check_recordings([reaching()], skeleton=person(), report=as_ann).findings
    found = check_recordings([reaching()], skeleton=person(), report=as_ben)
    assert [(one.kind, one.severity) for one in found.findings] == [
        ("another person", "warn")
    ]
    assert "calibrated as ben" in found.findings[0].found
    calm = {"explorations": [{"residual_median_m": 5e-4}]}
    assert not check_recordings([reaching()], skeleton=person(), report=calm).findings
    # Limbs a tenth longer, with what they wear.
    longer = generic().resized(
        {
            f"{side}_{part}": 1.1
            for side in ("right", "left")
            for part in ("upper_arm", "forearm")
        }
    )
    (told,) = check_recordings(
        [reaching(longer)], skeleton=person(), report=calm
    ).findings
    assert told.kind == "another person"
    assert "0 mm at calibration" in told.found
    # After markers were put on again, what was measured then counts.
    again = calm | {"rewear": {"natural": [{"residual_median_m": 0.05}]}}
    rough = check_recordings([reaching(longer)], skeleton=person(), report=again)
    assert "another person" not in [one.kind for one in rough.findings]


def test_a_body_of_no_adult_is_told():
    tall = generic().resized(dict.fromkeys(generic().segment_lengths, 1.35))
    findings = judge_static(
        generic(), recorded(tall, [pose(tall, REST)] * 60, "tall.c3d")
    ).findings
    assert "length" in [finding.kind for finding in findings]


def test_a_marker_set_in_meters_is_refused(tmp_path):
    worn = MarkerSet.load("oxford24")
    for factor in (1e-3, 1e3):
        wrong = tuple(
            replace(m, position=tuple(factor * x for x in m.position))
            for m in worn.markers
        )
        path = tmp_path / "own.toml"
        path.write_text(replace(worn, markers=wrong).toml(), encoding="utf-8")
        with pytest.raises(FileError, match=r"own\.toml: .* unit"):
            MarkerSet.load(path)


def test_either_a_static_trial_or_a_person():
    with pytest.raises(InvalidInput, match="both"):
        check_recordings([reaching()], static=standing(), skeleton=person())


def test_the_command_exits_with_2_only_for_what_must_not_be_used(tmp_path, capsys):
    paths = {}
    for name, recording in (
        ("static", standing()),
        ("reaching", reaching()),
        ("wrong", swapped(standing(), "RELB", "RMEP")),
    ):
        paths[name] = tmp_path / f"{name}.c3d"
        write_c3d(paths[name], recording)
    clean = ["check", str(paths["reaching"]), "--static", str(paths["static"])]
    assert main(clean) == 0
    assert "No problems found." in capsys.readouterr().out
    assert main([*clean, "--rename", "Ann:RELB=Ann:X1"]) == 0
    assert "No errors; 2 notes." in capsys.readouterr().out
    wrong = ["check", str(paths["reaching"]), "--static", str(paths["wrong"])]
    assert main(wrong) == 2
    out, err = capsys.readouterr()
    assert "do not use" in out
    assert err.count("\n") == 1
    assert "swap RELB and RMEP" in err
    assert err.startswith(f"ikns: {paths['wrong']}: ")
    # A script that reads the error alone learns that there is more.
    (tmp_path / "again.c3d").write_bytes(paths["wrong"].read_bytes())
    assert main(["check", str(paths["wrong"]), str(tmp_path / "again.c3d")]) == 2
    assert capsys.readouterr().err.startswith("ikns: 2 problems; first: ")
    assert main([*wrong, "--json"]) == 2
    result = json.loads(capsys.readouterr().out)
    assert result["usable"] is False
    assert result["findings"][0]["markers"] == ["RELB", "RMEP"]


def test_real_people_pass_and_their_wrong_recordings_do_not(data):
    folder = data / "ue_adl"
    if len(list(folder.glob("ADL*"))) < 3:
        pytest.skip(f"the people of UE_ADL are not in {folder}")
    statics = {}
    for name in ("ADL003", "ADL008"):
        static = statics[name] = read(folder / name / f"{name}_static.csv")
        files = [folder / name / f"{name}{trial}.csv" for trial in ("CL1", "FR1")]
        found = check_recordings(
            [read(path) for path in files],
            static=static,
            marker_set="ue_adl",
            min_static=0.3,
        )
        assert [f for f in found.findings if f.severity != "note"] == []
    reach = read(folder / "ADL008" / "ADL008FR1.csv")
    found = check_recordings(
        [reach], static=statics["ADL003"], marker_set="ue_adl", min_static=0.3
    )
    assert found.findings[0].kind == "another person"
    markers = np.array(statics["ADL008"].markers)
    labels = [label.partition(":")[2] for label in statics["ADL008"].labels]
    pair = [labels.index("RSPR"), labels.index("RSPU")]
    markers[:, pair] = markers[:, pair[::-1]]
    (told, *_) = judge_static(
        generic(),
        changed(statics["ADL008"], markers),
        marker_set="ue_adl",
        min_duration=0.5,
    ).findings
    assert told.kind == "exchanged"
    assert told.markers == ("RSPR", "RSPU")
    lifts = sorted((data / "stoop").glob("*.c3d"))
    neutral = read(lifts[0])
    found = check_recordings(
        [read(lifts[1])], static=neutral, marker_set="plug_in_gait"
    )
    # Nobody wore markers on the forearms, in the static trial neither: said once.
    assert [(f.kind, f.severity, f.markers) for f in found.findings] == [
        ("unseen", "note", ("RFRM", "LFRM"))
    ]
    assert ikns.check_recordings is check_recordings


@pytest.mark.parametrize(
    ("label", "found", "right"),
    [
        ("RELBOW", ", but Ann:RELBOW, which", "add --rename RELBOW=RELB"),
        ("X1", "; oxford24 does not have Ann:X1", "if one of these is meant"),
        (None, "", "look whether it was worn"),
    ],
)
def test_a_marker_that_is_in_no_frame_is_a_note(label, found, right):
    recording = reaching()
    column = recording.labels.index("Ann:RELB")
    labels = list(recording.labels)
    markers = np.array(recording.markers)
    if label is None:
        markers[:, column] = np.nan
    else:
        labels[column] = f"Ann:{label}"
    cut = Recording(recording.time, markers, labels, "reach.c3d")
    checked = check(cut)
    (told,) = checked.findings
    assert checked.usable
    assert (told.kind, told.severity, told.markers) == ("unseen", "note", ("RELB",))
    assert told.found.startswith("RELB is in no frame" + found)
    assert right in told.right


def test_a_label_may_be_that_of_one_missing_marker_only():
    labels = [x.replace("RWRA", "RWR") for x in reaching().labels]
    kept = [i for i, x in enumerate(labels) if not x.endswith("RWRB")]
    cut = Recording(
        reaching().time, reaching().markers[:, kept], [labels[i] for i in kept]
    )
    (told,) = check(cut).findings
    assert told.markers == ("RWRA", "RWRB")
    assert told.right.count("--rename") == 1


def test_a_label_of_the_other_side_is_no_other_spelling():
    oxford = MarkerSet.load("oxford24")
    right = tuple(m for m in oxford.markers if not m.label.startswith("L"))
    own = replace(oxford, name="own", markers=right)
    kept = [i for i, x in enumerate(reaching().labels) if not x.endswith("RFIN")]
    labels = [reaching().labels[i] for i in kept]
    cut = Recording(reaching().time, reaching().markers[:, kept], labels)
    (told,) = judge_unseen(cut, own.without_static())
    assert "RFIN is in no frame" in told.found
    assert "--rename L" not in told.right


def test_an_arm_without_any_marker_was_left_out_on_purpose():
    recording = reaching()
    kept = [
        i for i, x in enumerate(recording.labels) if not x.startswith(("L", "Ann:L"))
    ]
    one_armed = Recording(
        recording.time, recording.markers[:, kept], [recording.labels[i] for i in kept]
    )
    assert check(one_armed).findings == ()


LEFT_RIGHT = {"Ann:R": "Ann:L", "Ann:L": "Ann:R"}


def uneven() -> Skeleton:
    """Somebody whose clusters differ from left to right, as everybody's do."""
    rng = np.random.default_rng(5)
    worn = generic().marker_set
    places = generic().marker_positions + rng.normal(
        0, [m.placement_sd for m in worn.markers]
    )
    return generic().with_markers(worn.at(places))


def test_a_recording_mirrored_after_a_right_static_trial_is_told():
    for axis in ([-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]):
        found = check(changed(reaching(), reaching().markers * axis))
        assert not found.usable
        assert found.findings[0].kind == "mirrored"
    exchanged_axes = changed(reaching(), reaching().markers[:, :, [0, 2, 1]])
    assert check(exchanged_axes).findings[0].kind == "mirrored"
    assert check(changed(reaching(), reaching().markers[:, :, [1, 2, 0]])).usable


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (uneven, "left and right are swapped"),
        (generic, "labels of left and right, or export"),
    ],
)
def test_left_for_right_after_a_right_static_trial_is_told(make, words):
    body = make()
    labels = [LEFT_RIGHT.get(x[:5], x[:5]) + x[5:] for x in reaching(body).labels]
    wrong = Recording(reaching().time, reaching(body).markers, labels, "wrong.c3d")
    found = check_recordings([wrong], skeleton=body)
    assert not found.usable
    assert words in found.findings[0].sentence


def test_names_that_went_round_a_cluster_are_told_together():
    round_about = {"RUPA": "RUPB", "RUPB": "RUPC", "RUPC": "RUPA"}
    labels = [
        f"Ann:{round_about.get(label[4:], label[4:])}" for label in reaching().labels
    ]
    wrong = Recording(reaching().time, reaching().markers, labels, "wrong.c3d")
    (found,) = check(wrong).findings
    assert (found.kind, found.severity) == ("exchanged", "refuse")
    assert set(found.markers) == set(round_about)
    # Done one after the other, the exchanges it names make it right.
    steps = found.right.removeprefix("swap ").partition(":")[0].split(", then ")
    mended = wrong
    for step in steps:
        mended = swapped(mended, *step.split(" and "))
    assert not check(mended).findings


def test_frames_that_repeat_the_one_before_are_told():
    markers = np.array(reaching().markers)
    markers[1::2] = markers[::2]
    (found,) = check(changed(reaching(), markers)).findings
    assert (found.kind, found.severity) == ("repeated", "warn")
    assert found.found.startswith("50 %")


def test_a_marker_that_no_posture_reaches_is_refused():
    markers = np.array(reaching().markers)
    markers[:, reaching().labels.index("Ann:RFIN")] *= -1
    found = check(changed(reaching(), markers))
    assert not found.usable
    assert found.findings[0].markers == ("RFIN",)


def test_labels_of_another_set_name_it(data):
    walk = read(next((data / "plugin_gait").glob("*.c3d")))
    lift = read(data / "ue_adl" / "ADL003" / "ADL003_static.csv")
    (told,) = check_recordings([walk]).findings
    assert (told.kind, told.severity) == ("marker set", "warn")
    assert "use --marker-set plug_in_gait" in told.sentence
    (told,) = check_recordings([lift]).findings
    assert (told.kind, told.severity) == ("marker set", "refuse")
    with pytest.raises(MarkerMismatch, match="use --marker-set ue_adl"):
        ikns.scale(generic(), lift)
    # A body keeps its markers.
    (told,) = check_recordings([lift], skeleton=person()).findings
    assert "calibrate with --marker-set ue_adl (in Python" in told.sentence
    assert "or use recordings with markers of oxford24" in told.sentence
    # A set of one's own may leave markers out.
    own = MarkerSet.load("ue_adl")
    right = [m.label for m in own.markers if not m.label.startswith("L")]
    mine = replace(own.only(right), name="mine")
    assert better_set(mine, lift.labels) is None
    assert better_set(replace(mine, name="ue_adl"), lift.labels) is None
    alien = replace(MarkerSet.load("oxford24"), name="mine")
    assert better_set(alien, lift.labels).name == "ue_adl"


@pytest.mark.parametrize("factor", [0.95, 1.03])
def test_another_scale_of_the_same_body_is_refused(factor):
    (found,) = check(changed(reaching(), factor * reaching().markers)).findings
    assert (found.kind, found.severity) == ("scale", "refuse")
    assert f"{factor:.3f} times" in found.found


def test_a_scale_within_the_error_of_cameras_or_other_places_are_none():
    assert not check(changed(reaching(), 1.005 * reaching().markers)).findings
    other = check_recordings([reaching(uneven())], skeleton=person())
    assert "scale" not in [finding.kind for finding in other.findings]


def test_another_frame_rate_than_in_the_static_trial_is_told():
    twice = Recording(
        reaching().time / 2, reaching().markers, reaching().labels, "fast.c3d"
    )
    found = check_recordings([twice, reaching()], static=standing())
    (told,) = found.findings
    assert (told.kind, told.severity, told.where) == ("rate", "warn", "fast.c3d")
    assert "100 frames per second" in told.found
    assert "50" in told.found


def clusters() -> Skeleton:
    """A body with four markers on every segment and clavicles that are held."""
    return Skeleton.load(marker_set="ue_adl")


def moved_along(link: str, shift: float) -> Skeleton:
    """That body, with a link's markers moved along it, m."""
    worn, places = clusters().marker_set, clusters().marker_positions
    places[[m.link == link for m in worn.markers], 1] -= shift
    return clusters().with_markers(worn.at(places))


@pytest.mark.parametrize("link", ["right_upper_arm", "left_forearm"])
def test_markers_that_slip_together_are_told(link):
    body = clusters()
    markers = np.array(reaching(body).markers)
    markers[100:] = reaching(moved_along(link, 0.03)).markers[100:]
    (found,) = check_recordings(
        [changed(reaching(body), markers)], skeleton=body
    ).findings
    assert (found.kind, found.severity) == ("slipped", "warn")
    assert f"the markers of the {link.replace('_', ' ')} and" in found.found
    # The body gives way for a part of it.
    told = float(found.found.split(" mm or more")[0].split()[-1])
    assert 10 < told <= 30
    # 66 frames of 4 s are looked at; the step lies between two of them.
    at = float(found.found.split("at about ")[1].split(" s")[0])
    assert at == pytest.approx(2.0, abs=0.11)


def test_skin_that_moves_with_posture_is_no_slip():
    # 20 mm along the forearm between elbow stretched and bent.
    bent = np.array([0.6 * np.sin(2 * t) for t in reaching().time])
    share = (bent / 1.2 + 0.5)[:, None, None]
    near, far = (reaching(moved_along("right_forearm", x)) for x in (0.0, 0.02))
    markers = (1 - share) * near.markers + share * far.markers
    found = check_recordings([changed(near, markers)], skeleton=clusters()).findings
    assert "slipped" not in [finding.kind for finding in found]
