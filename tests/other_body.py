"""People of another making: arms whose joints are not those of the package's body.

Plain forward kinematics with numpy; it shares no code with `ikns.simulation`. A thorax
at rest (X forward, Y up, Z right, origin at the sternal notch), two arms of seven
joints in the order of `right_arm`, landmarks on the bones of *these* arms: epicondyles
at the ends of the elbow's true axis, styloids and knuckle where the forearm's and the
hand's bones end. Carrying angle, elbow, pronation and wrist axes, offsets between axes,
lengths and girths are drawn anew for each person; no number is the model's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THORAX = ("C7", "T10", "CLAV", "STRN")
ARM = ("SHO", "UPA", "UPB", "UPC", "ELB", "MEP", "FRM", "WRA", "WRB", "FIN")
#: Zero angles, axes and signs of a right arm: abduction, flexion and rotation of the
#: shoulder, elbow flexion, pronation, wrist flexion and deviation.
NOMINAL = np.array(
    [[-1, 0, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, -1]],
    dtype=float,
)


class Arm(NamedTuple):
    """A right arm; the left one is mirrored when it is placed."""

    axes: Array  # (7, 3) in the frame that carries each joint
    offsets: Array  # (8, 3) from each joint's center to the next; the last: knuckle, m
    carrying: float  # rad
    markers: dict[str, tuple[int, Array]]  # label: joints before it, place in m


class Person(NamedTuple):
    """Both arms and the trunk's markers."""

    right: Arm
    left: Arm
    thorax: dict[str, Array]


def turn(axis: Array, angle: Array) -> Array:
    """Rotations (..., 3, 3) by angles (...) about one axis (3,), by Rodrigues."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def draw_arm(
    rng: np.random.Generator, carrying: float, sizes: Array, wrist_sd: float
) -> Arm:
    """Draw an arm; `sizes` are clavicle, upper arm, forearm and hand, m.

    Axes lie off the nominal ones by 2 to 3 deg about either of two directions, those of
    the wrist by `wrist_sd`, deg.
    """
    clavicle, upper, fore, hand = sizes
    tilts = np.radians([0, 0, 0, 3, 2, wrist_sd, wrist_sd])[:, None] * rng.normal(
        size=(7, 3)
    )
    axes = NOMINAL + np.cross(tilts, NOMINAL)
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    mm = rng.normal(size=(30, 3)) / 1000
    offsets = np.zeros((8, 3))
    offsets[0] = [-0.02, -0.022, clavicle] + 3 * mm[0]
    offsets[3] = [0, -upper, 0]
    offsets[4] = 2 * mm[1] * [1, 0, 1]  # elbow and pronation axes do not quite meet
    offsets[5] = [0, -fore, 0] + 2 * mm[2] * [1, 0, 1]
    offsets[6] = 2 * mm[3]  # neither do those of the wrist
    offsets[7] = [0, -hand, 0]
    wide = 0.041 + 3 * mm[4, 0]
    places = {
        "SHO": (0, offsets[0] + [0.002, 0.044, -0.009] + 4 * mm[5]),
        "UPA": (3, [0.012, -0.42 * upper, 0.05] + 9 * mm[6]),
        "UPB": (3, [-0.022, -0.57 * upper, 0.047] + 9 * mm[7]),
        "UPC": (3, [0.022, -0.7 * upper, 0.044] + 9 * mm[8]),
        "ELB": (3, offsets[3] + wide * axes[3] + 2 * mm[9]),
        "MEP": (3, offsets[3] - wide * axes[3] + 2 * mm[10]),
        "FRM": (5, [0.004, -0.47 * fore, 0.046] + 9 * mm[11]),
        "WRA": (5, offsets[5] + [0.035, 0.003, 0.001] + 2 * mm[12]),
        "WRB": (5, offsets[5] + [-0.035, 0.003, 0.001] + 2 * mm[13]),
        "FIN": (7, [0.001, -0.88 * hand, 0.023] + 2 * mm[14]),
    }
    markers = {label: (k, np.asarray(p)) for label, (k, p) in places.items()}
    return Arm(axes, offsets, carrying, markers)


def draw_person(seed: int, *, wrist_sd: float = 3.0) -> Person:
    """Draw a person whose carrying angle lies between 0 and 20 deg."""
    rng = np.random.default_rng([20, seed])
    carrying = np.radians(rng.uniform(0, 20))
    stature = 1 + 0.055 * rng.normal()
    share = 1 + np.array([0.05, 0.032, 0.043, 0.04]) * rng.normal(size=4)
    sizes = np.array([0.170, 0.284, 0.258, 0.080]) * stature * share
    mm = rng.normal(size=(4, 3)) / 1000
    thorax = {
        "C7": np.array([-0.128, 0.064, 0]) * stature + 4 * mm[0],
        "T10": np.array([-0.148, -0.215, 0]) * stature + [7, 15, 4] * mm[1],
        "CLAV": np.array([0.007, -0.003, 0]) + 3 * mm[2],
        "STRN": np.array([0.036, -0.17, 0]) * stature + [7, 12, 4] * mm[3],
    }
    both = sizes * (1 + 0.007 * rng.normal(size=(2, 4)))
    arms = [draw_arm(rng, carrying, own, wrist_sd) for own in both]
    return Person(*arms, thorax)


def place(arm: Arm, q: Array) -> tuple[dict[str, Array], Array, Array]:
    """Markers, hand position (T, 3) m and orientation (T, 3, 3) at angles (T, 7)."""
    R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    p = np.broadcast_to(arm.offsets[0], (len(q), 3))
    marked = {
        label: np.broadcast_to(at, (len(q), 3))
        for label, (k, at) in arm.markers.items()
        if k == 0
    }
    for j in range(7):
        p = p + R @ (arm.offsets[j] if j else np.zeros(3))
        if j == 4:
            R = R @ turn(np.array([1.0, 0, 0]), -arm.carrying)
        R = R @ turn(arm.axes[j], q[:, j])
        for label, (k, at) in arm.markers.items():
            if k == j + 1 and k:
                marked[label] = p + R @ at
    return marked, p + R @ arm.offsets[7], R


def hand_jacobian(arm: Arm, q: Array, h: float = 1e-6) -> Array:
    """Linear and angular velocity of the hand by each joint, (T, 6, 7)."""
    columns = []
    _, _, R = place(arm, q)
    for j in range(7):
        ahead, back = (place(arm, q + s * h * np.eye(7)[j]) for s in (1, -1))
        S = (ahead[2] - back[2]) / (2 * h) @ np.swapaxes(R, 1, 2)
        spin = np.stack([S[:, 2, 1], S[:, 0, 2], S[:, 1, 0]], axis=1)
        columns.append(np.hstack([(ahead[1] - back[1]) / (2 * h), spin]))
    return np.stack(columns, axis=2)


def null_direction(arm: Arm, q: Array) -> Array:
    """Direction (7,) nearest to the hand's null spaces at these postures."""
    n = np.linalg.svd(hand_jacobian(arm, q))[2][:, -1]
    return np.linalg.svd(n)[2][0]


def hold(arm: Arm, start: Array, sweep: Array, wander: Array) -> Array:
    """Postures (T, P, 7) that hold P hands while the elbow moves by `sweep` (T,) rad.

    `wander` (T, P, 6) is how far the hands stray, m and rad.
    """
    q, (_, p0, R0), path = start.copy(), place(arm, start), []
    n = np.linalg.svd(hand_jacobian(arm, q))[2][:, -1]
    way = n * np.sign(n[:, :1])  # the shoulder abducts
    for at, off in zip(np.diff(sweep, prepend=0.0), wander, strict=True):
        J = hand_jacobian(arm, q)
        n = np.linalg.svd(J)[2][:, -1]
        way = n * np.sign(np.sum(n * way, axis=1))[:, None]
        q = q + at * way
        for _ in range(2):
            _, p, R = place(arm, q)
            E = R0 @ np.swapaxes(R, 1, 2)
            spin = np.stack(
                [E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0],
                 E[:, 1, 0] - E[:, 0, 1]], axis=1) / 2  # fmt: skip
            error = np.hstack([p0 - p, spin]) + off
            q = q + np.einsum("pij,pj->pi", np.linalg.pinv(J), error)
        path.append(q)
    return np.array(path)


def reach(arm: Arm, targets: Array) -> Array:
    """Postures (P, 7) with the hand at targets (P, 3) m, near an easy one."""
    rest = np.radians([25, 35, 15, 80, 40, -5, 5])
    q = np.tile(rest, (len(targets), 1))
    for _ in range(60):
        J = hand_jacobian(arm, q)[:, :3]
        short = targets - place(arm, q)[1]
        short *= np.minimum(1, 0.05 / np.linalg.norm(short, axis=1))[:, None]
        back = J.swapaxes(1, 2) @ np.linalg.inv(J @ J.swapaxes(1, 2) + 1e-6 * np.eye(3))
        idle = 0.1 * (rest - q)
        idle -= np.einsum("pij,pjk,pk->pi", back, J, idle)
        q = q + np.einsum("pij,pj->pi", back, short) + idle
    return q


def recorded(
    person: Person, right: Array, rng: np.random.Generator, noise: float
) -> tuple[Array, list[str]]:
    """Markers (T, M, 3) m and labels, the right arm at (T, 7) rad, the left at rest."""
    rest = np.tile(np.radians([9, 4, 2, 14, 8, 1, 1]), (len(right), 1))
    columns: dict[str, Array] = {
        label: np.tile(at, (len(right), 1)) for label, at in person.thorax.items()
    }
    for letter, arm, q in (("R", person.right, right), ("L", person.left, rest)):
        mirror = [1, 1, 1 if letter == "R" else -1]
        for label, at in place(arm, q)[0].items():
            columns[letter + label] = at * mirror
    markers = np.stack(list(columns.values()), axis=1)
    return markers + noise * rng.normal(size=markers.shape), list(columns)


def exploration(
    person: Person, *, seconds: float = 3.0, rate: float = 50.0, seed: int = 0
) -> tuple[Array, Array, Array]:
    """Ten held hands with the elbow moving, and the ways between.

    Returns the right arm's angles (T, 7) rad, the point of every frame (T,), -1 between
    points, and the true null direction of each (P, 7).
    """
    rng = np.random.default_rng([21, seed])
    arm = person.right
    size = np.linalg.norm(arm.offsets[3]) + np.linalg.norm(arm.offsets[5])
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    box = np.vstack([0.13 * corners, [[0, 0, 0], [0.02, 0.06, -0.05]]])
    targets = np.array([0.56, -0.40, 0.18]) * [size, size, 1] + box
    start = reach(arm, targets)
    t = np.arange(int(seconds * rate)) / rate
    sweep = np.radians(28) * np.sin(2 * np.pi * t / seconds * 1.5)
    phase = rng.uniform(0, 2 * np.pi, (len(start), 6))
    wander = np.sin(1.9 * t[:, None, None] + phase) * ([1.5e-3] * 3 + [8e-3] * 3)
    held = hold(arm, start, sweep, wander - wander[0])
    parts, point = [], []
    n = int(rate)
    for k in range(len(start)):
        if k:
            share = (1 - np.cos(np.linspace(0, np.pi, n)))[:, None] / 2
            parts.append(parts[-1][-1] * (1 - share) + held[0, k] * share)
            point += [-1] * n
        parts.append(held[:, k])
        point += [k] * len(t)
    truth = np.array([null_direction(arm, held[::5, k]) for k in range(len(start))])
    return np.vstack(parts), np.array(point), truth


def lengths(arm: Arm) -> dict[str, float]:
    """Joint-to-joint lengths, m; the axes of one joint need not meet."""
    o = arm.offsets
    return {
        "upper_arm": float(np.linalg.norm(o[3])),
        "forearm": float(np.linalg.norm(o[4] + o[5])),
        "hand": float(np.linalg.norm(o[6] + o[7])),
    }
