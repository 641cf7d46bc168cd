"""The finger in the 3-D view bends as its URDF and its closed form say."""

import json
import urllib.request

import numpy as np
import pinocchio as pin
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st

from ikns.body.model_file import segment_lengths, urdf_folder
from ikns.finger.geometry import joint_angles, opening
from ikns.view.scene import LiveView, map_scene, with_finger
from ikns.view.scene.drawing import visible_nodes
from ikns.view.scene.finger import finger_path, flexion_commands

#: Poses are products of seven matrices of doubles of size 1.
ROUNDING = 1e-14


def local(commands):
    return {
        c["path"]: np.reshape(c["matrix"], (4, 4)).T
        for c in commands
        if c["type"] == "set_transform"
    }


def in_base(flexion: float) -> list[np.ndarray]:
    """Pose of every module in the finger's base."""
    poses = [np.eye(4)]
    for _, pose in sorted(local(flexion_commands("base", flexion)).items()):
        poses.append(poses[-1] @ pose)
    return poses[1:]


@given(st.floats(0, 1))
def test_modules_stand_where_pinocchio_puts_them(flexion: float) -> None:
    model = pin.buildModelFromUrdf(str(urdf_folder() / "finger.urdf"))
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(joint_angles(flexion)))
    for k, pose in enumerate(in_base(flexion), start=1):
        placed = data.oMf[model.getFrameId(f"module_{k}")]
        np.testing.assert_allclose(pose, placed.homogeneous, atol=ROUNDING)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("flexion", [0.0, 0.4, 1.0])
def test_it_is_worn_at_the_wrist_and_its_tip_is_the_opening_above_the_palm(
    side: str, flexion: float
) -> None:
    person = small_person.subject()
    scene = with_finger(
        map_scene(person.skeleton, person.null_space_map, person.chain, simulated=True),
        person.skeleton,
        side,
    )
    in_forearm = local(scene.commands)[finger_path(side)]
    # The URDF's tip is one module, 25 mm, beyond the last joint.
    tip = in_forearm @ in_base(flexion)[-1] @ [0.025, 0, 0, 1]
    hand = 0.028  # thickness in urdf/upper_body.urdf
    # The palm of the hanging arm faces the thigh.
    away = {"right": -tip[2], "left": tip[2]}[side]
    assert away - hand / 2 == pytest.approx(opening(flexion), abs=ROUNDING)
    wrist = segment_lengths(person.skeleton.urdf)[f"{side}_forearm"]
    assert in_forearm[1, 3] == -wrist
    assert np.linalg.det(in_forearm[:3, :3]) == pytest.approx(1)
    drawn = [path for path, *_ in visible_nodes(scene)]
    # Base, six modules, and the post that carries them.
    assert sum(path.startswith(finger_path(side)) for path in drawn) == 8


def test_the_live_view_bends_it() -> None:
    person = small_person.subject()
    scene = with_finger(
        map_scene(person.skeleton, person.null_space_map, person.chain, simulated=True),
        person.skeleton,
        "right",
    )
    found = []
    with LiveView(scene, person.skeleton) as view:
        with urllib.request.urlopen(
            view.url.replace("?", "frames?"), timeout=10
        ) as stream:
            for flexion in (0.5, np.nan):
                view.show(person.skeleton.neutral(), flexion=flexion)
                line = next(line for line in stream if line.startswith(b"data: "))
                found.append(local(json.loads(line[6:])["commands"]))
    bent = local(flexion_commands(finger_path("right"), 0.5))
    for path, pose in bent.items():
        # The page gets six decimals.
        np.testing.assert_allclose(found[0][path], pose, atol=5.1e-7)
        assert path not in found[1]  # stays as it was
