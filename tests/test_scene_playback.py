"""A recording as tracks, a page that stands alone, and a picture of it.

A track stores float32: 6e-8 of a meter or of a quaternion's entry, and a rotation
matrix has sums of four products of those; 1e-6 covers both.
"""

import base64
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput, NotEnoughData
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.recording.files import read
from ikns.recording.recording import Recording
from ikns.view.scene import Scene, map_scene, recording_scene, scene_html, scene_picture
from ikns.view.scene.body import drawn_links
from ikns.view.scene.commands import ROOT
from ikns.view.scene.drawing import visible_nodes
from ikns.view.scene.page import packed_json
from ikns.view.scene.picture import find_browser
from ikns.view.scene.playback import (
    MOST_FRAMES,
    body_tracks,
    kept_frames,
    marker_tracks,
    markers_in_thorax,
)

CHAIN = "right_arm"


@cache
def recording() -> Recording:
    """Two seconds at 50 Hz, one marker not seen for a while."""
    cut = small_person.cut(small_person.protocol().points.recording, 0, 100)
    markers = cut.markers.copy()
    markers[20:40, cut.labels.index("RFIN")] = np.nan
    return Recording(cut.time, markers, cut.labels, cut.source)


@cache
def motion() -> Motion:
    return MarkerIK(small_person.subject().skeleton).track(recording())


@cache
def scene() -> Scene:
    person = small_person.subject()
    return recording_scene(
        person.skeleton,
        person.null_space_map,
        CHAIN,
        motion(),
        recording(),
        simulated=True,
        title="free & <easy>",
    )


@cache
def mapped() -> Scene:
    person = small_person.subject()
    return map_scene(person.skeleton, person.null_space_map, CHAIN, simulated=True)


def curves(made: Scene) -> dict[str, dict[str, Any]]:
    """Values of the tracks by node and name."""
    (command,) = [c for c in made.commands if c["type"] == "set_animation"]
    found: dict[str, dict[str, Any]] = {}
    for entry in command["animations"]:
        assert entry["clip"]["fps"] == 1
        for track in entry["clip"]["tracks"]:
            np.testing.assert_array_equal(track["times"], np.float32(made.times))
            values = track["values"].reshape(len(made.times), -1)
            found.setdefault(entry["path"], {})[track["name"]] = values
    return found


# --- frames --------------------------------------------------------------------------


@given(
    st.floats(1, 500), st.integers(0, 3000), st.floats(0.5, 120), st.floats(-1e3, 1e3)
)
def test_kept_frames_are_evenly_spaced_and_near_the_rate(
    given_rate: float, n: int, rate: float, start: float
) -> None:
    kept = kept_frames(start + np.arange(n) / given_rate, rate=rate)
    assert len(kept) <= n
    assert (len(kept) > 0) == (n > 0)
    if len(kept) > 1:
        every = np.diff(kept)
        assert (every == every[0]).all()
        assert n - kept[-1] <= every[0]
        # Rounding to whole frames is at most half of one off.
        assert every[0] == 1 or abs(every[0] - given_rate / rate) <= 0.5 + 1e-6


def test_an_hour_is_thinned_to_what_a_page_can_hold() -> None:
    kept = kept_frames(np.arange(3600 * 100) / 100)
    assert MOST_FRAMES / 2 < len(kept) <= MOST_FRAMES


# --- tracks --------------------------------------------------------------------------


def test_the_body_plays_the_postures_of_the_motion() -> None:
    body = small_person.subject().skeleton
    kept = kept_frames(motion().time)
    found = curves(scene())
    for link in drawn_links(body):
        position, rotation = body.link_in_thorax(motion().q[kept], link)
        track = found[f"{ROOT}/body/{link}"]
        np.testing.assert_allclose(track[".position"], position, atol=1e-6)
        turn = Rotation.from_quat(track[".quaternion"]).as_matrix()
        np.testing.assert_allclose(turn, rotation, atol=1e-6)


def test_neighboring_quaternions_take_the_short_way() -> None:
    body = Skeleton.load()
    q = np.tile(body.neutral(), (200, 1))
    turning = body.joint_names.index("right_shoulder_rotation")
    q[:, 7 + turning] = np.linspace(-3, 9, 200)  # once around and more
    for track in body_tracks(body, q):
        assert track.quaternion is not None
        assert (np.sum(track.quaternion[1:] * track.quaternion[:-1], axis=1) > 0).all()


def test_an_unknown_posture_is_drawn_as_the_one_before() -> None:
    body = Skeleton.load()
    rng = np.random.default_rng(3)
    q = rng.uniform(body.lower, body.upper, (5, 18))
    expected = q[[1, 1, 1, 3, 3]]
    q[[0, 2, 4]] = np.nan
    for left, right in zip(
        body_tracks(body, q), body_tracks(body, expected), strict=True
    ):
        np.testing.assert_array_equal(left.position, right.position)


def test_markers_of_the_model_are_seen_from_the_thorax_alike_wherever_it_is() -> None:
    body = small_person.subject().skeleton
    rng = np.random.default_rng(4)
    angles = rng.uniform(body.lower, body.upper, (6, 18))
    turns = Rotation.random(6, random_state=5).as_quat()
    moved = np.concatenate([rng.normal(size=(6, 3)), turns, angles], axis=1)
    home = moved.copy()
    home[:, :7] = [0, 0, 0, 0, 0, 0, 1]
    seen = np.array([body.markers_in_world(q) for q in moved])
    expected = np.array([body.markers_in_world(q) for q in home])
    # Coordinates of a few meters, a few roundings of 2e-16 each.
    np.testing.assert_allclose(markers_in_thorax(seen, moved), expected, atol=1e-12)
    moved[2, 3] = np.nan
    assert np.isnan(markers_in_thorax(seen, moved)[2]).all()


def test_a_marker_that_is_not_seen_is_hidden_at_its_last_place() -> None:
    places = np.arange(15, dtype=float).reshape(5, 1, 3)
    places[[0, 3]] = np.nan
    (track,) = marker_tracks(places, ("A",), "/m")
    np.testing.assert_array_equal(track.visible, [False, True, True, False, True])
    np.testing.assert_array_equal(track.position, places[[1, 1, 2, 2, 4], 0])
    assert marker_tracks(np.full((5, 1, 3), np.nan), ("A",), "/m") == []


def test_the_seen_markers_are_within_the_residual_of_the_model() -> None:
    body = small_person.subject().skeleton
    kept = kept_frames(motion().time)
    found = curves(scene())
    q = motion().q[kept].copy()
    q[:, :7] = [0, 0, 0, 0, 0, 0, 1]
    model = np.array([body.markers_in_world(row) for row in q])
    squares = []
    for m, label in enumerate(body.marker_set.labels):
        track = found.get(f"{ROOT}/seen/{label}")
        if track is None:
            continue
        shown = track.get(".visible", np.ones((len(kept), 1)))[:, 0].astype(bool)
        off = np.linalg.norm(track[".position"] - model[:, m], axis=1)
        squares.append(np.where(shown, off, np.nan) ** 2)
        if label == "RFIN":
            gap = (kept >= 20) & (kept < 40)
            assert not shown[gap].any()
    root = np.sqrt(np.nanmean(squares, axis=0))
    # The same sum over the same markers, in float32.
    np.testing.assert_allclose(root, motion().residual[kept], atol=1e-6)


def test_the_page_knows_c_of_every_frame() -> None:
    kept = kept_frames(motion().time)
    learned = small_person.subject().null_space_map
    expected = learned.control_signal(
        motion().chain_angles(CHAIN)[kept], motion().task_position(CHAIN)[kept]
    )
    np.testing.assert_array_equal(scene().c, expected)
    assert np.isfinite(scene().c).any()


def test_the_sweep_goes_there_and_back_with_a_ghost_of_the_same_c() -> None:
    made, person = mapped(), small_person.subject()
    np.testing.assert_array_equal(made.c, made.c[::-1])
    # The ends: second order in the sweep's step of 0.05 rad.
    assert made.c.min() == pytest.approx(0, abs=0.05**2)
    assert made.c.max() == pytest.approx(1, abs=0.05**2)
    assert (np.diff(made.times) > 0).all()
    found = curves(made)
    hand = found[f"{ROOT}/body/right_hand"][".position"]
    np.testing.assert_allclose(hand, np.tile(hand[0], (len(hand), 1)), atol=1e-6)
    ghost = found[f"{ROOT}/ghosts/moving/0/right_hand"][".position"]
    assert ghost.shape == hand.shape
    # At the start both stand in the same posture.
    row = int(np.argmin(np.abs(made.times - made.start)))
    np.testing.assert_allclose(ghost[row], hand[row], atol=1e-6)
    assert len(person.null_space_map.centers_) == 10


def test_the_camera_sees_the_hand_wherever_it_goes() -> None:
    made = scene()
    places = motion().hand_in_thorax[:, 0]
    to = places[np.isfinite(places).all(axis=1)] - made.camera
    way = made.target - made.camera
    cosine = to @ way / np.linalg.norm(to, axis=1) / np.linalg.norm(way)
    assert np.degrees(np.arccos(cosine)).max() < 14  # half the angle of view


@pytest.mark.parametrize(
    ("name", "marker_set"),
    [
        ("ue_adl/ADL001/ADL001AR1.csv", "ue_adl"),
        ("plugin_gait/Movement_trial.c3d", "plug_in_gait"),
    ],
)
def test_a_real_recording_plays(data: Path, name: str, marker_set: str) -> None:
    body = Skeleton.load(marker_set=marker_set)
    trial = read(data / name)
    tracked = MarkerIK(body).track(trial)
    learned = small_person.subject().null_space_map
    made = recording_scene(body, learned, CHAIN, tracked, trial, simulated=False)
    assert 25 < 1 / np.median(np.diff(made.times)) < 40
    found = curves(made)
    worn = {marker.label for marker in body.marker_set.markers}
    seen = {path.rsplit("/", 1)[1] for path in found if "/seen/" in path}
    assert len(seen) > 10
    assert seen <= worn
    for tracks in found.values():
        assert all(np.isfinite(values).all() for values in tracks.values())


def test_a_motion_without_a_hand_plays_and_one_of_another_recording_is_refused() -> (
    None
):
    person = small_person.subject()
    arguments = (person.skeleton, person.null_space_map, CHAIN)
    other = small_person.cut(recording(), 0, 50)
    with pytest.raises(InvalidInput, match="50 frames, found one of 100"):
        recording_scene(*arguments, motion(), other, simulated=True)
    fields = {name: getattr(motion(), name) for name in motion().__dataclass_fields__}
    unseen = {
        "q": np.where(np.arange(100)[:, None] == 0, np.nan, motion().q),
        "hand_in_thorax": np.full_like(motion().hand_in_thorax, np.nan),
    }
    made = recording_scene(
        *arguments, Motion(**fields | unseen), recording(), simulated=True
    )
    assert np.isnan(made.c).all()
    assert "NaN" not in scene_html(made).split('id="scene"')[1].split("</script>")[0]
    unknown = Motion(**fields | {"q": np.full_like(motion().q, np.nan)})
    with pytest.raises(NotEnoughData, match="no frame"):
        recording_scene(*arguments, unknown, recording(), simulated=True)


# --- the page ------------------------------------------------------------------------


def test_numbers_survive_the_way_into_the_page() -> None:
    given_array = np.random.default_rng(6).normal(size=40).astype(np.float32)
    index = np.arange(20, dtype=np.uint32)
    whole = json.loads(packed_json({"a": given_array, "i": index, "s": index[:3]}))
    a, i = (base64.b64decode(whole[key]["data"]) for key in ("a", "i"))
    assert whole["a"]["$"] == "f4"
    np.testing.assert_array_equal(np.frombuffer(a, "<f4"), given_array)
    np.testing.assert_array_equal(np.frombuffer(i, "<u4"), index)
    assert whole["s"] == [0, 1, 2]
    with pytest.raises(TypeError, match="Path"):
        packed_json(Path("x"))


def test_the_page_loads_nothing_and_says_that_it_is_simulated() -> None:
    page = scene_html(scene())
    assert "Simulated subject" in page
    assert "<h1>free &amp; &lt;easy&gt;</h1>" in page
    tags = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.S)
    assert not re.search(r"(src|href)=", tags)
    assert "default-src 'none'" in tags
    assert "connect-src" not in tags
    assert page.count("<script") == page.count("</script>") == 3
    assert "Simulated" not in re.sub(
        r"<script.*",
        "",
        scene_html(
            map_scene(
                small_person.subject().skeleton,
                small_person.subject().null_space_map,
                CHAIN,
                simulated=False,
            )
        ),
        flags=re.S,
    )


def test_the_same_scene_gives_the_same_page() -> None:
    assert scene_html(scene()) == scene_html(scene())


def test_a_minute_of_recording_makes_a_page_under_15_mb() -> None:
    tracks = packed_json([c for c in scene().commands if c["type"] == "set_animation"])
    a_frame = len(tracks) / len(scene().times)
    rest = len(scene_html(scene())) - len(tracks)
    assert rest + 60 * 33 * a_frame < 15e6  # 100 Hz is thinned to 33


# --- the picture ---------------------------------------------------------------------


def pixels(png: bytes, tmp_path: Path) -> np.ndarray:
    path = tmp_path / "picture.png"
    path.write_bytes(png)
    return matplotlib.image.imread(path)[..., :3]


def test_without_a_browser_the_picture_is_drawn_plainly_and_says_so(
    tmp_path: Path,
) -> None:
    picture = scene_picture(scene(), environ={"PATH": str(tmp_path)})
    assert picture.note is not None
    assert "apt install chromium" in picture.note
    image = pixels(picture.png, tmp_path)
    assert image.shape[:2] == (800, 1100)
    middle = image[200:600, 350:750]
    assert len(np.unique((255 * middle).reshape(-1, 3).astype(int), axis=0)) > 100


def test_a_browser_that_fails_is_named_and_the_picture_drawn_plainly(
    tmp_path: Path,
) -> None:
    broken = tmp_path / "chromium"
    broken.write_text("#!/bin/sh\nexit 1\n")
    broken.chmod(0o755)
    assert find_browser({"PATH": str(tmp_path)}) == str(broken)
    picture = scene_picture(mapped(), environ={"PATH": str(tmp_path)})
    assert picture.note is not None
    assert str(broken) in picture.note
    assert picture.png.startswith(b"\x89PNG")


def test_the_browser_named_by_the_environment_comes_first(tmp_path: Path) -> None:
    for name in ("chromium", "mine"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    environ = {"PATH": str(tmp_path), "CHROME": str(tmp_path / "mine")}
    assert find_browser(environ) == str(tmp_path / "mine")


def test_the_drawing_reads_the_scene_as_the_page_does() -> None:
    found = {path: pose for path, pose, _ in visible_nodes(scene())}
    assert not any("/sweep/" in path or "/ghosts/" in path for path in found)
    body = small_person.subject().skeleton
    row = int(np.argmin(np.abs(scene().times - scene().start)))
    q = motion().q[kept_frames(motion().time)[row]]
    place = body.link_in_thorax(q, "right_forearm")[0]
    shape = next(
        path for path in found if path.startswith(f"{ROOT}/body/right_forearm/")
    )
    offset = np.linalg.norm(found[shape][:3, 3] - place)
    # The forearm's first shape is its cylinder, which starts half way down.
    half = body.segment_lengths["right_forearm"] / 2
    assert offset == pytest.approx(half, abs=1e-6)
