"""The grasp as a MuJoCo model: table, object, and a hand that carries the finger.

World: origin on the table under the object, X away from the person, Z up. The gripper's
frame is that of ``urdf/finger.urdf``: X along the straight finger, Y from the palm to
it, which is to the left for a right hand and to the right for a left one. The palm is a
plate opposite the finger; the heel of the hand is a second plate, from the palm to the
finger's base. The object is squeezed into their corner.

The hand is a body that a stiff weld moves to the commanded pose: contacts then see its
velocity, which a directly positioned body would not have.
"""

from __future__ import annotations

from typing import Any

from ikns.errors import InvalidInput
from ikns.finger.geometry import WIDEST
from ikns.finger.simulated import YIELD
from ikns.simulation.grasp.parts import Solid, constant, finger_parts, hand_size

#: Mass of hand and forearm, kg: the weld carries it, and no result depends on it.
_CARRIER = 1.5
#: Space between palm and straight finger, m.
CLEAR = WIDEST - finger_parts()[1].box[1] / 2
#: Length of palm and forearm behind the finger's base, m: as far as contacts occur.
_BACK = 0.06
#: Impedance of contacts and limits: nearly rigid beyond a depth of 1 mm.
_SOLIMP = [0.95, 0.99, 0.001, 0.5, 2.0]
#: Contacts of hand and finger, not with each other: torsional friction, no rolling.
_GRIP = {"priority": 1, "condim": 4, "contype": 2, "conaffinity": 1}


def grip_height(solid: Solid) -> float:
    """Return the height of the finger above the table: half the object's if possible.

    >>> grip_height(Solid("cylinder", (0.075, 0.25), 0.2))
    0.125
    """
    lowest = hand_size()[1] / 2 + constant("clearance")
    return max(solid.extent[2] / 2, lowest)


def object_in_gripper(solid: Solid) -> tuple[float, float]:
    """Return the object's middle along X and Y of the gripper before the grasp, m."""
    depth, width, _ = solid.extent
    gap = min(constant("gap"), max(CLEAR - width, 0.0) / 2)
    return constant("gap") + depth / 2, gap + width / 2 - WIDEST


def world_model(
    solid: Solid,
    *,
    side: str = "right",
    friction: float | None = None,
    effort: float = 0.5,
    gravity: float = 9.81,
) -> Any:
    """Build the model, with the hand around the object and the finger straight.

    `friction` replaces that of hand and finger in ``contact.toml``; `effort` is the
    largest pull of the tendon, as a share of the URDF's torque. The mujoco.MjModel has
    bodies "guide" (its pose is the command), "hand", the links of the finger, "object";
    geom "table"; actuator "tendon", with the motor's flexion as control.
    """
    import mujoco

    if side not in ("right", "left"):
        raise InvalidInput(f"expected a side of right or left, found '{side}'.")
    spec = mujoco.MjSpec()
    spec.modelname = "simulated grasp"
    spec.compiler.degree = False
    spec.compiler.autolimits = True
    option = spec.option
    option.timestep = constant("timestep")
    option.gravity = [0.0, 0.0, -gravity]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = constant("stickiness")
    default = spec.default.geom
    default.solref = [constant("contact_time"), 1.0]
    default.solimp = _SOLIMP
    world = spec.worldbody
    world.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.1],
        friction=_friction(constant("friction_table")),
        condim=6 if solid.shape == "sphere" else 3,  # only a ball rolls
    )
    thing = world.add_body(name="object", pos=[0, 0, solid.extent[2] / 2])
    thing.add_freejoint(name="object")
    thing.add_geom(name="object", mass=solid.mass, friction=[0, 0, 0], **_shape(solid))
    x, y = object_in_gripper(solid)
    turn = 1.0 if side == "right" else -1.0
    place = {
        "pos": [-x, -turn * y, grip_height(solid)],
        "quat": [1, 0, 0, 0] if turn > 0 else [0, 1, 0, 0],
    }
    world.add_body(name="guide", mocap=True, **place)
    hand = world.add_body(name="hand", gravcomp=1.0, **place)
    hand.add_freejoint(name="hand")
    hand.mass, hand.ipos = _CARRIER, [0, -WIDEST / 2, 0]
    hand.inertia, hand.explicitinertial = [5e-3] * 3, True
    skin = constant("friction_hand") if friction is None else friction
    _plates(hand, _friction(skin))
    weld = spec.add_equality(
        name="weld",
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="guide",
        name2="hand",
    )
    weld.solref = [2 * constant("timestep"), 1.0]
    weld.solimp = _SOLIMP
    _finger(
        spec,
        hand,
        friction=constant("friction_finger") if friction is None else friction,
        effort=effort,
    )
    return spec.compile()


def _finger(spec: Any, hand: Any, *, friction: float, effort: float) -> None:
    import mujoco

    base, *modules = finger_parts()
    body = hand
    tendon = spec.add_tendon(name="tendon")
    full = sum(module.upper for module in modules)
    for part in (base, *modules):
        body = body.add_body(name=part.name, pos=part.origin)
        body.mass, body.ipos, body.inertia = part.mass, part.center, part.inertia
        body.explicitinertial = True
        if part is base:
            body.gravcomp = 1.0
        body.add_geom(
            name=part.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[edge / 2 for edge in part.box],
            pos=part.box_at,
            friction=_friction(friction),
            **_GRIP,
        )
        if part is base:
            continue
        body.add_joint(
            name=part.joint,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=part.axis,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE,
            range=[0.0, part.upper],
            stiffness=constant("spring"),
            damping=constant("damping"),
            armature=constant("armature"),
            solref_limit=[2 * constant("timestep"), 1.0],
            solimp_limit=_SOLIMP,
        )
        # Length 1 is full flexion, so one unit of force is 1 / full N m at each joint.
        tendon.wrap_joint(part.joint, 1 / full)
    torque = modules[0].effort * full
    stiff = torque / YIELD
    spec.add_actuator(
        name="tendon",
        target="tendon",
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        gainprm=[stiff] + [0.0] * 9,
        biasprm=[0.0, -stiff, -constant("tendon_damping")] + [0.0] * 7,
        forcerange=[0.0, effort * torque],  # a tendon only pulls
    )


def _plates(hand: Any, friction: list[float]) -> None:
    import mujoco

    length, breadth, thickness = hand_size()
    # The palm begins behind the heel's surface, and reaches as far as the fingers'
    # middle joints: objects of a decimeter lie on it.
    front = 2 * length
    plates = {
        "palm": (
            [(front - _BACK) / 2, -WIDEST - thickness / 2, 0],
            [(front + _BACK) / 2, thickness / 2, breadth / 2],
        ),
        "heel": (
            [-_BACK / 2, -WIDEST / 2 - 0.01, 0],
            [_BACK / 2, WIDEST / 2 - 0.01, breadth / 2],
        ),
    }
    for name, (at, half) in plates.items():
        hand.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=at,
            size=half,
            friction=friction,
            **_GRIP,
        )


def _shape(solid: Solid) -> dict[str, Any]:
    import mujoco

    depth, width, height = solid.extent
    if solid.shape == "box":
        kind, size = mujoco.mjtGeom.mjGEOM_BOX, [depth / 2, width / 2, height / 2]
    elif solid.shape == "cylinder":
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [depth / 2, height / 2, 0]
    else:
        kind, size = mujoco.mjtGeom.mjGEOM_SPHERE, [depth / 2, 0, 0]
    return {"type": kind, "size": size}


def _friction(sliding: float) -> list[float]:
    rolling = constant("rolling") if sliding else 0.0
    torsion = constant("torsion") * sliding
    return [sliding, torsion, rolling * sliding]
