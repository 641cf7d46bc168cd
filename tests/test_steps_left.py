"""The time left of a command of several steps, on a clock that we turn."""

from itertools import accumulate

from hypothesis import given
from hypothesis import strategies as st

from ikns.cli.steps_left import StepsLeft

#: A step takes so many times what it should, and all steps alike by a machine's speed.
SLOWER = 1.25
STEPS = st.lists(
    st.tuples(st.floats(0.5, 5.0), st.floats(1 / SLOWER, SLOWER), st.booleans()),
    min_size=2,
    max_size=12,
)


@given(steps=STEPS, speed=st.floats(0.1, 20.0), when=st.floats(0.2, 0.9))
def test_the_time_left_is_right_within_a_factor_of_two(steps, speed, when):
    now = 0.0
    costs = [cost for cost, _, _ in steps]
    left = StepsLeft(
        [(f"step {k % 3}", cost) for k, cost in enumerate(costs)], clock=lambda: now
    )
    took = [cost * factor * speed for cost, factor, _ in steps]
    ends = list(accumulate(took))
    asked = when * ends[-1]
    events = []
    for k, (_, _, talks) in enumerate(steps):
        for part in range(11 if talks else 1):
            events.append((ends[k] - took[k] * (1 - part / 10), k, part))
    for time, k, part in events:
        if time > asked:
            break
        now = time
        left.report(f"step {k % 3}", part, 10)
    now = asked
    found, true = left.seconds(), ends[-1] - asked
    if left.share() < 0.2 or found is None:
        return
    # Rates so far and to come differ by SLOWER squared. A step that should be over is
    # taken to have a twentieth left; one that is faster than it should be is seen to be
    # when it ends, and no step is more than `longest`.
    longest = max(took)
    assert true / 2 - 0.3 * longest <= found <= 2 * true + 0.3 * longest


def test_nothing_is_known_before_anything_is_done():
    left = StepsLeft([("one", 1.0), ("two", 1.0)], clock=lambda: 5.0)
    assert left.share() == 0.0
    assert left.seconds() is None


def test_a_step_that_comes_back_counts_as_the_next_of_its_name():
    left = StepsLeft([("a", 1.0), ("b", 2.0), ("a", 1.0)], clock=lambda: 5.0)
    left.report("a", 1, 1)
    assert left.share() == 0.25
    left.report("b", 1, 2)
    assert left.share() == 0.5
    left.report("a", 0, 1)
    assert left.share() == 0.75
    left.report("c", 1, 1)  # not one of them
    assert left.share() == 0.75
    left.report("a", 1, 1)
    assert left.share() == 1.0
