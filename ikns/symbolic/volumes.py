"""Capsules around the body, from the URDF's own collision shapes, and their distances.

A capsule is all that lies within a radius of a segment; a sphere is one of no length. A
cylinder becomes the capsule about its axis, which holds it and is rounded beyond its
ends. A box becomes a row of capsules along its longest side, as thick as its thinnest:
what they leave out are its edges.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil

import casadi as ca
import numpy as np
from scipy.spatial.transform import Rotation

from ikns.arrays import Array
from ikns.errors import InvalidInput

#: Part of the upper arm next to the shoulder that is not kept off the trunk, which it
#: touches in the armpit whatever the posture.
_ARMPIT = 1 / 3
#: What a clamp between parallel segments divides by, at least, as a share of the
#: squared lengths' product; any place along them is then the closest.
_PARALLEL = 1e-9


@dataclass(frozen=True)
class Capsule:
    """A capsule fixed to a link: a segment in its frame, and a radius, m.

    The name has link and shape, for reports.
    """

    name: str
    link: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


def capsules(urdf: str) -> list[Capsule]:
    """Capsules of every collision shape of a URDF; meshes are left out.

    Examples
    --------
    >>> text = '''<robot name="r"><link name="head"><collision><geometry>
    ... <sphere radius="0.1"/></geometry></collision></link></robot>'''
    >>> [(c.name, c.radius) for c in capsules(text)]
    [('head sphere', 0.1)]
    """
    found: list[Capsule] = []
    for link in ET.fromstring(urdf).iter("link"):
        own: list[Capsule] = []
        for shape in link.iter("collision"):
            own += _of_shape(link.get("name", ""), shape)
        # A sphere inside another shape is redundant.
        kept = [c for c in own if not any(_holds(o, c) for o in own if o is not c)]
        found += _numbered(kept)
    return found


def arm_pairs(
    volumes: list[Capsule], sides: tuple[str, ...], *, hands: bool
) -> list[tuple[Capsule, Capsule]]:
    """Pairs that must not overlap: arm and trunk, neck or head; one arm and the other.

    Arms of `sides` move, and with `hands` the hands too; held ones stay where they are.
    """
    parts = ("upper_arm", "forearm", *(("hand",) if hands else ()))
    trunk = [v for v in volumes if v.link == "thorax"]
    arms = {
        s: [v for p in parts for v in volumes if v.link == f"{s}_{p}"] for s in sides
    }
    pairs = [
        (_off_the_armpit(limb), part)
        for s in sides
        for limb in arms[s]
        for part in trunk
    ]
    if len(sides) == 2:
        # Hands that hold something between them may touch.
        limbs = ([v for v in arms[s] if not v.link.endswith("hand")] for s in sides)
        right, left = limbs
        pairs += [(one, other) for one in right for other in left]
    return pairs


def distance(one: tuple[ca.SX, ca.SX], other: tuple[ca.SX, ca.SX]) -> ca.SX:
    """Distance of two segments, each given by its ends (3,), m.

    Ericson 2005, Real-Time Collision Detection, sec. 5.1.9; both clamps are expressions
    with one slope but where an end takes over.
    """
    (p, p2), (q, q2) = one, other
    d1, d2, r = p2 - p, q2 - q, p - q
    a, e, f = ca.dot(d1, d1), ca.dot(d2, d2), ca.dot(d2, r)
    b, c = ca.dot(d1, d2), ca.dot(d1, r)
    if a.is_zero() and e.is_zero():
        s, t = ca.SX(0), ca.SX(0)
    elif a.is_zero():
        s, t = ca.SX(0), _unit(f / e)
    elif e.is_zero():
        s, t = _unit(-c / a), ca.SX(0)
    else:
        s = _unit((b * f - c * e) / (a * e - b * b + _PARALLEL * a * e))
        t = _unit((b * s + f) / e)
        s = _unit((b * t - c) / a)
    return ca.norm_2(r + d1 * s - d2 * t)


def _unit(value: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(value, 0.0), 1.0)


def _of_shape(link: str, shape: ET.Element) -> Iterator[Capsule]:
    origin, geometry = shape.find("origin"), shape.find("geometry")
    center, turn = np.zeros(3), np.eye(3)
    if origin is not None:
        center = _numbers(origin, "xyz", "0 0 0")
        turn = Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0")).as_matrix()
    for form in geometry if geometry is not None else ():
        name = shape.get("name") or f"{link} {form.tag}"
        if form.tag == "sphere":
            axes, radius = [np.zeros((2, 3))], float(form.get("radius", "nan"))
        elif form.tag in ("cylinder", "capsule"):
            half = float(form.get("length", "nan")) / 2
            axes = [np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])]
            radius = float(form.get("radius", "nan"))
        elif form.tag == "box":
            axes, radius = _rods(_numbers(form, "size", "nan nan nan"))
        else:
            continue
        for ends in axes:
            start, end = ends @ turn.T + center
            made = Capsule(name, link, _tuple(start), _tuple(end), radius)
            if not np.isfinite([*made.start, *made.end, radius]).all():
                raise InvalidInput(
                    f"the shape '{name}' of the URDF has no finite size."
                )
            yield made


def _numbered(shapes: list[Capsule]) -> list[Capsule]:
    """Shapes with unique names; the rods of one box share a name."""
    seen: dict[str, list[float]] = {}
    named = []
    for shape in shapes:
        sizes = seen.setdefault(shape.name, [])
        rods = shape.name.endswith("box")
        if not rods or shape.radius not in sizes:
            sizes.append(shape.radius)
        number = sizes.index(shape.radius) + 1 if rods else len(sizes)
        named.append(
            replace(shape, name=f"{shape.name} {number}") if number > 1 else shape
        )
    return named


def _rods(size: Array) -> tuple[list[Array], float]:
    """Axes (2, 3) along the longest side of a box, and their radius."""
    thin, middle, long = np.argsort(size, kind="stable")
    radius = size[thin] / 2
    n = ceil(size[middle] / size[thin])
    across = np.linspace(-1, 1, n) * (size[middle] / 2 - radius) if n > 1 else [0.0]
    axes = []
    for place in across:
        ends = np.zeros((2, 3))
        ends[:, middle] = place
        ends[:, long] = np.array([-1, 1]) * (size[long] / 2 - radius)
        axes.append(ends)
    return axes, float(radius)


def _holds(outer: Capsule, inner: Capsule) -> bool:
    """Whether a capsule contains a sphere; false for other shapes."""
    if inner.start != inner.end:
        return False
    start, end, ball = map(np.array, (outer.start, outer.end, inner.start))
    axis = end - start
    along = np.clip((ball - start) @ axis / max(axis @ axis, 1e-300), 0, 1)
    off = float(np.linalg.norm(start + along * axis - ball))
    return off + inner.radius <= outer.radius + 1e-9


def _off_the_armpit(limb: Capsule) -> Capsule:
    if not limb.link.endswith("upper_arm"):
        return limb
    # The shoulder is the link's origin, whichever way the shape lies.
    ends = sorted(
        (limb.start, limb.end), key=lambda place: float(np.linalg.norm(place))
    )
    near, far = map(np.array, ends)
    return replace(limb, start=_tuple(near + _ARMPIT * (far - near)), end=ends[1])


def _numbers(element: ET.Element, attribute: str, default: str) -> Array:
    return np.array([float(x) for x in element.get(attribute, default).split()])


def _tuple(place: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in place)
    return x, y, z
