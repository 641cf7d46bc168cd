"""The grasp's mechanics: laws of contact, closed forms, and the URDF it is made of."""

import math
import xml.etree.ElementTree as ET
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.body.model_file import urdf_folder
from ikns.errors import InvalidInput
from ikns.experiments.picking import load_objects
from ikns.simulation.grasp import Grasp, Solid, constant, finger_parts, grip_height
from ikns.simulation.grasp.physics import Observation
from ikns.simulation.grasp.world import CLEAR, world_model

RATE = 100.0
CAN = Solid("cylinder", (0.075, 0.10), 0.05)
FINGER = urdf_folder() / "finger.urdf"
G = 9.81


def run(
    grasp: Grasp, seconds: float, flexion: float, *, rise: float = 0.0
) -> Observation:
    """Hold one command to the finger while the hand rises smoothly."""
    start = grasp.data.mocap_pos[0, 2] - grip_height(grasp.solid)
    n = round(seconds * grasp.rate)
    for k in range(n):
        s = (k + 1) / n
        up = start + rise * s**3 * (10 - 15 * s + 6 * s**2)
        seen = grasp.frame(flexion, [0, 0, up])
    return seen


def lifted(solid: Solid, **model: float) -> tuple[Grasp, Observation]:
    """Close on an object and lift it by a decimeter."""
    grasp = Grasp(solid, rate=RATE, **model)
    run(grasp, 1.5, 1.0)
    return grasp, run(grasp, 1.0, 1.0, rise=0.1)


def wrenches(grasp: Grasp) -> list[tuple[np.ndarray, np.ndarray]]:
    """Force in its own axes and friction of every contact."""
    found = []
    for i in range(grasp.data.ncon):
        wrench = np.zeros(6)
        mujoco.mj_contactForce(grasp.model, grasp.data, i, wrench)
        found.append((wrench, grasp.data.contact[i].friction))
    return found


def test_the_finger_weighs_and_measures_what_its_urdf_says():
    # MuJoCo reads the same file by itself; the fixed base is left out there.
    theirs = mujoco.MjModel.from_xml_string(FINGER.read_text())
    ours = world_model(CAN)
    for k in range(1, 7):
        a, b = ours.body(f"module_{k}"), theirs.body(f"module_{k}")
        np.testing.assert_allclose(a.mass, b.mass, rtol=1e-12)
        np.testing.assert_allclose(np.sort(a.inertia), np.sort(b.inertia), rtol=1e-6)
        # Of its place in the link before; the first one's is the base.
        np.testing.assert_allclose(a.pos, b.pos, atol=1e-12)
        np.testing.assert_allclose(a.ipos, b.ipos, atol=1e-12)
        joint, other = ours.joint(f"flexion_{k}"), theirs.joint(f"flexion_{k}")
        np.testing.assert_allclose(joint.range, other.range)
        np.testing.assert_allclose(joint.axis, other.axis)
    base = ET.parse(FINGER).getroot().find("link[@name='finger_base']/inertial")
    assert ours.body("finger_base").mass == float(base.find("mass").attrib["value"])
    assert base.find("inertia").attrib["izz"] == str(
        float(ours.body("finger_base").inertia[2])
    )


def test_a_free_finger_bends_alike_at_every_joint():
    # Without gravity: it acts along the axes, but turns the hand in its soft weld.
    grasp = Grasp(Solid("sphere", (0.01,), 0.001), rate=RATE, gravity=0.0)
    run(grasp, 4.0, 0.5)
    angles = grasp.data.qpos[-6:] / [part.upper for part in finger_parts()[1:]]
    # The springs cost the servo `spring * angle` of torque at each joint, and an error
    # of flexion in proportion, e = 0.1 * (0.1 * 0.349066 (0.5 - e)) / 1 N m. 4 s are
    # forty time constants (damping / spring) of a joint.
    e = 0.00349066 * 0.5 / 1.00349066
    np.testing.assert_allclose(angles, 0.5 - e, atol=1e-6)


def test_the_weight_is_read_back_from_the_table():
    for solid in (CAN, Solid("box", (0.05, 0.097, 0.082), 0.37)):
        grasp = Grasp(solid, rate=RATE)
        seen = run(grasp, 1.0, 0.0)
        # It has come to rest with a time constant of 0.01 s, a hundred times over; what
        # is left is the solver's tolerance, 1e-8 of the scaled cost.
        assert seen.table == pytest.approx(solid.mass * G, rel=1e-4)
        assert seen.finger == seen.hand == 0.0


def test_what_is_held_is_carried_by_friction_alone():
    grasp, seen = lifted(CAN)
    run(grasp, 1.0, 1.0)
    data, thing = grasp.data, grasp.model.geom("object").id
    upward = 0.0
    for i in range(data.ncon):
        contact, wrench = data.contact[i], np.zeros(6)
        mujoco.mj_contactForce(grasp.model, data, i, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]
        if thing in contact.geom:
            upward += force[2] if contact.geom[1] == thing else -force[2]
    assert seen.table == 0.0
    # Still but for the creep, whose acceleration is nothing: the sum of all forces is
    # the weight, within the solver's tolerance and what is left of the swing.
    assert upward == pytest.approx(CAN.mass * G, rel=0.01)


@pytest.mark.parametrize("mu", [0.3, 0.6])
def test_an_object_is_lifted_if_and_only_if_friction_can_carry_it(mu):
    _, seen = lifted(CAN, friction=mu)
    # The tendon, not the weight, sets how hard finger and hand press: the law of two
    # plates, mu (N + N) >= m g, says what the grip could carry at most.
    most = mu * (seen.finger + seen.hand) / G
    heavy = Solid("cylinder", CAN.size, 1.25 * most)
    grasp, over = lifted(heavy, friction=mu)
    assert over.place[2] < 0.05 + 0.05  # less than halfway up with the hand
    # Part of the friction is used up across: finger and hand do not press in one line.
    # Half of what they could carry they do.
    light = Solid("cylinder", CAN.size, 0.5 * most)
    grasp, under = lifted(light, friction=mu)
    assert under.table == 0.0
    assert under.place[2] == pytest.approx(0.15, abs=5e-3)
    assert heavy.mass > mu * (under.finger + under.hand) / G > light.mass


def test_nothing_is_lifted_without_friction():
    _, seen = lifted(CAN, friction=1e-5)
    assert seen.place[2] == pytest.approx(0.05, abs=1e-3)


def test_no_contact_ever_pulls_more_than_its_friction():
    grasp = Grasp(CAN, rate=RATE)
    for k in range(250):
        grasp.frame(1.0, [0, 0, 0.1 * max(k - 150, 0) / 100])
        for wrench, mu in wrenches(grasp):
            assert wrench[0] >= 0
            # An elliptic cone; a thousandth for what the solver leaves.
            inside = math.hypot(*wrench[1:4] / mu[:3])
            assert inside <= wrench[0] * 1.001 + 1e-6


def test_what_is_held_stays_held():
    grasp, before = lifted(CAN)
    after = run(grasp, 20.0, 1.0)
    # A held contact creeps at R f / b: R = (1 - d) / d / m / stickiness, f = m g in
    # all, b = 2 / (0.99 contact_time) and d 0.95 at least: 26 um/s. Twice that, for
    # the finger gives way, too.
    b = 2 / (0.99 * constant("contact_time"))
    creep = 0.05 / 0.95 * G / constant("stickiness") / b
    assert abs(after.in_hand - before.in_hand).max() < 2 * 20 * creep
    assert after.table == 0.0


def test_what_is_let_go_falls():
    grasp, _ = lifted(CAN)
    seen = run(grasp, 0.8, 0.0)
    assert seen.finger == 0.0
    assert seen.table > 0.0


def test_a_fall_wins_no_energy_and_sinks_into_nothing():
    grasp = Grasp(Solid("sphere", (0.03,), 0.05), rate=RATE)
    grasp.data.qpos[2] = 0.115
    energy, deepest = [], 0.0
    for _ in range(100):
        seen = grasp.frame(0.0, [-0.3, 0, 0.2])
        energy.append(G * seen.place[2] + seen.speed**2 / 2)
        deepest = min([deepest, *grasp.data.contact.dist.tolist()])
    # The integrator's error over one step of free fall is g dt v, 0.03 J/kg at most
    # in sum over a step's 0.002 s at 1.4 m/s; then it rests.
    for before, after in pairwise(energy):
        assert after <= before + G * constant("timestep") * 1.4
    assert energy[-1] == pytest.approx(G * 0.015, abs=0.01)
    # Stopped from 1.4 m/s in one time constant of the contact it sinks v / (e w) with
    # w = 1 / (0.99 * 0.01 s): 5 mm at the very most, and rests within 0.1 mm.
    assert deepest > -5.2e-3
    assert seen.place[2] == pytest.approx(0.015, abs=1e-4)


def test_left_is_right_in_a_mirror():
    ball = Solid("sphere", (0.075,), 0.068)
    ways = []
    for side, sign in (("right", 1), ("left", -1)):
        grasp = Grasp(ball, rate=RATE, side=side)
        seen = [
            grasp.frame(1.0, [0, sign * 0.002, 0.1 * max(k - 150, 0) / 100], [0, 0, 0])
            for k in range(250)
        ]
        ways.append([[*s.place * [1, sign, 1], s.flexion] for s in seen])
    # The same equations in another order of sums: rounding, and what the solver leaves
    # of its tolerance at each of 1250 steps. Far below a millimeter.
    np.testing.assert_allclose(ways[0], ways[1], atol=2e-4)


def test_the_finger_pushes_less_after_a_long_push():
    grasp = Grasp(CAN, rate=RATE)
    most = max(grasp.frame(1.0).load for _ in range(120))
    later = run(grasp, 1.0, 1.0)
    assert most == pytest.approx(0.5, rel=0.02)  # the effort it may use
    # The guard's grip of 0.03 in the 0.1 at which the motor gives all it has, less
    # what the finger's own springs and contacts yield.
    assert later.load == pytest.approx(0.3, abs=0.02)
    assert grasp.guard.stalled


def test_the_tendon_only_pulls():
    grasp = Grasp(CAN, rate=RATE)
    run(grasp, 1.0, 0.5)
    assert min(grasp.frame(0.0).load for _ in range(100)) == 0.0
    assert grasp.flexion == pytest.approx(0.0, abs=0.01)  # the springs opened it


@pytest.mark.parametrize("code", list(load_objects()))
def test_every_object_of_the_table_fits_and_is_gripped(code):
    thing = load_objects()[code]
    solid = Solid(thing.shape, thing.size_m, thing.mass_kg)
    assert solid.extent[1] < CLEAR
    _, seen = lifted(solid)
    assert seen.table == 0.0
    assert seen.finger > 0.0


@given(st.floats(0.02, 0.1), st.floats(0.02, 0.3), st.sampled_from(["right", "left"]))
def test_the_finger_begins_free_of_whatever_fits(width, height, side):
    solid = Solid("cylinder", (width, height), 0.1)
    grasp = Grasp(solid, rate=RATE, side=side)
    assert grasp.seen().finger == grasp.seen().hand == 0.0


@given(st.sampled_from([0.0, -1.0, math.nan, math.inf, 11.0]), st.integers(0, 2))
def test_what_is_no_object_is_refused(bad, k):
    numbers = [0.05, 0.1, 0.2]
    numbers[k] = bad
    with pytest.raises(InvalidInput, match="expected a mass in kg"):
        Solid("cylinder", (numbers[0], numbers[1]), numbers[2])


def test_shapes_sides_and_rates_that_are_none_are_refused():
    with pytest.raises(InvalidInput, match="expected a shape of box"):
        Solid("cone", (0.1, 0.1), 0.1)
    with pytest.raises(InvalidInput, match="a side of right or left"):
        Grasp(CAN, side="both")
    with pytest.raises(InvalidInput, match="expected a rate that divides 500"):
        Grasp(CAN, rate=60.0)


def test_an_unstable_simulation_is_reported(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log where one is
    grasp = Grasp(CAN, rate=RATE)
    grasp.data.qvel[:3] = 1e12
    with pytest.raises(InvalidInput, match="came apart after 0.01 s"):
        grasp.frame(0.0)
