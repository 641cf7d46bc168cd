"""The body as a model of OpenSim, with the coordinates of the written motions."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from ikns.arrays import Array
from ikns.body.skeleton import Skeleton
from ikns.motion.gimbal import xyz_angles
from ikns.numerics.rigid import turn_to

#: Version of the format: OpenSim 4.0, which later ones read.
_VERSION = "40000"
#: Standard gravity, m/s^2, as OpenSim has it.
_GRAVITY = 9.80665
#: OpenSim's cylinders lie along y, those of a URDF along z.
_Y_TO_Z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def opensim_model(skeleton: Skeleton, up: Array | None = None) -> str:
    """Return the text of an .osim file.

    Parameters
    ----------
    skeleton : Skeleton
        Links become bodies with their mass, inertia and shape, revolute joints
        PinJoints with one coordinate of the same name, the thorax's free flyer a
        FreeJoint with ``thorax_rx`` to ``thorax_tz``, and markers are carried along.
    up : (3,) array, optional
        Unit vector up in the laboratory, which is the model's ground; without it,
        gravity is OpenSim's own, along -Y.

    Returns
    -------
    str
        XML. The model has neither muscles nor forces.
    """
    robot = ET.fromstring(skeleton.urdf)
    joints = {_of(joint, "child", "link"): joint for joint in robot.iter("joint")}
    links = {str(link.get("name")): link for link in robot.iter("link")}
    document = ET.Element("OpenSimDocument", Version=_VERSION)
    model = _part(document, "Model", robot.get("name", "body"))
    if up is not None:
        # Adding 0 leaves no -0.
        _text(model, "gravity", _numbers(-_GRAVITY * np.asarray(up) + 0.0))
    bodies = ET.SubElement(_part(model, "BodySet", "bodyset"), "objects")
    for name, link in links.items():
        _body(bodies, name, link)
    every = ET.SubElement(_part(model, "JointSet", "jointset"), "objects")
    for name in links:
        if name in joints:
            _joint(every, joints[name])
        else:
            _free_joint(every, name)
    markers = ET.SubElement(_part(model, "MarkerSet", "markerset"), "objects")
    for marker in skeleton.marker_set.markers:
        one = _part(markers, "Marker", marker.label)
        _text(one, "socket_parent_frame", f"/bodyset/{marker.link}")
        _text(one, "location", _numbers(marker.position))
        _text(one, "fixed", "true")
    ET.indent(document)
    return ET.tostring(document, encoding="unicode", xml_declaration=True) + "\n"


def _body(bodies: ET.Element, name: str, link: ET.Element) -> None:
    body = _part(bodies, "Body", name)
    shapes = ET.SubElement(body, "components")
    for k, visual in enumerate(link.iter("visual")):
        _shape(shapes, f"{name}_{k}", name, visual)
    inertial = link.find("inertial")
    if inertial is None:  # OpenSim has no bodies without mass
        _text(body, "mass", "1e-3")
        _text(body, "inertia", "1e-6 1e-6 1e-6 0 0 0")
        return
    _text(body, "mass", _of(inertial, "mass", "value"))
    _text(body, "mass_center", _of(inertial, "origin", "xyz"))
    inertia = inertial.find("inertia")
    assert inertia is not None
    axes = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    _text(body, "inertia", " ".join(inertia.get(axis, "0") for axis in axes))


def _shape(shapes: ET.Element, name: str, link: str, visual: ET.Element) -> None:
    place, turn = _origin(visual)
    round_, long = visual.find("geometry/sphere"), visual.find("geometry/cylinder")
    if long is not None:
        turn = turn @ _Y_TO_Z
    frame = _frame(shapes, name, f"/bodyset/{link}", place, turn)
    drawn = ET.SubElement(frame, "attached_geometry")
    if round_ is not None:
        _text(_part(drawn, "Sphere", "shape"), "radius", round_.get("radius", ""))
    elif long is not None:
        shape = _part(drawn, "Cylinder", "shape")
        _text(shape, "radius", long.get("radius", ""))
        _text(shape, "half_height", f"{float(long.get('length', '0')) / 2:.9g}")


def _joint(every: ET.Element, joint: ET.Element) -> None:
    """Add a joint; a pin turns about z, so both its frames have z along the axis."""
    name, kind = str(joint.get("name")), joint.get("type")
    parent, child = _of(joint, "parent", "link"), _of(joint, "child", "link")
    place, turn = _origin(joint)
    turning = kind != "fixed"
    made = _part(every, "PinJoint" if turning else "WeldJoint", name)
    _sockets(made, "parent_offset", "child_offset")
    axis = np.eye(3)
    if turning:
        axis = turn_to(np.array(_vector(_of(joint, "axis", "xyz"))))
        limit = joint.find("limit")
        range_ = [] if limit is None else [limit.get("lower"), limit.get("upper")]
        _coordinate(ET.SubElement(made, "coordinates"), name, range_)
    frames = ET.SubElement(made, "frames")
    _frame(frames, "parent_offset", f"/bodyset/{parent}", place, turn @ axis)
    _frame(frames, "child_offset", f"/bodyset/{child}", np.zeros(3), axis)


def _free_joint(every: ET.Element, link: str) -> None:
    joint = _part(every, "FreeJoint", f"{link}_in_ground")
    _sockets(joint, "/ground", f"/bodyset/{link}")
    coordinates = ET.SubElement(joint, "coordinates")
    for kind in "rt":
        for axis in "xyz":
            _coordinate(coordinates, f"{link}_{kind}{axis}", [])


def _coordinate(parent: ET.Element, name: str, limits: list[str | None]) -> None:
    made = _part(parent, "Coordinate", name)
    if limits:
        _text(made, "range", " ".join(str(value) for value in limits))
    # A measured motion may go a little beyond the range of people.
    _text(made, "clamped", "false")


def _sockets(joint: ET.Element, parent: str, child: str) -> None:
    _text(joint, "socket_parent_frame", parent)
    _text(joint, "socket_child_frame", child)


def _frame(
    parent: ET.Element, name: str, of: str, place: Array, turn: Array
) -> ET.Element:
    made = _part(parent, "PhysicalOffsetFrame", name)
    _text(made, "socket_parent", of)
    _text(made, "translation", _numbers(place))
    _text(made, "orientation", _numbers(xyz_angles(turn[None])[0]))
    return made


def _origin(part: ET.Element) -> tuple[Array, Array]:
    """Place (3,) m and rotation (3, 3) of a joint or shape; rpy is about fixed axes."""
    origin = part.find("origin")
    if origin is None:
        return np.zeros(3), np.eye(3)
    from scipy.spatial.transform import Rotation  # takes a while to load

    turn = Rotation.from_euler("xyz", _vector(origin.get("rpy", "0 0 0")))
    return np.array(_vector(origin.get("xyz", "0 0 0"))), turn.as_matrix()


def _vector(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _numbers(values: Array | tuple[float, ...]) -> str:
    return " ".join(f"{value:.12g}" for value in values)


def _of(part: ET.Element, tag: str, name: str) -> str:
    found = part.find(tag)
    return "" if found is None else found.get(name, "")


def _part(parent: ET.Element, kind: str, name: str) -> ET.Element:
    return ET.SubElement(parent, kind, name=name)


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = text
