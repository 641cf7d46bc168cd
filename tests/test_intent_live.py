"""The method intent live: the same c as offline, compiled, and replayed bit for bit."""

import dataclasses

import numpy as np
import pytest
import small_person
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns._kernels.body.intent_signal import intent_signal, new_hand_memory
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.control import FrameSolver
from ikns.live.control.controller import Controller
from ikns.live.control.intent import intent_numbers
from ikns.live.control.recorded import recorded_signal
from ikns.live.control.settings import ControlSettings
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import IntentMap, Readout
from ikns.nullspace.readout.coordinates import posture_samples

CORNERS = 0.3 * np.array(list(np.ndindex(2, 2, 2))) + [0.1, -0.3, 0.0]


def readout(side: str, *, guard: bool = True, hand: bool = True) -> Readout:
    rng = np.random.default_rng(1)
    wrist = rng.uniform([0.1, -0.3, 0], [0.4, 0.1, 0.4], (300, 3))
    way = rng.normal(size=(300, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    places = np.hstack([wrist, way]) if hand else wrist
    swivel = np.sin(5 * wrist).sum(axis=1) + way @ [0.5, -0.4, 0.8]
    natural = NaturalPosture(guard=guard).fit(places, swivel)
    learned = IntentMap.from_arrays(natural, CORNERS, np.full(8, -0.4), np.full(8, 0.7))
    return Readout("intent", f"{side}_arm", learned)


@given(
    st.integers(0, 200),
    st.sampled_from(["right", "left"]),
    st.booleans(),
    st.booleans(),
)
@settings(max_examples=25, deadline=None)
def test_the_kernel_is_the_formula(seed, side, guard, hand):
    rng, body = np.random.default_rng(seed), Skeleton.load()
    one = readout(side, guard=guard, hand=hand)
    angles = rng.uniform(body.lower, body.upper)
    work = np.empty((1, 2, 3, 3)), np.empty((1, 2, 3)), np.empty(10)
    memory, numbers = new_hand_memory(3), intent_numbers(body, one)
    # The hand turns in the first frame, is led on in the second, and hidden in the
    # third, which is read as if it was seen and then forgotten.
    path = angles + 0.05 * rng.normal(size=(4, 18))
    for row, seen in zip(path, (True, True, False, True), strict=True):
        c, taught, share = intent_signal(*numbers, row[None], *work, memory, seen)
        assert share == 1 if seen else 0 <= share < 1
    place, swivel = posture_samples(body, path, one.chain, "intent")
    rows = [0, 1, 3]
    expected = one.map.control_signal(swivel[rows], one.map.led(place[rows]))[-1]
    place = place[3:]
    # Some 100 terms of order 1 to 10; near a full turn both may differ by one.
    turn = 2 * np.pi / (one.map.ends_[1] - one.map.ends_[0])
    off = (c - float(expected)) / turn
    assert np.isnan(c) == np.isnan(expected)
    assert np.isnan(c) or abs(off - round(off)) * turn < 1e-9
    assert taught == one.map.inside(place)[0]


def test_frames_of_a_recording_give_what_the_motion_gives():
    subject = small_person.subject()
    recording = small_person.protocol().points.recording
    chosen = subject.readout("intent")
    solver = FrameSolver(
        subject.skeleton, subject.null_space_map, subject.chain, readout=chosen
    )
    motion = subject.motions[0]
    offline = chosen.control_signal(subject.skeleton, motion)
    inside = chosen.inside(subject.skeleton, motion)
    markers = subject.skeleton.marker_set.pick(recording.labels, recording.markers)
    live = [solver.solve(frame) for frame in markers[:300]]
    c = np.array([frame.c[0] for frame in live])
    seen = np.isfinite(c) & np.isfinite(offline[:300])
    recorded = recorded_signal(subject, motion, recording=recording, method="intent")
    known = np.isfinite(c) & np.isfinite(recorded.raw[:300, 0])
    assert known.sum() > 0.8 * len(c)
    # Poses agree to the tolerance of the marker fit, 1e-6 rad or so.
    np.testing.assert_allclose(c[known], recorded.raw[:300, 0][known], atol=1e-4)
    # The motion does not know what hidden markers shift, and passes over the way of the
    # wrist while a segment is hidden, in which the hand turns by a few degrees.
    whole = seen & np.isfinite(markers[:300]).all(axis=(1, 2))
    assert whole.sum() > 0.5 * len(c)
    np.testing.assert_allclose(c[whole], offline[:300][whole], rtol=0, atol=0.01)
    np.testing.assert_allclose(c[whole][:20], offline[:300][whole][:20], atol=1e-4)
    # Live c goes on while a segment is hidden that it does not need.
    assert np.isfinite(c).sum() >= seen.sum() > 0.8 * len(c)
    assert (
        np.mean(np.array([f.inside for f in live])[seen] == inside[:300][seen]) > 0.99
    )


def test_the_same_frames_give_the_same_bits():
    subject = small_person.subject()
    recording = small_person.protocol().points.recording
    markers = subject.skeleton.marker_set.pick(recording.labels, recording.markers)
    runs = []
    for _ in range(2):
        chosen = subject.readout("intent")
        solver = FrameSolver(
            subject.skeleton, subject.null_space_map, subject.chain, readout=chosen
        )
        controller = Controller(solver, ControlSettings(method="intent"))
        runs.append(
            [
                controller.frame(markers[i], i / 50, i / 50).solved.c[0]
                for i in range(100)
            ]
        )
    np.testing.assert_array_equal(*runs)


def test_other_methods_and_chains_are_refused_live():
    subject = small_person.subject()
    with pytest.raises(InvalidInput, match="expected a method of paper, proximal"):
        ControlSettings(method="proximate")
    with pytest.raises(InvalidInput, match="expected a readout of intent"):
        intent_numbers(subject.skeleton, subject.readout("proximal"))
    other = dataclasses.replace(subject.readout("intent"), chain="left_arm")
    with pytest.raises(InvalidInput, match="expected a readout of right_arm"):
        FrameSolver(
            subject.skeleton, subject.null_space_map, subject.chain, readout=other
        )
