"""Pick and place: the objects, the order they come in, and one trial."""

import math
from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.experiments.picking import (
    OBJECT_IDS,
    PickStep,
    PickTrial,
    load_objects,
    pick_schedule,
)

EDGES = {"box": 3, "cylinder": 2, "sphere": 1}

# --- the objects ----------------------------------------------------------------------


def test_the_objects_are_the_rows_of_the_paper_s_table():
    objects = load_objects()
    assert tuple(objects) == OBJECT_IDS == tuple("ABCDEFGHILM")
    assert all(thing.source == "paper" for thing in objects.values())
    # The sum of the printed column, and the widest and tallest of the printed sizes.
    assert sum(t.mass_kg for t in objects.values()) == pytest.approx(1.498)
    assert max(t.size_m[0] for t in objects.values()) == 0.096
    assert max(max(t.size_m) for t in objects.values()) == 0.250


def test_every_object_is_a_solid_that_a_hand_can_take():
    for source in ("paper", "ycb"):
        for code, thing in load_objects(source).items():
            assert thing.id == code
            assert len(thing.size_m) == EDGES[thing.shape]
            assert thing.ycb[:3].isdigit()
            # A unit gone wrong is a factor of 1000: water has 1000 kg/m^3, and an empty
            # cup, of all in the table, the least and a full can the most.
            around = {"box": 1, "cylinder": math.pi / 4, "sphere": math.pi / 6}
            edges = (*thing.size_m, *[thing.size_m[0]] * 2)[:3]
            density = thing.mass_kg / (around[thing.shape] * math.prod(edges))
            assert 50 < density < 1100
            # Widths that the finger has to span, 50 to 100 mm.
            assert 0.050 <= min(thing.size_m) <= 0.100


def test_numbers_of_the_catalog_and_the_paper_are_distinguished():
    paper, ycb = load_objects("paper"), load_objects("ycb")
    differ = [code for code in OBJECT_IDS if paper[code] != ycb[code]]
    assert differ == [code for code in OBJECT_IDS if ycb[code].source == "ycb"] == ["A"]
    assert (ycb["A"].mass_kg, ycb["A"].size_m) == (0.094, (0.057, 0.057, 0.057))
    with pytest.raises(InvalidInput, match="'paper' or 'ycb', found 'web'"):
        load_objects("web")


# --- the schedule ---------------------------------------------------------------------

designs = st.fixed_dictionaries(
    {
        "conditions": st.lists(
            st.sampled_from(["ikns", "ring", "mouse", "foot"]),
            min_size=1,
            max_size=4,
            unique=True,
        ),
        "objects": st.lists(st.sampled_from(OBJECT_IDS), min_size=1, unique=True),
        "repeats": st.integers(1, 3),
        "seed": st.integers(0, 2**63 - 1),
        "training": st.integers(0, 25),
    }
)


@given(st.integers(0, 50), designs)
def test_every_object_comes_once_in_every_block_of_every_condition(subject, design):
    steps = pick_schedule(subject, **design)
    keys = [s.key for s in steps if s.kind != "rest"]
    assert len(set(keys)) == len(keys)
    trials = [s for s in steps if s.kind == "trial"]
    assert Counter((s.condition, s.object, s.repeat) for s in trials) == Counter(
        (condition, code, block)
        for condition in design["conditions"]
        for code in design["objects"]
        for block in range(design["repeats"])
    )
    for condition in design["conditions"]:
        blocks = [s.repeat for s in trials if s.condition == condition]
        assert blocks == sorted(blocks)


@given(st.integers(0, 50), designs)
def test_training_comes_first_and_uses_all_objects_equally(subject, design):
    steps = pick_schedule(subject, **design)
    kinds = [s.kind for s in steps]
    assert kinds.count("rest") == len(design["conditions"]) - 1
    for condition in design["conditions"]:
        own = [s for s in steps if s.condition == condition]
        training = [s.object for s in own if s.kind == "training"]
        assert [s.kind for s in own[: design["training"]]] == ["training"] * len(
            training
        )
        assert len(training) == design["training"]
        counts = [training.count(code) for code in design["objects"]]
        assert max(counts) - min(counts) <= 1
    # One condition after the other: it changes at the rests only.
    for before, after in pairwise(steps):
        rest = "rest" in (before.kind, after.kind)
        assert rest or before.condition == after.condition


@given(designs)
def test_the_order_of_the_conditions_is_balanced_over_subjects(design):
    conditions = design["conditions"]
    n = len(conditions)
    orders = []
    for subject in range(2 * n):  # Williams' orders repeat after n or 2 n
        steps = pick_schedule(subject, **design)
        orders.append(list(dict.fromkeys(s.condition for s in steps if s.condition)))
    for place in range(n):
        assert Counter(order[place] for order in orders) == dict.fromkeys(conditions, 2)
    follows = Counter(pair for order in orders for pair in pairwise(order))
    assert set(follows.values()) <= {2}
    assert len(follows) == n * (n - 1)


@given(st.integers(0, 50), designs)
def test_the_orders_are_drawn_by_seed_subject_and_condition(subject, design):
    def order(number, condition, **other):
        steps = pick_schedule(number, **(design | other))
        return [
            s.object for s in steps if (s.kind, s.condition) == ("trial", condition)
        ]

    first = design["conditions"][0]
    assert order(subject, first) == order(subject, first)
    # More of something leaves what was drawn before it.
    n = len(design["objects"]) * design["repeats"]
    longer = order(subject, first, repeats=4, training=3)
    assert longer[:n] == order(subject, first)


def test_orders_differ_between_subjects_conditions_and_seeds():
    def order(number, condition, seed=0):
        return tuple(
            s.object
            for s in pick_schedule(number, seed=seed)
            if (s.kind, s.condition) == ("trial", condition)
        )

    # 11! orders: two of 60 alike has a chance of 4e-5, and the seeds are fixed.
    drawn = {
        order(number, condition, seed)
        for number in range(10)
        for condition in ("ikns", "ring")
        for seed in range(3)
    }
    assert len(drawn) == 60


def test_objects_come_at_every_place_over_many_subjects():
    firsts = Counter(
        next(s for s in pick_schedule(n, training=0)).object for n in range(1100)
    )
    # 100 of each of 11 expected, standard deviation sqrt(1100 * 10) / 11 = 9.5; the
    # farthest of 22 limits at 5 deviations has a chance of 1e-5, and the seed is fixed.
    assert all(abs(firsts[code] - 100) < 48 for code in OBJECT_IDS)


def test_the_paper_s_visit_is_the_default():
    steps = pick_schedule(3)
    assert len([s for s in steps if s.kind == "trial"]) == 2 * 11
    assert {s.limit for s in steps if s.kind != "rest"} == {20.0}
    assert [s.seconds for s in steps if s.kind == "rest"] == [120.0]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"conditions": []}, "expected distinct conditions"),
        ({"conditions": ["ikns", "ikns"]}, "expected distinct conditions"),
        ({"conditions": "ikns"}, "expected distinct conditions, found 'ikns'"),
        ({"objects": []}, "expected distinct objects"),
        ({"objects": ["A", "A"]}, "expected distinct objects"),
        ({"objects": ["A", "K"]}, "found 'K'"),
        ({"repeats": 0}, "repeats from 1"),
        ({"training": -1}, "training from 0"),
        ({"seed": -1}, "a seed"),
        ({"limit": 0.0}, "limit must be above 0 s"),
        ({"limit": math.nan}, "limit must be above 0 s"),
        ({"rest": -1.0}, "rest 0 s or more"),
    ],
)
def test_impossible_designs_are_refused(options, says):
    with pytest.raises(InvalidInput, match=says):
        pick_schedule(0, **options)


def test_subjects_are_counted_from_0():
    with pytest.raises(InvalidInput, match="found -1"):
        pick_schedule(-1)


# --- one trial ------------------------------------------------------------------------

STEP = PickStep("trial", "ikns", "A")
ENDED = ("success", "dropped", "timeout", "aborted")

zeros = st.floats(-1e6, 1e9)
commands = st.one_of(
    st.tuples(st.just("check"), st.floats(0, 8)),
    st.tuples(st.just("start"), st.floats(0, 8)),
    st.tuples(st.sampled_from(["success", "dropped"]), st.floats(0, 8)),
    st.tuples(st.just("abort"), st.floats(0, 8)),
)


@given(zeros, st.floats(0, 19.9), st.sampled_from(["success", "dropped"]))
def test_a_trial_that_is_stopped_took_the_time_from_start_to_stop(zero, t, outcome):
    trial = PickTrial(STEP)
    assert trial.update(zero - 5.0) == ("waiting", 0.0, 20.0)
    trial.start(zero)
    trial.update(zero + t / 2)
    assert trial.stop(zero + t, outcome).state == outcome
    # A clock of 1e9 s rounds to 1.2e-7 s, once at each end.
    assert trial.record.time == pytest.approx(t, abs=3e-7)
    assert (trial.record.outcome, trial.record.reason) == (outcome, "")


@given(zeros, st.floats(0.01, 1e4))
def test_at_the_limit_exactly_the_time_is_over(zero, limit):
    step = PickStep("trial", "ring", "B", limit=limit)
    trial = PickTrial(step)
    trial.start(zero)
    end = zero + limit
    assert trial.update(math.nextafter(end, -math.inf)).state == "running" or (
        math.nextafter(end, -math.inf) <= zero
    )
    assert trial.stop(end, "success").state == "timeout"
    assert trial.record.time == limit
    assert trial.update(end + 1).left == 0.0


@given(zeros, st.lists(commands, max_size=12))
def test_whatever_is_pressed_the_time_is_within_the_limit_and_the_end_is_final(
    zero, sequence
):
    trial, now, ended = PickTrial(STEP), zero, None
    for command, wait in sequence:
        now, before = now + wait, trial.state
        try:
            if command == "check":
                trial.update(now)
            elif command == "start":
                trial.start(now)
            elif command == "abort":
                trial.abort(now, "why not")
            else:
                trial.stop(now, command)
        except InvalidInput:
            # Only a start too many and a stop too early are refused.
            assert (command == "start") == (before != "waiting")
            assert trial.state == before
        view = trial.update(now)
        assert 0.0 <= view.time <= 20.0
        assert view.left == 20.0 - view.time
        if ended is not None:
            assert repr(trial.record) == repr(ended)  # an unknown time is itself too
        elif view.state in ENDED:
            ended = trial.record
            assert ended.outcome == view.state
            assert (ended.time == 20.0) == (view.state == "timeout")
            assert (ended.reason == "why not") == (view.state == "aborted")


def test_a_clock_that_goes_back_or_is_nan_changes_nothing():
    trial = PickTrial(STEP)
    trial.start(100.0)
    assert trial.update(104.0).time == 4.0
    assert trial.update(101.0).time == 4.0
    assert trial.update(math.nan).time == 4.0
    assert trial.stop(102.0, "success").time == 4.0


def test_a_trial_that_never_started_has_no_time():
    trial = PickTrial(STEP)
    trial.abort(3.0, "wrong object")
    assert (trial.record.outcome, trial.record.reason) == ("aborted", "wrong object")
    assert math.isnan(trial.record.time)


def test_an_abort_after_the_limit_does_not_spoil_the_time_out():
    trial = PickTrial(STEP)
    trial.start(0.0)
    trial.abort(25.0, "too late")
    assert (trial.record.outcome, trial.record.reason) == ("timeout", "")


def test_a_comment_can_be_written_until_the_record_is_taken():
    trial = PickTrial(STEP)
    trial.start(0.0)
    trial.stop(9.0, "dropped")
    trial.comment = "slipped from the finger's tip"
    assert trial.record.comment == "slipped from the finger's tip"


def test_what_a_trial_cannot_do_is_refused():
    trial = PickTrial(STEP)
    with pytest.raises(InvalidInput, match="found it waiting"):
        trial.stop(1.0, "success")
    with pytest.raises(InvalidInput, match="finite time"):
        trial.start(math.nan)
    trial.start(0.0)
    with pytest.raises(InvalidInput, match="found it running"):
        _ = trial.record
    with pytest.raises(InvalidInput, match="found 'timeout'"):
        trial.stop(1.0, "timeout")
    with pytest.raises(InvalidInput, match="found a rest"):
        PickTrial(PickStep("rest"))
    with pytest.raises(InvalidInput, match="above 0 s"):
        PickTrial(PickStep("trial", "ikns", "A", limit=0.0))
