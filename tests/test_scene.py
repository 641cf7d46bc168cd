"""A scene as data: what is drawn stands where the skeleton says.

Poses are products of a few rotations, each rounded to 2e-16 of a body's meter: 1e-12
is far above that and far below anything drawn. What a page stores as float32 is
rounded to 6e-8 of its size, which is 1 m at most: 1e-7.
"""

import xml.etree.ElementTree as ET
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.errors import FileError, InvalidInput
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.self_motion import (
    posture_at_point,
    postures_along,
)
from ikns.view.scene import Scene, map_scene
from ikns.view.scene.body import (
    arm_links,
    body_commands,
    drawn_links,
    ghost_commands,
    marker_commands,
)
from ikns.view.scene.commands import ROOT, line_mesh
from ikns.view.scene.places import _TRAIL_STEP, _thinned, point_commands
from ikns.view.scene.shapes import visual_shapes
from ikns.view.style import point_color

CHAIN = "right_arm"


@cache
def skeleton() -> Skeleton:
    return Skeleton.from_anthropometry(1.9, 90, "male")


def posture(seed: int = 0) -> np.ndarray:
    """Joint angles within the limits, thorax somewhere in the world, (25,)."""
    rng = np.random.default_rng(seed)
    body = skeleton()
    turn = Rotation.random(random_state=seed).as_quat()
    return np.concatenate(
        [rng.normal(size=3), turn, rng.uniform(body.lower, body.upper)]
    )


def poses(commands: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Pose of each node in the thorax frame, (4, 4)."""
    local = {
        command["path"]: np.reshape(command["matrix"], (4, 4)).T
        for command in commands
        if command["type"] == "set_transform" and command["path"] != ROOT
    }
    found = {}
    for path in {command["path"] for command in commands if "path" in command}:
        pose, steps = np.eye(4), path.split("/")
        for k in range(2, len(steps)):
            pose = pose @ local.get("/".join(steps[: k + 1]), np.eye(4))
        found[path] = pose
    return found


def objects(commands: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {c["path"]: c["object"] for c in commands if c["type"] == "set_object"}


# --- the body ------------------------------------------------------------------------


def test_links_stand_where_the_skeleton_says() -> None:
    q = posture()
    found = poses(body_commands(skeleton(), q, CHAIN))
    for link in drawn_links(skeleton()):
        position, rotation = skeleton().link_in_thorax(q, link)
        pose = found[f"{ROOT}/body/{link}"]
        np.testing.assert_allclose(pose[:3, 3], position, atol=1e-12)
        np.testing.assert_allclose(pose[:3, :3], rotation, atol=1e-12)


def test_shapes_lie_on_their_links_as_pinocchio_reads_them() -> None:
    body = skeleton()
    model = pin.buildModelFromXML(body.urdf, pin.JointModelFreeFlyer())
    read = pin.buildGeomFromUrdfString(model, body.urdf, pin.GeometryType.VISUAL)
    ours = visual_shapes(body.urdf)
    # Pinocchio names a shape by its link and counts the link's shapes.
    theirs = {shape.name: shape for shape in read.geometryObjects}
    assert len(ours) == len(theirs) > 0
    numbers: dict[str, int] = {}
    for shape in ours:
        number = numbers.setdefault(shape.link, 0)
        numbers[shape.link] += 1
        other = theirs[f"{shape.link}_{number}"]
        frame = model.frames[other.parentFrame].placement
        placed = (frame.inverse() * other.placement).homogeneous
        kind = type(other.geometry).__name__
        turn = np.eye(4)
        if kind == "Cylinder":  # theirs stands along Z, three.js's along Y
            turn[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
            assert shape.geometry["radiusTop"] == other.geometry.radius
            assert shape.geometry["height"] == pytest.approx(
                2 * other.geometry.halfLength, rel=1e-15
            )
        elif kind == "Sphere":
            assert shape.geometry["radius"] == other.geometry.radius
        else:
            size = [shape.geometry[k] for k in ("width", "height", "depth")]
            np.testing.assert_allclose(size, 2 * other.geometry.halfSide, rtol=1e-15)
        np.testing.assert_allclose(shape.in_link, placed @ turn, atol=1e-12)


def test_a_scaled_body_has_scaled_shapes() -> None:
    generic, longer = Skeleton.load(), Skeleton.load().resized({"right_forearm": 1.5})
    for before, after in zip(
        visual_shapes(generic.urdf), visual_shapes(longer.urdf), strict=True
    ):
        factor = 1.5 if before.link == "right_forearm" else 1.0
        np.testing.assert_allclose(
            after.in_link[:3, 3], factor * before.in_link[:3, 3], rtol=1e-8
        )
        for name in ("radius", "radiusTop", "height", "width"):
            if name in before.geometry:
                # A URDF is written with nine digits.
                assert after.geometry[name] == pytest.approx(
                    factor * before.geometry[name], rel=1e-8
                )


@pytest.mark.parametrize("broken", ['size="1 2"', "", 'size="a b c"'])
def test_a_shape_without_its_size_is_refused(broken: str) -> None:
    urdf = f"<robot><link name='a'><visual><geometry><box {broken}/></geometry>"
    with pytest.raises(FileError, match="shapes"):
        visual_shapes(urdf + "</visual></link></robot>")


def test_a_mesh_is_left_out() -> None:
    robot = ET.fromstring(Skeleton.load().urdf)
    shape = robot.find("link/visual/geometry")
    assert shape is not None
    shape[0].tag = "mesh"
    left = visual_shapes(ET.tostring(robot, encoding="unicode"))
    assert len(left) == len(visual_shapes(Skeleton.load().urdf)) - 1


def test_markers_sit_on_the_body_where_the_skeleton_wears_them() -> None:
    # A free flyer at the origin makes the world the thorax's frame.
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1.0], posture()[7:]])
    commands = body_commands(skeleton(), q, CHAIN) + marker_commands(skeleton())
    found = poses(commands)
    places = skeleton().markers_in_world(q)
    worn = skeleton().marker_set.markers
    for marker, place in zip(worn, places, strict=True):
        path = f"{ROOT}/body/{marker.link}/markers/{marker.label}"
        np.testing.assert_allclose(found[path][:3, 3], place, atol=1e-12)
        assert path in objects(commands)


# --- the map's own person ------------------------------------------------------------


@cache
def person() -> tuple[Skeleton, NullSpaceMap]:
    made = small_person.subject()
    return made.skeleton, made.null_space_map


def test_nothing_plays_where_the_range_is_empty() -> None:
    body, learned = person()
    still = NullSpaceMap.from_arrays(
        learned.centers_,
        0 * learned.directions_,
        0 * learned.lower_,
        0 * learned.upper_,
    )
    scene = map_scene(body, still, CHAIN, simulated=True)
    assert len(scene.times) == 0
    assert all(command["type"] != "set_animation" for command in scene.commands)


def test_ghosts_are_arms_at_their_postures() -> None:
    body, learned = person()
    q = posture_at_point(body, learned, CHAIN, 3)
    ghosts = postures_along(body, learned, CHAIN, 3, q, np.array([-0.2, 0.0, 0.5, 1.0]))
    links = arm_links(body, CHAIN)
    assert links == ["right_upper_arm", "right_forearm", "right_hand"]
    commands = ghost_commands(
        "/ikns/g", body, ghosts, links, "red", opacity=0.2, first_layer=7
    )
    found, drawn = poses(commands), objects(commands)
    for k, ghost in enumerate(ghosts):
        for link in links:
            place = body.link_in_thorax(ghost, link)[0]
            np.testing.assert_allclose(
                found[f"/ikns/g/{k}/{link}"][:3, 3], place, atol=1e-12
            )
        # What overlaps within a ghost is drawn once: one number a ghost.
        layers = {
            entry["materials"][0]["stencilRef"]
            for path, entry in drawn.items()
            if path.startswith(f"/ikns/g/{k}/")
        }
        assert layers == {7 + k}


# --- points, volume, trail -----------------------------------------------------------


def test_points_have_their_place_color_and_number() -> None:
    centers = np.random.default_rng(1).normal(size=(9, 3))
    commands = point_commands(centers)
    found, drawn = poses(commands), objects(commands)
    for k, center in enumerate(centers):
        path = f"{ROOT}/points/{k + 1}"
        np.testing.assert_allclose(found[path][:3, 3], center, atol=1e-12)
        red, green, blue = (round(255 * x) for x in point_color(k))
        color = drawn[path]["materials"][0]["color"]
        assert color == (red << 16) + (green << 8) + blue
        assert drawn[f"{path}/number"]["textures"][0]["text"] == str(k + 1)
        away = np.linalg.norm(found[f"{path}/number"][:3, 3] - center)
        assert 0.011 < away < 0.05  # beside the ball


def test_the_volume_is_the_hull_of_the_points() -> None:
    body, learned = person()
    drawn = objects(map_scene(body, learned, CHAIN, simulated=True).commands)
    data = drawn[f"{ROOT}/volume/faces"]["geometries"][0]["data"]
    faces = data["index"]["array"].reshape(-1, 3)
    vertices = data["attributes"]["position"]["array"].reshape(-1, 3)
    np.testing.assert_allclose(vertices, learned.centers_, atol=1e-7)
    a, b, c = learned.centers_[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    # Every point lies on one side of each face.
    side = np.einsum("fk,fpk->fp", normal, learned.centers_[None] - a[:, None])
    assert ((side > -1e-12).all(axis=1) | (side < 1e-12).all(axis=1)).all()


def test_a_line_is_a_tube_that_a_gap_breaks() -> None:
    rng = np.random.default_rng(2)
    ends = rng.normal(size=(2, 2, 3))
    runs = [a + np.linspace(0, 1, 7)[:, None] * (b - a) for a, b in ends]
    points = np.concatenate([runs[0], np.full((1, 3), np.nan), runs[1]])
    data = line_mesh(points, radius=0.1)["data"]
    vertices = data["attributes"]["position"]["array"].reshape(-1, 3).astype(float)
    faces = data["index"]["array"].reshape(-1, 3)
    half = len(vertices) // 2
    assert ((faces < half).all(axis=1) | (faces >= half).all(axis=1)).all()
    for run, part in ((0, vertices[:half]), (1, vertices[half:])):
        a, b = ends[run]
        along = (b - a) / np.linalg.norm(b - a)
        across = part - a - ((part - a) @ along)[:, None] * along
        # Within float32 of coordinates of a few meters.
        np.testing.assert_allclose(np.linalg.norm(across, axis=1), 0.1, atol=1e-6)
    corner = vertices[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    middle = corner.mean(axis=1)
    own = np.where((faces[:, 0] < half)[:, None, None], ends[0], ends[1])
    axis = own[:, 1] - own[:, 0]
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    outward = middle - own[:, 0]
    outward -= np.sum(outward * axis, axis=1, keepdims=True) * axis
    assert (np.sum(normal * outward, axis=1) > 0).all()


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((3, 3), np.nan)])
def test_a_line_without_points_is_empty(points: np.ndarray) -> None:
    data = line_mesh(points, radius=0.1)["data"]
    assert data["index"]["array"].size == 0


steps = arrays(
    float, (30, 3), elements=st.one_of(st.floats(-0.004, 0.004), st.just(np.nan))
)


@given(steps)
def test_a_thinned_trail_stays_within_a_step_of_the_whole(moves: np.ndarray) -> None:
    known = np.isfinite(moves).all(axis=1)
    places = np.cumsum(np.where(known[:, None], moves, 0), axis=0)
    places[~known] = np.nan
    kept = _thinned(places, _TRAIL_STEP)
    drawn = kept[np.isfinite(kept).all(axis=1)]
    for place in places[known]:
        # Left out is only what lies nearer than a step to what was kept before.
        assert np.linalg.norm(drawn - place, axis=1).min() < _TRAIL_STEP
        assert len(drawn) <= known.sum()


# --- the whole -----------------------------------------------------------------------


def made(**options: Any) -> Scene:
    return map_scene(*person(), CHAIN, **{"simulated": True} | options)


def test_the_same_map_gives_the_same_scene() -> None:
    first, second = made(), made()
    np.testing.assert_equal(first.commands, second.commands)


def test_a_layer_that_is_off_is_hidden_and_every_layer_draws_something() -> None:
    scene = made()
    drawn = objects(scene.commands)
    hidden = {
        command["path"]
        for command in scene.commands
        if command.get("property") == "visible" and command["path"].startswith(ROOT)
    }
    assert hidden == {
        p for layer in scene.layers if not layer.shown for p in layer.paths
    }
    for layer in scene.layers:
        for path in layer.paths:
            assert any(node.startswith(f"{path}/") for node in drawn), path


def test_the_camera_is_in_front_on_the_side_of_the_arm_and_sees_the_points() -> None:
    scene = made()
    forward, up, right = scene.camera - scene.target
    assert forward > 0
    assert up > 0
    assert right > 0
    way = scene.target - scene.camera
    to = person()[1].centers_ - scene.camera
    cosine = to @ way / np.linalg.norm(to, axis=1) / np.linalg.norm(way)
    assert np.degrees(np.arccos(cosine)).max() < 14  # half the angle of view


def test_an_unknown_point_is_refused() -> None:
    with pytest.raises(InvalidInput, match="from 1 to 10, found 11"):
        made(point=10)


def test_a_map_from_a_file_tells_that_the_posture_is_assumed() -> None:
    body, learned = person()
    assert "assumed" not in made().caption  # fitted just now, it knows the posture
    arrays = learned.centers_, learned.directions_, learned.lower_, learned.upper_
    read = NullSpaceMap.from_arrays(*arrays)
    assert "assumed" in map_scene(body, read, CHAIN, simulated=True).caption


def test_three_points_have_no_volume_and_none_in_the_legend() -> None:
    body, learned = person()
    arrays = learned.centers_, learned.directions_, learned.lower_, learned.upper_
    few = NullSpaceMap.from_arrays(*(values[:3] for values in arrays))
    scene = map_scene(body, few, CHAIN, simulated=True)
    assert all("volume" not in layer.name for layer in scene.layers)
    assert not any("volume" in command.get("path", "") for command in scene.commands)
