"""The whole chain behind a virtual operator: body, cameras, map."""

from dataclasses import replace

import numpy as np
import pytest
import small_person
from delayed_copy import DelayedCopy

from ikns.errors import InvalidInput
from ikns.experiments.tracking import (
    draw_profile,
    measure,
    schedule,
    virtual_step,
    virtual_trial,
)
from ikns.live.control.settings import ControlSettings
from ikns.simulation import Unsteadiness, simulate_protocol, virtual_subject
from ikns.simulation.operator import (
    Operator,
    Participant,
    draw_participant,
    sample_abilities,
    tracking_place,
    typical,
)

RATE = 50.0
STEADY = Unsteadiness(drift=0, tilt=0, tremor=0, tremor_tilt=0)
CLEAN = {"marker_noise": 0.0, "occluded": 0.0, "unsteadiness": STEADY, "latency": 0.0}


@pytest.fixture(scope="module")
def person():
    run = small_person.protocol()
    angles, place = tracking_place(run)
    abilities = {
        c: sample_abilities(1, seed=0, condition=c)[0] for c in ("ikns", "gamepad")
    }
    return Participant(0, 0, abilities, run, small_person.subject(), angles, place)


def loop(person, *, seconds=2.0, seed=0, **more):
    return person.arm_loop(seconds=seconds, rate=RATE, seed=seed, **more)


def test_the_limb_swivels_the_elbow_and_leaves_the_hand(person):
    arm = loop(person, **CLEAN)
    low, high = person.place.motion.swivel[[0, -1]]
    for share in np.linspace(0, 1, 11):
        q = arm.posture(share)
        hand, rotation = arm.arm.hand(q[7:])
        # The other joints' wandering does not reach the hand but for the clavicle:
        # nothing of it here. A cubic through the steps misses by 1e-8 rad.
        np.testing.assert_allclose(hand, person.place.position, atol=1e-6)
        np.testing.assert_allclose(rotation, person.place.rotation, atol=1e-6)
        swivel = arm.arm.swivel(q[7:])
        assert swivel == pytest.approx(low + share * (high - low), abs=1e-6)


def test_the_hand_drifts_as_people_s_hands_do(person):
    arm = loop(person, seconds=60.0, **CLEAN | {"unsteadiness": Unsteadiness()})
    off = np.empty((3000, 3))
    for k in range(3000):
        arm.frame = k
        hand, _ = arm.arm.hand(arm.posture(0.5 + 0.4 * np.sin(k / 40))[7:])
        off[k] = hand - person.place.position
    # 60 s of a process that forgets in half a second: 120 values an axis, 360 in all,
    # so 4 % in the standard deviation; four of them.
    assert np.sqrt(np.mean(off**2)) == pytest.approx(4e-3, rel=0.16)


def test_markers_are_those_of_the_true_body_plus_what_cameras_do(person):
    arm = loop(person)
    true = arm.arm.skeleton.markers_in_world(arm.posture(0.3))
    labels = arm.arm.skeleton.marker_set.labels
    worn = [labels.index(x) for x in person.subject.skeleton.marker_set.labels]
    clean = loop(person, marker_noise=0.0, occluded=0.0)
    np.testing.assert_allclose(clean.markers(0.3), true[worn], atol=1e-12)
    off = arm.markers(0.3) - true[worn]
    seen = np.isfinite(off)
    # 60 numbers of 1 mm: 9 % in the standard deviation; four of them.
    assert off[seen].std() == pytest.approx(1e-3, rel=0.4)


def test_c_rises_with_the_elbow_over_most_of_its_range(person):
    arm = loop(person, seconds=6.0, **CLEAN)
    c = np.array([arm.step(x) for x in np.linspace(0, 1, 300)])
    assert (np.diff(c) > 0).mean() > 0.98
    # The map was learned from this range elsewhere in the box; the sites of the markers
    # were scaled from a noisy static trial.
    assert c[0] < 0.15
    assert c[-1] > 0.85
    assert arm.solved.in_sight
    assert arm.solved.inside


def test_latency_is_in_whole_frames(person):
    now, later = loop(person, **CLEAN), loop(person, **CLEAN | {"latency": 0.06})
    limb = 0.5 + 0.3 * np.sin(np.arange(60) / 9)
    one, two = ([arm.step(x) for x in limb] for arm in (now, later))
    assert two[3:] == one[:-3]


def test_the_operator_sees_the_flexion_when_the_controller_smooths(person):
    raw, smooth = loop(person), loop(person, settings=ControlSettings())
    limb = np.full(90, 0.5)
    one, two = (np.array([arm.step(x) for x in limb]) for arm in (raw, smooth))
    assert np.isfinite(two).all()
    assert ((two >= 0) & (two <= 1)).all()
    assert np.std(np.diff(two[20:])) < np.nanstd(np.diff(one[20:]))


def test_frames_end(person):
    arm = loop(person, seconds=0.1)
    for _ in range(6):
        arm.step(0.5)
    with pytest.raises(InvalidInput, match="6 frames"):
        arm.step(0.5)


def test_skin_moves_markers_with_the_posture(person):
    # The body's motion does not depend on its skin: the same person, with some.
    run = simulate_protocol(
        virtual_subject(1),
        seed=1,
        n_points=2,
        static_seconds=0.5,
        free_seconds=0.1,
        point_seconds=1.0,
        rate=RATE,
        soft_tissue=5e-3,
    )
    moved = replace(person, protocol=run)
    arm = loop(moved, marker_noise=0.0, occluded=0.0)
    labels = arm.arm.skeleton.marker_set.labels
    worn = [labels.index(x) for x in moved.subject.skeleton.marker_set.labels]
    off = np.array(
        [
            arm.markers(x) - arm.arm.skeleton.markers_in_world(arm.posture(x))[worn]
            for x in (0.0, 0.5, 1.0)
        ]
    )
    # In one frame the random part is the same: what is left is the posture's.
    change = np.linalg.norm(off - off[1], axis=2)
    right = [i for i, k in enumerate(worn) if labels[k].startswith("RUP")]
    assert (change[0, right] > 1e-4).all()
    assert change.max() < 0.03
    assert np.sqrt((off**2).sum(axis=2).mean()) == pytest.approx(5e-3, rel=0.6)


def test_a_delay_of_the_limb_is_recovered_through_the_whole_chain(person):
    profile = draw_profile("T2", 4)
    found = []
    for delay in (0.0, 0.16):
        arm = loop(person, seconds=30.0)
        found.append(
            measure(virtual_trial(DelayedCopy(delay, rate=RATE), arm, profile))
        )
    assert found[1].lag - found[0].lag == pytest.approx(0.16, abs=0.02)
    # What the chain itself takes: its latency of 30 ms is two frames of 20 ms.
    assert found[0].lag == pytest.approx(0.04, abs=0.02)


def test_a_participant_is_drawn_whole_and_the_same_each_time():
    def draw():
        return draw_participant(
            1, seed=3, rate=RATE, static_seconds=1.2, point_seconds=1.5
        )

    one, two = draw(), draw()
    assert one.abilities == two.abilities
    assert set(one.abilities) == {"ikns", "gamepad"}
    np.testing.assert_array_equal(one.place.posture, two.place.posture)
    np.testing.assert_array_equal(
        one.subject.null_space_map.directions_, two.subject.null_space_map.directions_
    )
    # The hand is held within what was explored.
    assert (one.protocol.places.min(axis=0) < one.place.position).all()
    assert (one.protocol.places.max(axis=0) > one.place.position).all()


def test_an_operator_tracks_through_the_whole_chain(person):
    profile = draw_profile("T3", 0)
    arm = loop(person, seconds=30.0)
    operator = Operator(typical().noiseless(), rate=RATE, seed=0, start=arm.comfortable)
    record = virtual_trial(operator, arm, profile)
    found = measure(record)
    still = np.std(profile.at(np.arange(2500) / 100))
    assert found.rmse < still / 3
    assert found.correlation > 0.9


def test_the_same_participant_step_and_settings_give_the_same_record(person):
    steps = [s for s in schedule(0, seed=2) if s.kind == "trial"]
    step = replace(steps[0], condition="gamepad")
    profile = draw_profile(step.profile, step.seed)
    one, two = (virtual_step(person, step, profile, practised=9) for _ in range(2))
    np.testing.assert_array_equal(one.c, two.c)
    other = virtual_step(person, replace(step, repeat=2), profile, practised=9)
    assert not (one.c == other.c).all()


def test_a_direct_trial_is_the_same_person_without_the_chain(person):
    step = replace(schedule(0, seed=2)[-1], condition="ikns", kind="trial")
    profile = draw_profile(step.profile, step.seed)
    direct, whole = (
        measure(
            virtual_step(
                person, step, profile, practised=9, rate=RATE, direct=way, **more
            )
        )
        for way, more in ((True, {}), (False, CLEAN | {"latency": 0.06}))
    )
    assert direct.unseen == whole.unseen == 0
    # Same noise, about the same loop: the errors differ by what the map bends.
    assert direct.rmse == pytest.approx(whole.rmse, rel=0.4)


def test_a_condition_without_a_virtual_operator_is_refused(person):
    step = replace(schedule(0)[0], condition="mouse")
    with pytest.raises(InvalidInput, match="mouse"):
        virtual_step(person, step, draw_profile("T1", 0), practised=0)
