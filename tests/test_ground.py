"""Ground, axes and scale of the 3-D view, and on which side of the hand the finger is.

Vertices are stored as float32, which rounds coordinates of a meter to 6e-8 m.
"""

import numpy as np
import pytest
import small_person

from ikns.body.skeleton import Skeleton
from ikns.view.scene import map_scene, with_finger
from ikns.view.scene.finger import finger_path
from ikns.view.scene.ground import ground_commands

FLOAT32 = 1e-6


def vertices(path: str, commands: list[dict]) -> np.ndarray:
    (made,) = [
        c for c in commands if c["type"] == "set_object" and c["path"].endswith(path)
    ]
    data = made["object"]["geometries"][0]["data"]
    return data["attributes"]["position"]["array"].reshape(-1, 3).astype(float)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("low", [-0.1, -0.6])
def test_ground_lies_below_and_scale_and_axes_have_their_length(
    side: float, low: float
) -> None:
    places = np.array([[0.3, low, 0.1], [np.nan] * 3, [0.5, 0.2, 0.4]])
    camera, target = np.array([2.0, 0.5, 1.5 * side]), np.array([0.2, 0.0, 0.1])
    commands = ground_commands(places, camera, target)
    grid = vertices("/grid", commands)
    assert grid[:, 1].max() < min(low, -0.23)  # the drawn trunk ends there
    # Lines every 10 cm: 9 places of vertices along x that lie on lines across.
    across = np.unique(np.round(grid[:, 0], 2))
    assert {round(float(x) % 0.1, 2) for x in across} <= {0.0, 0.1}
    assert np.ptp(grid[:, 0]) == pytest.approx(0.8, abs=0.002)  # radius of lines
    assert np.ptp(vertices("/scale", commands)[:, 2]) == pytest.approx(0.2, abs=FLOAT32)
    (text,) = [
        c["object"]["textures"][0]["text"]
        for c in commands
        if c.get("path", "").endswith("/scale_text") and c["type"] == "set_object"
    ]
    assert text == "20 cm"
    for axis, name in enumerate(("forward", "up", "right")):
        line = vertices(f"/{name}", commands)
        assert np.argmax(np.ptp(line, axis=0)) == axis
        assert np.ptp(line[:, axis]) == pytest.approx(0.1, abs=FLOAT32)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_finger_is_where_the_palm_goes_when_the_wrist_flexes(side: str) -> None:
    body = Skeleton.load()
    scene = with_finger(
        map_scene(
            body, small_person.subject().null_space_map, f"{side}_arm", simulated=True
        ),
        body,
        side,
    )
    (pose,) = [
        np.reshape(c["matrix"], (4, 4)).T
        for c in scene.commands
        if c["type"] == "set_transform" and c["path"] == finger_path(side)
    ]
    q = np.zeros(18)
    position, rotation = body.link_in_thorax(q, f"{side}_forearm")
    wrist = body.link_in_thorax(q, f"{side}_hand")[0]
    base = position + rotation @ pose[:3, 3]
    straight = body.link_in_thorax(q, f"{side}_knuckle")[0]
    q[body.joint_names.index(f"{side}_wrist_flexion")] = 0.5
    bent = body.link_in_thorax(q, f"{side}_knuckle")[0]
    moved = (bent - straight) / np.linalg.norm(bent - straight)
    away = (base - wrist) / np.linalg.norm(base - wrist)
    # An arc of 0.5 rad leaves its tangent by half of that.
    assert moved @ away > np.cos(0.26)
