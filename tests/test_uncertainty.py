"""What c is worth: its standard deviation by formula, and its errors on a person."""

import dataclasses
import inspect

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st
from test_intent_live import readout

from ikns._kernels.body.intent_gradient import intent_gradient
from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.cli.control import control
from ikns.cli.run import run
from ikns.errors import InvalidInput
from ikns.live.control import FrameSolver
from ikns.live.control.controller import Controller
from ikns.live.control.frame import MAX_UNCERTAINTY
from ikns.live.control.intent import intent_numbers
from ikns.live.control.recorded import control_table, uncertain_sentence
from ikns.live.control.settings import ControlSettings
from ikns.motion.marker_ik import PRIOR, MarkerIK
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.readout import Readout
from ikns.nullspace.readout.coordinates import posture_samples

RATE = 50
#: The solver's noise of a marker, m: what the pull to the pose before assumes.
NOISE = 1e-3


@given(st.integers(0, 500), st.sampled_from(["right", "left"]), st.booleans())
@settings(max_examples=15, deadline=None)
def test_the_gradient_of_intent_is_its_finite_difference(seed, side, guard):
    rng, body = np.random.default_rng(seed), Skeleton.load()
    one = readout(side, guard=guard)
    angles = 0.8 * rng.uniform(body.lower, body.upper)
    gradient = np.empty(len(angles))
    intent_gradient(*intent_numbers(body, one), angles, 1.0, gradient)
    step, differences = 1e-6, np.empty(len(angles))
    for j in range(len(angles)):
        ends = np.stack([angles, angles])
        ends[:, j] += step, -step
        place, swivel = posture_samples(body, ends, one.chain, "intent")
        up, down = one.map.control_signal(swivel, place)
        differences[j] = (up - down) / (2 * step)
    # Rounding of c, of order 1 to 10, over the step: 1e-15 / 1e-6; next to where the
    # swivel is undefined gradients are large, and so is what is left of third order.
    scale = max(1.0, float(np.abs(differences).max()))
    np.testing.assert_allclose(gradient, differences, rtol=0, atol=1e-6 * scale**2)


def test_the_deviation_is_propagated_noise():
    """Against Pinocchio's marker Jacobians and dense linear algebra."""
    body = Skeleton.load()
    body = body.with_markers(body.marker_set.without_static())
    q = body.neutral()
    q[7:] = np.linspace(0.05, 0.2, 18)  # within all limits
    Z = np.linalg.qr(np.random.default_rng(3).normal(size=(7, 1)))[0].T
    learned = NullSpaceMap.from_arrays(
        np.zeros((1, 3)), Z[None], [[0.0]], [[0.8]], interpolation="nearest"
    )
    solver = FrameSolver(body, learned, "right_arm", max_uncertainty=9.0)
    markers = body.markers_in_world(q)
    # Two frames: of the first the pull to the start is not known to have settled.
    for _ in range(2):
        solved = solver.solve(markers)
    J = body.marker_jacobian(solved.q)[1].reshape(-1, body.nv)
    gradient = np.zeros(body.nv)
    gradient[body.columns(chain_joints("right_arm"))] = Z[0] / 0.8
    information = J.T @ J
    v = np.linalg.solve(information + PRIOR**2 / 100 * np.eye(body.nv), gradient)
    expected = NOISE * np.sqrt(v @ information @ v)
    assert solved.uncertainty[0] == pytest.approx(expected, rel=1e-6)


def hidden(markers, columns, seconds, *, every=1.0):
    """Markers with some hidden for a while each second, and for how long, s."""
    seen, age = markers.copy(), np.zeros(len(markers))
    length, period = round(seconds * RATE), round(every * RATE)
    for start in range(period // 2, len(markers) - length, period):
        seen[start : start + length, columns] = np.nan
        age[start : start + length] = np.arange(1, length + 1) / RATE
    return seen, age


def signals(subject, markers, method, limit=9.0):
    solver = FrameSolver(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        readout=subject.readout(method),
        max_uncertainty=limit,
    )
    frames = [solver.solve(seen, 1 / RATE) for seen in markers]
    return (
        np.array([frame.c[0] for frame in frames]),
        np.array([frame.uncertainty[0] for frame in frames]),
    )


@pytest.fixture(scope="module")
def person():
    """A simulated person, and markers none of which is hidden for long."""
    subject, run = small_person.subject(), small_person.protocol()
    body = run.subject.skeleton
    worn = subject.skeleton.marker_set.labels
    order = [body.marker_set.labels.index(label) for label in worn]
    noise = np.random.default_rng(5).normal(0, NOISE, (400, len(worn), 3))
    q = run.points.truth.q[:400]
    return subject, np.stack([body.markers_in_world(row)[order] for row in q]) + noise


def columns_of(subject, *labels):
    return [subject.skeleton.marker_set.labels.index(label) for label in labels]


@pytest.mark.parametrize("labels", [("RFRM", "RWRA"), ("RWRA", "RWRB"), ("RELB",)])
@pytest.mark.parametrize("method", ["paper", "intent"])
def test_hidden_markers_move_c_little_or_it_is_held(person, method, labels):
    subject, markers = person
    whole, _ = signals(subject, markers, method)
    seen, age = hidden(markers, columns_of(subject, *labels), 0.3)
    c, deviation = signals(subject, seen, method)
    error, held = np.abs(c - whole)[age > 0], deviation[age > 0] > MAX_UNCERTAINTY
    # Of normal errors 95 % are within two deviations; steps of the paper's map at the
    # hull are not normal.
    assert np.mean(error <= 2 * deviation[age > 0]) > 0.9
    assert np.mean((error > 0.05) & ~held) < 0.02


def test_intent_of_the_wrist_alone_does_not_need_the_hand(person):
    subject, markers = person
    table = subject.readout("intent").table()
    for name in ("coefficients_rad", "people_rad"):
        table["natural_posture"][name] = table["natural_posture"][name][:10]
    alone = dataclasses.replace(subject, readouts={"intent": Readout.from_table(table)})
    whole, _ = signals(alone, markers, "intent")
    markers = markers.copy()
    markers[50:, columns_of(subject, "RFIN")] = np.nan
    c, _ = signals(alone, markers, "intent", MAX_UNCERTAINTY)
    assert np.abs(c - whole).max() < 0.02


def test_intent_knows_what_a_hand_that_stays_hidden_leaves_open(person):
    subject, markers = person
    whole, _ = signals(subject, markers, "intent")
    markers = markers.copy()
    markers[50:, columns_of(subject, "RFIN")] = np.nan
    c, deviation = signals(subject, markers, "intent")
    assert deviation[52] < deviation[60] < deviation[74]
    # As where markers are hidden for 0.3 s, above.
    error, held = np.abs(c - whole)[50:], deviation[50:] > MAX_UNCERTAINTY
    assert np.mean((error > 0.05) & ~held) < 0.02


@pytest.mark.parametrize("method", ["paper", "intent"])
def test_a_short_gap_of_the_hand_or_shoulder_is_bridged(person, method):
    subject, markers = person
    whole, _ = signals(subject, markers, method)
    for label in ("RFIN", "RSHO"):
        # Three frames of a hundred, as the cameras of the simulation do.
        seen, age = hidden(markers, columns_of(subject, label), 0.06, every=2.0)
        c, _ = signals(subject, seen, method, MAX_UNCERTAINTY)
        known = np.isfinite(c)
        assert np.mean(~known) <= 0.01
        assert np.median(np.abs(c - whole)[known & (age > 0)]) < 0.02


def test_what_a_hidden_marker_shifts_is_taken_off(person):
    subject, markers = person
    table = subject.readout("intent").table()
    before = Readout.from_table(table | {"leash_m": 0.0})
    older = dataclasses.replace(subject, readouts={"intent": before})
    (column,) = columns_of(subject, "RSHO")
    off = markers.copy()
    # Farther up than the static trial had it: without it, the girdle comes down.
    off[:, column, 2] += 0.015
    seen, age = hidden(off, [column], 0.3)
    rms, deviations = [], []
    for one in (older, subject):
        whole, _ = signals(one, off, "intent")
        c, deviation = signals(one, seen, "intent")
        error = np.abs(c - whole)[age > 0]
        rms.append(np.sqrt(np.mean(error**2)))
        deviations.append(np.median(deviation[age > 0]))
        assert np.mean(error <= 2 * deviation[age > 0]) > 0.9
    # What is left is noise, and what changes of the shift as the arm moves on.
    assert rms[1] < 0.5 * rms[0]
    assert deviations[1] < deviations[0]


def test_a_hand_that_stays_hidden_leaves_the_papers_c_uncertain(person):
    subject, markers = person
    markers = markers.copy()
    markers[50:, columns_of(subject, "RFIN")] = np.nan
    _, deviation = signals(subject, markers, "paper")
    # It grows with time up to half a second, 25 frames, but for the posture's changes.
    assert deviation[52] < deviation[60] < deviation[74]
    controller = Controller(
        FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    )
    made = [
        controller.frame(seen, i / RATE, i / RATE) for i, seen in enumerate(markers)
    ]
    assert made[40].valid
    late = made[90:]
    assert all(one.rejection == "the right hand is not visible" for one in late)
    assert len({one.flexion for one in late}) == 1
    assert np.isnan([one.solved.c[0] for one in late]).all()


def test_without_a_limit_c_is_known_while_the_chain_is_in_sight(person):
    subject, markers = person
    seen, age = hidden(markers, columns_of(subject, "RFIN"), 0.1)
    c, _ = signals(subject, seen, "paper", None)
    np.testing.assert_array_equal(np.isnan(c), age > 0)


@pytest.mark.parametrize("method", ["paper", "intent"])
def test_a_recording_is_judged_as_it_is_live(method):
    subject, recording = (
        small_person.subject(),
        small_person.protocol().points.recording,
    )
    motion = MarkerIK(subject.skeleton).track(recording, chain=subject.chain)
    found = control_table(subject, motion, recording=recording, method=method)
    c = found.rows[:, found.columns.index("c")]
    deviation = found.rows[:, found.columns.index("c_uncertainty")]
    markers = subject.skeleton.marker_set.pick(recording.labels, recording.markers)
    live, uncertainty = signals(subject, markers, method, MAX_UNCERTAINTY)
    # Poses agree to the tolerance of the marker fit, so deviations of order 0.01 do to
    # 1e-5, and but for frames that close to the limit the same are left out.
    close = np.abs(deviation - uncertainty) < 1e-3 * (1e-2 + deviation)
    assert np.mean(close) > 0.97
    assert np.mean(np.isnan(c) == np.isnan(live)) > 0.99
    assert found.summary["frames_uncertain"] == np.sum(~(deviation <= MAX_UNCERTAINTY))
    assert not uncertain_sentence(found.summary, MAX_UNCERTAINTY)
    # Where the hand is does not depend on how well c is known, and why c is missing in
    # many frames is told.
    none = control_table(
        subject, motion, recording=recording, method=method, max_uncertainty=1e-9
    )
    assert np.isnan(none.rows[:, none.columns.index("c")]).all()
    at = none.columns.index("inside")
    np.testing.assert_array_equal(none.rows[:, at], found.rows[:, at])
    assert set(none.rows[:, at]) == {0.0, 1.0}
    assert f"in {len(c)} of {len(c)} frames" in uncertain_sentence(none.summary, 1e-9)


def test_limits_are_the_same_everywhere_and_positive(person):
    assert ControlSettings().max_uncertainty == MAX_UNCERTAINTY
    for command in (run, control):
        shown = inspect.signature(command).parameters["max_uncertainty"].default
        assert shown == MAX_UNCERTAINTY
    with pytest.raises(InvalidInput, match="max_uncertainty must be above 0, found 0"):
        ControlSettings(max_uncertainty=0.0)
    subject, recording = small_person.subject(), small_person.protocol().free.recording
    motion = MarkerIK(subject.skeleton).track(recording)
    with pytest.raises(InvalidInput, match="max_uncertainty must be above 0, found 0"):
        control_table(subject, motion, max_uncertainty=0.0)


@given(st.floats())
@settings(max_examples=20, deadline=None)
def test_any_time_between_frames_gives_a_deviation(dt):
    subject = small_person.subject()
    solver = FrameSolver(subject.skeleton, subject.null_space_map, subject.chain)
    markers = subject.skeleton.markers_in_world(subject.skeleton.neutral())
    solver.solve(markers)
    markers[columns_of(subject, "RFIN")] = np.nan
    assert solver.solve(markers, dt).uncertainty[0] >= 0
