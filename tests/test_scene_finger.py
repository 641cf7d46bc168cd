"""The finger in the 3-D view bends as its URDF and its closed form say."""

import json
import urllib.request
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import small_person
from hypothesis import given
from hypothesis import strategies as st

from ikns.body.chains import chain_joints
from ikns.body.model_file import segment_lengths, urdf_folder
from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.finger.geometry import joint_angles, opening
from ikns.live.runtime.report import AxisStatus
from ikns.nullspace.map import NullSpaceMap
from ikns.view.scene import LiveView, body_view, map_scene, with_finger
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


#: Which joint each freedom reads, and the arm that so wears its finger.
TWO = {
    "right_arm": {
        "right_shoulder_flexion": "right",
        "right_forearm_pronation": "right",
    },
    "both_arms": {
        "left_shoulder_flexion": "left",
        "right_shoulder_flexion": "right",
    },
}


@pytest.mark.parametrize(
    ("chain", "dofs"), [("right_arm", (2, 1)), ("both_arms", (1, 2))]
)
def test_the_live_view_shows_each_of_several_fingers(
    chain: str, dofs: tuple[int, int]
) -> None:
    joints, body = chain_joints(chain), Skeleton.load()
    rows = np.eye(len(joints))[[joints.index(name) for name in TWO[chain]]]
    points = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    Z, ends = np.tile(rows, (8, 1, 1)), np.ones((8, 2))
    person = Subject(body, NullSpaceMap.from_arrays(points, Z, -ends, ends), chain, {})
    # Finger 1 measures its flexion, finger 2 does not.
    known = {1: (0.25, 0.9, 0.5), 2: (0.75, 0.125, np.nan)}
    status: Any = SimpleNamespace(
        q=body.neutral(),
        time=1.0,
        axes=tuple(
            AxisStatus(dof, c=known[dof][0], uncertainty=0.0,
                       flexion=known[dof][1], measured=known[dof][2])
            for dof in dofs
        ),
    )  # fmt: skip
    with body_view(person, simulated=True, name="two", dofs=dofs) as (view, take):
        page = view.url.replace("?", "frames?")
        with urllib.request.urlopen(page, timeout=10) as stream:
            take(status)
            line = next(line for line in stream if line.startswith(b"data: "))
        panel = urllib.request.Request(view.url, headers={"Sec-Fetch-Dest": "iframe"})
        with urllib.request.urlopen(panel, timeout=10) as answer:
            html = answer.read().decode()
    frame = json.loads(line[6:])
    assert frame["c"] == [known[dof][0] for dof in dofs]
    assert f'"signals":["c_{dofs[0]}","c_{dofs[1]}"]' in html
    moved = local(frame["commands"])
    places = []
    for (number, flexion), side in zip(
        {1: 0.5, 2: 0.125}.items(), TWO[chain].values(), strict=True
    ):
        base = finger_path(side, number)
        for path, pose in local(flexion_commands(base, flexion)).items():
            np.testing.assert_allclose(moved[path], pose, atol=5.1e-7)
        places.append(local(drawn(html))[base][:3, 3])
    # Side by side on one forearm, where a base is 34 mm wide.
    if chain == "right_arm":
        apart = np.linalg.norm(places[0] - places[1])
        assert apart == pytest.approx(0.04, abs=1e-6)


def drawn(html: str) -> Any:
    """Return the commands that a page holds."""
    start = html.index('type="application/json">') + len('type="application/json">')
    return json.loads(html[start : html.index("</script>", start)])["commands"]
